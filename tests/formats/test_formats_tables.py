"""Tables by hand."""

from dnnvss.formats.rows import table_rows
from dnnvss.formats.tables import aligned, markdown_numbers, markdown_table


def test_markdown_by_hand():
    assert markdown_table(["a", "b"], [("x", 1), ("y", 2.5)]) == "| a | b |\n| --- | --- |\n| x | 1 |\n| y | 2.5 |"
    assert markdown_numbers(["a", "b", "c"], []) == "| a | b | c |\n| --- | ---: | ---: |"


def test_text_for_the_screen_is_as_wide_as_its_widest_cell():
    assert aligned(["s", "score"], [["long", "1"]]) == "s     score\n----  -----\nlong      1"


def test_quoted_cells_may_stand_behind_spaces() -> None:
    """Some libraries put every cell in quotes and a space behind every comma."""
    assert table_rows('"frame", "a, b"\n"1", "2"\n')[0] == [(1, ["frame", "a, b"]), (2, ["1", "2"])]


def test_a_quotation_over_several_rows_is_not_one_cell() -> None:
    """Words of a recogniser, one a row: the marks at the first and at the last word are a part of them."""
    rows = table_rows('start, end, word\n0, 1, "hello\n1, 2, there"\n')[0]
    assert rows[1:] == [(2, ["0", "1", '"hello']), (3, ["1", "2", 'there"'])]

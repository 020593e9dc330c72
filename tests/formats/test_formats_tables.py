"""Tables by hand."""

from dnnvss.formats.tables import aligned, markdown_numbers, markdown_table


def test_markdown_by_hand():
    assert markdown_table(["a", "b"], [("x", 1), ("y", 2.5)]) == "| a | b |\n| --- | --- |\n| x | 1 |\n| y | 2.5 |"
    assert markdown_numbers(["a", "b", "c"], []) == "| a | b | c |\n| --- | ---: | ---: |"


def test_text_for_the_screen_is_as_wide_as_its_widest_cell():
    assert aligned(["s", "score"], [["long", "1"]]) == "s     score\n----  -----\nlong      1"

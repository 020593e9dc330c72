"""The latest of many things: how many are kept, and how much of them."""

from dnnvss.studio.speaking.latest import Latest


def test_what_was_asked_for_longest_ago_makes_room() -> None:
    kept = Latest[str](most=2, size_most=100)
    assert kept.put("a", "A", 1) == [] and kept.put("b", "B", 1) == []
    assert kept.get("a") == "A"
    assert kept.put("c", "C", 1) == ["b"] and kept.get("b") is None
    assert [name for name, _ in kept.items()] == ["a", "c"]


def test_a_thing_in_the_place_of_another_counts_once() -> None:
    kept = Latest[str](most=9, size_most=100)
    kept.put("a", "A", 40)
    for _ in range(9):
        assert kept.put("b", "B", 50) == []
    assert kept.put("c", "C", 20) == ["a"] and len(kept) == 2


def test_the_last_one_is_kept_whatever_its_size() -> None:
    kept = Latest[str](most=9, size_most=10)
    kept.put("a", "A", 5)
    assert kept.put("b", "B", 99) == ["a"] and kept.get("b") == "B"

"""Settings are read into typed dataclasses, and what is wrong with one is said in one line."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import pytest

from dnnvss.errors import DnnvssError
from dnnvss.settings import check_settings, read_settings, setting


@dataclass(frozen=True)
class Network:
    hidden: tuple[int, ...] = setting((512, 512), least=1)
    activation: str = setting("tanh", choices=("tanh", "relu"))


@dataclass(frozen=True)
class Everything:
    raw: Path
    epochs: int = setting(12, least=1)
    share: float = setting(0.5, above=0, most=1)
    graph: bool = setting(True)
    name: str = setting("x")
    total: float | None = setting(None, above=0)
    modes: int | float = setting(30, above=0)
    range: tuple[float, int] = setting((0.0, 1))
    groups: Literal["all"] | tuple[int, ...] | None = setting("all", least=0)
    by_group: Mapping[str, float] = setting({}, least=0)
    rule: Literal["speed", "acceleration"] = setting("speed")
    limit: float = setting(1.0, infinite=True)
    network: Network = setting(Network())

    def __post_init__(self) -> None:
        check_settings(self, "every")


def read(**values: Any) -> Everything:
    return read_settings(Everything, {"raw": "a b", **values}, "every")


def test_values_become_what_the_annotation_says() -> None:
    made = read(epochs=3, share=1, range=[2, 3], groups=[1, 2], by_group={"jaw": 2}, network={"hidden": [8]},
                modes=0.95)
    assert made == Everything(Path("a b"), 3, 1.0, range=(2.0, 3), groups=(1, 2), by_group={"jaw": 2.0}, modes=0.95,
                              network=Network((8,)))
    assert isinstance(made.share, float) and isinstance(made.raw, Path) and isinstance(read(modes=3).modes, int)
    assert read().total is None and read(groups=None).groups is None and read(limit=float("inf")).limit == float("inf")
    assert read().by_group is not read().by_group


@pytest.mark.parametrize("wrong, message", [
    ({"epoch": 3}, "every.epoch is no setting. Did you mean every.epochs?"),
    ({"network": {"hiden": [3]}}, "every.network.hiden is no setting. Did you mean every.network.hidden?"),
    ({"epochs": "abc"}, "every.epochs=abc is no whole number. Give a whole number, 1 or more."),
    ({"epochs": 2.5}, "every.epochs=2.5 is no whole number. Give a whole number, 1 or more."),
    ({"epochs": True}, "every.epochs=true is no whole number. Give a whole number, 1 or more."),
    ({"epochs": 0}, "every.epochs=0 is too little. Give a whole number, 1 or more."),
    ({"share": 0}, "every.share=0 is too little. Give a number, more than 0 and 1 at most."),
    ({"share": 2}, "every.share=2 is too much. Give a number, more than 0 and 1 at most."),
    ({"share": float("nan")}, "every.share=nan is not finite. Give a number, more than 0 and 1 at most."),
    ({"limit": float("nan")}, "every.limit=nan is not finite. Give a number."),
    ({"share": None}, "every.share=null is no number. Give a number, more than 0 and 1 at most."),
    ({"graph": [1]}, "every.graph=[1] is no true or false. Give true or false."),
    ({"graph": 1}, "every.graph=1 is no true or false. Give true or false."),
    ({"name": 5}, 'every.name=5 is no text. Give text, in quotes: "5".'),
    ({"name": True}, "every.name=true is no text. Give text, in quotes: YAML takes yes, no, on and off for true and "
     "false."),
    ({"raw": ""}, "every.raw='' is no path. Give a path."),
    ({"raw": 5}, "every.raw=5 is no path. Give a path."),
    ({"total": "abc"}, "every.total=abc is no number. Give a number, more than 0 or null."),
    ({"modes": "abc"}, "every.modes=abc is no number. Give a number, more than 0."),
    ({"range": [1]}, "every.range=[1] is no list. Give [a number, a whole number]."),
    ({"range": 1}, "every.range=1 is no list. Give [a number, a whole number]."),
    ({"groups": "some"}, "every.groups=some is no all or list. "
                         "Give all or a list, each a whole number, 0 or more or null."),
    ({"groups": [0, "x"]}, "every.groups[1]=x is no whole number. Give a whole number, 0 or more."),
    ({"by_group": 2}, "every.by_group=2 is no table of names and values. Give {NAME: a number, 0 or more}."),
    ({"by_group": {"jaw": -1}}, "every.by_group.jaw=-1 is too little. Give a number, 0 or more."),
    ({"by_group": {1: 1}}, "every.by_group: the name 1 is no text. Give a name in letters."),
    ({"rule": "sped"}, "every.rule=sped is unknown. Did you mean speed? There are speed, acceleration."),
    ({"network": 3}, "every.network=3 is no table of names and values. Give a table of names and values."),
    ({"network": {"hidden": 3}},
     "every.network.hidden=3 is no list. Give a list, each a whole number, 1 or more."),
    ({"network": {"hidden": [0]}}, "every.network.hidden[0]=0 is too little. Give a whole number, 1 or more."),
    ({"network": {"activation": "x"}}, "every.network.activation=x is unknown. Use one of tanh, relu."),
    ({"raw": "???"}, "every.raw is not set. Add every.raw=... to the command."),
])
def test_a_mistake_is_one_line_that_names_it(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(DnnvssError) as caught:
        read(**wrong)
    assert str(caught.value) == message


def test_an_instance_built_in_code_is_held_to_the_same_rules() -> None:
    assert Everything(Path("x"), range=[1, 2]).range == (1.0, 2)  # type: ignore[arg-type]
    with pytest.raises(DnnvssError, match=r"every\.epochs=0 is too little"):
        Everything(Path("x"), epochs=0)
    with pytest.raises(DnnvssError, match=r"every\.share=abc is no number"):
        Everything(Path("x"), share="abc")  # type: ignore[arg-type]


def test_what_is_no_table_is_refused() -> None:
    with pytest.raises(DnnvssError, match="trainer=3 is no table of names and values"):
        read_settings(Network, 3, "trainer")  # type: ignore[arg-type]

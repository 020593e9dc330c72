"""Settings without hydra are those that hydra gives; every setting of ``conf/`` refuses a value of another type."""

from collections.abc import Sequence
from dataclasses import fields
from functools import cache
from typing import Any

import pytest
from conftest import ROOT, run_command
from hydra import compose as hydra_compose
from hydra import initialize_config_dir
from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import DictConfig, OmegaConf

from dnnvss.commands import prepare, speak, train
from dnnvss.commands.annotations import is_text
from dnnvss.commands.arguments import Override, SettingsCommand, parse_arguments
from dnnvss.commands.compose import compose
from dnnvss.commands.composed import plain_settings, typed_settings
from dnnvss.commands.conf import choices, groups
from dnnvss.errors import DnnvssError
from dnnvss.settings import read_settings

CONF = ROOT / "conf"


def composed(command: SettingsCommand, *arguments: str) -> DictConfig:
    """The settings that hydra composes from arguments, as the command hands them to it."""
    with initialize_config_dir(str(CONF), version_base="1.3"):
        return hydra_compose(command.config, parse_arguments(command, arguments).for_hydra())


@pytest.mark.parametrize("arguments", [
    [], ["style=plain"], ["style=plain", "style.articulation=1.4", "speech=none"],
    ["rate=29.97", "total=3", "wav=null"],
    ["text=Hello, I am: ${here} {W AY1 N D}", "out=a,b.mp4"], ["+style.by_group.jaw=2", "key_names=[aperture,width]"],
    ["style.by_group.jaw=2"], ["+style.groups={jaw:[aam01,aam03]}", "style.rest=false"],
])
def test_settings_are_those_of_hydra(arguments: list[str]) -> None:
    ours, theirs = compose(parse_arguments(speak.COMMAND, arguments)), composed(speak.COMMAND, *arguments)
    assert OmegaConf.to_container(ours, resolve=True) == OmegaConf.to_container(theirs, resolve=True)
    assert typed_settings(speak.COMMAND, ours) == typed_settings(speak.COMMAND, theirs)


@pytest.mark.parametrize("arguments", [["corpus=grid", "corpus.raw=a b", "jobs=2"], ["corpus=folder", "corpus.raw=x"],
                                       []])
def test_settings_of_a_corpus_are_those_of_hydra(arguments: list[str]) -> None:
    ours, theirs = compose(parse_arguments(prepare.COMMAND, arguments)), composed(prepare.COMMAND, *arguments)
    assert OmegaConf.to_container(ours, resolve=True) == OmegaConf.to_container(theirs, resolve=True)


def names_of(values: dict[str, Any], above: str = "") -> set[str]:
    """The dotted names of all settings."""
    found = set()
    for key, value in values.items():
        found |= names_of(value, f"{above}{key}.") if isinstance(value, dict) and value else {f"{above}{key}"}
    return found


GROUPS = {group: [choice for choice in choices([CONF], group) if (group, choice) != ("corpus", "several")]
          for group in groups(CONF, "train") if group not in ("preset", "experiment", "debug")}
BASES = {
    "train": [[], *([f"{group}={choice}"] for group, own in GROUPS.items() for choice in own)],
    "prepare": [[f"corpus={choice}", "corpus.raw=x"] for choice in choices([CONF], "corpus") if choice != "several"],
    "synth": [[], *([f"{group}={choice}"] for group in ("style", "speech") for choice in choices([CONF], group))],
}
COMMANDS = {"train": train.COMMAND, "prepare": prepare.COMMAND, "synth": speak.COMMAND}
WRONG = ("abc", "[a, {b: 1}]", "{a: [1]}", "true", "null", "-1.5")


@cache
def parsed(typed: str) -> Any:
    """What hydra's grammar reads in an argument."""
    value = OverridesParser.create().parse_override(typed).value()
    return OmegaConf.to_container(OmegaConf.create({"value": value}))["value"]  # type: ignore[index,call-overload]


def changed(values: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    """Nested containers with one value replaced."""
    head, _, rest = key.partition(".")
    return {**values, head: changed(values[head], rest, value) if rest else value}


@cache
def one_of_each(number: int) -> DictConfig:
    """The settings of a training with the choice of this number of every group that has so many."""
    return composed(train.COMMAND, *(f"{group}={own[number]}" for group, own in GROUPS.items() if number < len(own)))


@cache
def everything(name: str) -> dict[str, Any]:
    """The settings of a command with the defaults of all groups; a test of its own walks through them."""
    return plain_settings(composed(COMMANDS[name], *BASES[name][0]))


def refusals(name: str, values: dict[str, Any], whole: Any, typed: Sequence[Override]) -> list[str | None]:
    """What is said of a setting that is typed with each of the wrong values; None where it is taken.

    Of ``values`` only the group of the setting is read again; the others are taken as they are in ``whole``.
    """
    said: list[str | None] = []
    head = typed[0].key.partition(".")[0]
    values = {**{f.name: getattr(whole, f.name) for f in fields(whole) if f.init}, head: values[head]}
    for own in typed:
        value = parsed(Override("", "value", own.value, own.text).for_hydra())
        try:
            read_settings(COMMANDS[name].root, changed(values, own.key, value), "")
            said.append(None)
        except DnnvssError as error:
            said.append(str(error))
    return said


@pytest.mark.parametrize("name, chosen", [(n, tuple(c)) for n, bases in BASES.items() for c in bases],
                         ids=lambda v: " ".join(v) if isinstance(v, tuple) else v)
def test_every_setting_refuses_a_value_of_another_type_in_one_line(name: str, chosen: tuple[str, ...]) -> None:
    group, _, choice = chosen[0].partition("=") if chosen else ("", "", "")
    config = (one_of_each(GROUPS[group].index(choice)) if name == "train" and group
              else composed(COMMANDS[name], *chosen))
    whole = typed_settings(COMMANDS[name], config)  # as it stands it is taken
    own = plain_settings(config)
    keys = sorted(names_of({group: own[group]}) - names_of(everything(name)) if group else names_of(own))
    typed = parse_arguments(COMMANDS[name], [f"{key}={wrong}" for key in keys for wrong in WRONG]).overrides
    for key, wrongs in zip(keys, (typed[at:at + len(WRONG)] for at in range(0, len(typed), len(WRONG))), strict=True):
        said = refusals(name, own, whole, wrongs)
        texts = [text for text in said if text is not None]
        assert all("\n" not in text and key.partition(".")[0] in text for text in texts), (key, texts)
        if not is_text(COMMANDS[name].root, key):
            assert len(texts) >= 3, (key, said)
            last = key.rpartition(".")[2]
            assert all(last in text or key.startswith("face") for text in texts), (key, texts)


@pytest.mark.parametrize("typed, said", [
    ("speak rate=abc", "rate=abc is no frame rate. Give frames a second, e.g. 25, 29.97 or 30000/1001"),
    ("speak scale=1000", "scale=1000 is too much"), ("speak anticipation=1e9", "anticipation=1000000000.0 is too much"),
    ("speak key_positions=null", "key_positions=null is no list"), ("speak total=abc", "total=abc is no number"),
    ("train trainer.stream_weights=1", "trainer.stream_weights=1 is no list"),
    ("train aam.modes=abc", "aam.modes=abc is no number"), ("train seed=x", "seed=x is no whole number"),
    ("train labels.units=none", "labels.units=none is no whole number"),
    ("train trainer.share=2", "trainer.share=2 is too much"), ("train trainer.clip=.nan", "trainer.clip"),
    ("train trajectory.rate=fast", "trajectory.rate=fast is no frame rate"),
    ("prepare jobs=0", "jobs=0 means nothing. Give a whole number, -1 or more, not 0"),
    ("train jobs=0", "jobs=0 means nothing"),
    ("track labels videos --jobs 0", "--jobs=0 means nothing"), ("prepare jobs=many", "jobs=many is no whole number"),
])
def test_a_wrong_value_ends_the_command_in_one_line(typed: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(*typed.split()) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"error: {said}") and error.count("\n") == 1

"""Settings without hydra are the settings that hydra would give."""

from pathlib import Path

import pytest
from conftest import ROOT
from hydra import compose as hydra_compose
from hydra import initialize_config_dir
from omegaconf import OmegaConf

from dnnvss.commands.compose import compose
from dnnvss.commands.entry import _TEXTS, quoted
from dnnvss.errors import DnnvssError

CONF = ROOT / "conf"


@pytest.mark.parametrize("arguments", [
    [], ["style=plain"], ["style=plain", "style.articulation=1.4", "speech=none"],
    ["rate=29.97", "total=3", "wav=null"],
    ["text=Hello, I am: ${here} {W AY1 N D}", "out=a,b.mp4"], ["+style.by_group.jaw=2", "key_names=[aperture,width]"],
    ["+style.groups={jaw:[aam01,aam03]}", "style.rest=false"],
])
def test_settings_are_those_of_hydra(arguments: list[str]) -> None:
    with initialize_config_dir(str(CONF), version_base="1.3"):
        theirs = hydra_compose("synth", quoted(arguments))
    ours = compose(CONF, "synth", arguments, _TEXTS)
    assert OmegaConf.to_container(ours, resolve=True) == OmegaConf.to_container(theirs, resolve=True)


@pytest.mark.parametrize("wrong, message", [
    ("nonsense=1", "unknown setting 'nonsense'"), ("style=loud", "style=loud is unknown.*plain"),
    ("--help", "'--help' is no setting"), ("trainer=paper", "trainer=paper is not used by synth.yaml"),
    ("rate=[1", r"rate=\[1 cannot be read"), ("style.rest.deep=1", "cannot be set|unknown setting"),
])
def test_what_cannot_be_set_is_named(wrong: str, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        compose(CONF, "synth", [wrong], _TEXTS)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(DnnvssError, match="is unknown"):
        compose(tmp_path, "synth", [])

"""YAML of ours is read as OmegaConf reads it."""

from pathlib import Path

import pytest
import yaml
from conftest import ROOT
from omegaconf import OmegaConf

from dnnvss.files.plain_yaml import read_yaml


@pytest.mark.parametrize("path", sorted((ROOT / "conf").rglob("*.yaml")), ids=lambda path: path.stem)
def test_a_file_of_settings_reads_alike(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert read_yaml(text) == OmegaConf.to_container(OmegaConf.create(text))


def test_numbers_dates_and_references() -> None:
    text = "a: 1e-3\nb: 2024-01-02\nc: ${trainer}\nd: .5\ne: 1_000\nf: -.inf\ng: off\nh: '1'\ni: [x, {y: ~}]\n"
    assert read_yaml(text) == OmegaConf.to_container(OmegaConf.create(text))
    assert read_yaml(text)["a"] == 0.001 and read_yaml(text)["b"] == "2024-01-02" and read_yaml("") == {}


@pytest.mark.parametrize("text", [
    "a: 1\na: 2", "a: !!python/object/apply:os.system ['ls']", "a: [", "a: !!python/name:os",
    pytest.param("a: " + 100_000 * "[" + 100_000 * "]", id="deep")])
def test_what_is_no_plain_yaml_is_refused(text: str) -> None:
    with pytest.raises(yaml.YAMLError):
        read_yaml(text)

"""From what hydra or a bundle composed to plain values: nothing below knows of ``DictConfig``."""

from typing import Any

from omegaconf import DictConfig, OmegaConf

from dnnvss.runs.settings import RunSettings
from dnnvss.settings import read_settings


def plain(config: DictConfig) -> dict[str, Any]:
    """The settings in plain containers, resolved; hydra's own are left out."""
    values: dict[str, Any] = OmegaConf.to_container(config, resolve=True)  # type: ignore[assignment]
    return {name: value for name, value in values.items() if name != "hydra"}


def run_settings(config: DictConfig) -> RunSettings:
    """The settings of ``conf/train.yaml``.

    Raises:
        DnnvssError: a setting that there is not, or a value of another kind.
    """
    return read_settings(RunSettings, plain(config), "")

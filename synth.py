"""Speaks text with a trained run; ``python synth.py --help`` lists the settings."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from dnnvss.commands.entry import bundle_settings, command, helped, quoted

if TYPE_CHECKING:
    from omegaconf import DictConfig

CONF = Path(__file__).parent / "conf"


@command
def main(config: "DictConfig") -> None:
    from dnnvss.commands.speak import synthesise

    synthesise(config)


if __name__ == "__main__":
    if helped(CONF, "synth", sys.argv[1:]):
        sys.exit()
    settings = bundle_settings(CONF, sys.argv[1:])
    if settings is not None:
        main(settings)
    else:
        import hydra

        sys.argv[1:] = quoted(sys.argv[1:])
        hydra.main(version_base="1.3", config_path="conf", config_name="synth")(main)()

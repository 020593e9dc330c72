"""Speaks text with a trained run; ``python synth.py --help`` lists the settings."""

import sys

import hydra
from omegaconf import DictConfig

from dnnvss.pipeline.cli import command, quoted


@hydra.main(version_base="1.3", config_path="conf", config_name="synth")
@command
def main(config: DictConfig) -> None:
    from dnnvss.pipeline.synthesise import synthesise

    synthesise(config)


if __name__ == "__main__":
    sys.argv[1:] = quoted(sys.argv[1:])
    main()

"""Trains and evaluates a system; ``python train.py --help`` lists the settings."""

import sys
from pathlib import Path

import hydra
from omegaconf import DictConfig

from dnnvss.commands.entry import command, grouped, helped
from dnnvss.commands.sweep import sweepable


@hydra.main(version_base="1.3", config_path="conf", config_name="train")
@command
@sweepable
def main(config: DictConfig) -> float:
    from dnnvss.commands.train import train

    return train(config)


if __name__ == "__main__":
    sys.argv[1:] = grouped(sys.argv[1:])
    if not helped(Path(__file__).parent / "conf", "train", sys.argv[1:]):
        main()

"""Trains and evaluates a system; ``python train.py --help`` lists the settings."""

import sys

from dnnvss.commands.entry import main

if __name__ == "__main__":
    sys.exit(main(["train", *sys.argv[1:]]))

"""Speaks text with a trained run; ``python synth.py --help`` lists the settings."""

import sys

from dnnvss.commands.entry import main

if __name__ == "__main__":
    sys.exit(main(["speak", *sys.argv[1:]]))

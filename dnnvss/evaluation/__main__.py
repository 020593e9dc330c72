"""Replaced by ``dnnvss compare``."""

from dnnvss.moved import moved

if __name__ == "__main__":
    moved("dnnvss.evaluation", "compare")

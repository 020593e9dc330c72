"""Replaced by ``dnnvss features``."""

from dnnvss.moved import moved

if __name__ == "__main__":
    moved("dnnvss.labels", "features")

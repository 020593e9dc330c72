"""Replaced by ``dnnvss visemes``."""

from dnnvss.moved import moved

if __name__ == "__main__":
    moved("dnnvss.pipeline.visemes", "visemes")

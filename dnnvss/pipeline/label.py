"""Replaced by ``dnnvss label``."""

from dnnvss.moved import moved

if __name__ == "__main__":
    moved("dnnvss.pipeline.label", "label")

"""Replaced by ``dnnvss figure``."""

from dnnvss.moved import moved

if __name__ == "__main__":
    moved("dnnvss.pipeline.figure", "figure")

"""Replaced by ``dnnvss units``."""

from dnnvss.moved import moved

if __name__ == "__main__":
    moved("dnnvss.pipeline.picture_book", "units")

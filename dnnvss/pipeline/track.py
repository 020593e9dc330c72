"""Replaced by ``dnnvss track``."""

from dnnvss.moved import moved

if __name__ == "__main__":
    moved("dnnvss.pipeline.track", "track")

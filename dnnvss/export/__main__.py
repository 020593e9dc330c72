"""Replaced by ``dnnvss export``."""

from dnnvss.moved import moved

if __name__ == "__main__":
    moved("dnnvss.export", "export")

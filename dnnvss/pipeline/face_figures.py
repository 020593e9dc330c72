"""Replaced by ``dnnvss face-figures``."""

from dnnvss.moved import moved

if __name__ == "__main__":
    moved("dnnvss.pipeline.face_figures", "face-figures")

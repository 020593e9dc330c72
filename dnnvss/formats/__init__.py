"""Readers and writers of the files that other tools use: alignments and facial landmarks. Knows nothing of models."""

from dnnvss.formats.alignments import read_alignment, spanning, write_alignment
from dnnvss.formats.grid import read_grid_align, write_grid_align
from dnnvss.formats.htk import read_lab, read_mlf, write_lab, write_mlf
from dnnvss.formats.landmarks import (
    LAYOUT_68,
    MESHES,
    Marks,
    read_landmarks,
    read_marks,
    read_npz,
    read_pts,
    read_pts_sequence,
    write_npz,
    write_pts,
)
from dnnvss.formats.openface import Landmarks, read_openface, write_openface
from dnnvss.formats.stamps import check_times, common_rate, stamped
from dnnvss.formats.textgrid import read_textgrid, write_textgrid
from dnnvss.formats.words import read_words_csv, write_words_csv

__all__ = [
    "LAYOUT_68",
    "MESHES",
    "Landmarks",
    "Marks",
    "check_times",
    "common_rate",
    "read_alignment",
    "read_grid_align",
    "read_lab",
    "read_landmarks",
    "read_marks",
    "read_mlf",
    "read_npz",
    "read_openface",
    "read_pts",
    "read_pts_sequence",
    "read_textgrid",
    "read_words_csv",
    "spanning",
    "stamped",
    "write_alignment",
    "write_grid_align",
    "write_lab",
    "write_mlf",
    "write_npz",
    "write_openface",
    "write_pts",
    "write_textgrid",
    "write_words_csv",
]

"""Files that other tools use: alignments, landmarks, markers and curves, in and out. Knows nothing of models."""

from dnnvss.formats.alignments import check_alignment_file, read_alignment, spanning, write_alignment
from dnnvss.formats.c3d import read_c3d
from dnnvss.formats.cues import Cue, in_order
from dnnvss.formats.curves import Curves, read_curves, write_curves
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
from dnnvss.formats.markers import marker_columns, read_markers, read_trc, write_trc
from dnnvss.formats.openface import Landmarks, read_openface, write_openface
from dnnvss.formats.stamps import check_times, common_rate, stamped
from dnnvss.formats.subtitles import write_srt
from dnnvss.formats.textgrid import read_textgrid, write_textgrid
from dnnvss.formats.timed_text import SUBTITLES, TIMED, read_timed_text
from dnnvss.formats.tracked import Markers
from dnnvss.formats.words import is_words_csv, read_words_csv, write_words_csv

__all__ = [
    "LAYOUT_68",
    "MESHES",
    "SUBTITLES",
    "TIMED",
    "Cue",
    "Curves",
    "Landmarks",
    "Markers",
    "Marks",
    "check_alignment_file",
    "check_times",
    "common_rate",
    "in_order",
    "is_words_csv",
    "marker_columns",
    "read_alignment",
    "read_c3d",
    "read_curves",
    "read_grid_align",
    "read_lab",
    "read_landmarks",
    "read_markers",
    "read_marks",
    "read_mlf",
    "read_npz",
    "read_openface",
    "read_pts",
    "read_pts_sequence",
    "read_textgrid",
    "read_timed_text",
    "read_trc",
    "read_words_csv",
    "spanning",
    "stamped",
    "write_alignment",
    "write_curves",
    "write_grid_align",
    "write_lab",
    "write_mlf",
    "write_npz",
    "write_openface",
    "write_pts",
    "write_srt",
    "write_textgrid",
    "write_trc",
    "write_words_csv",
]

"""Pictures of what a face model has learnt, and how well it sees its talker."""

from pathlib import Path

from dnnvss.corpus import Corpus
from dnnvss.face.base import Face
from dnnvss.face.encoding import FACE
from dnnvss.face.kinds import load_face
from dnnvss.render.plots import plot_modes
from dnnvss.render.seen import seen_figures
from dnnvss.runs.files import RunFiles
from dnnvss.runs.settings import RunSettings


def find_face(folder: Path) -> tuple[Face, Path]:
    """Return the face in a run or an encoding, and the corpus that it is of.

    Raises:
        DnnvssError: there is none.
    """
    places = RunFiles(folder)
    if places.config.is_file():
        corpus = RunSettings.load(folder).corpus_folder  # first: it knows a run of another version
        return load_face(places.face), corpus
    return load_face(folder / FACE), folder.parents[1]


def write_face_figures(folder: Path, out: Path, corpus: Path | None = None, utterance: str | None = None,
                       modes: int = 6) -> list[Path]:
    """The figures of a face, written into ``out``, by path.

    Args:
        folder: a run, or an encoding of a corpus.
        out: where to write.
        corpus: the prepared corpus, where it has moved.
        utterance: whose frames are shown; the first of the validation split where None.
        modes: how many are drawn.

    Raises:
        DnnvssError: no face, corpus or utterance.
    """
    face, root = find_face(folder)
    prepared = Corpus.open(corpus or root)
    written = [plot_modes(out / "modes.png", face, modes)]
    name = utterance or prepared.split("val")[0].id
    return written + seen_figures(out, face, prepared, name)

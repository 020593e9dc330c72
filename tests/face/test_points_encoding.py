"""A corpus without pictures is encoded as points; a face that needs pictures takes what has some, or says so."""

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from face.points_cases import GROUPS, SETTINGS, recorded, turned

from dnnvss import files
from dnnvss.corpus import Corpus, CorpusInfo, Utterance
from dnnvss.errors import DnnvssError
from dnnvss.face.aam import AAMConfig
from dnnvss.face.encoding import FACE, _unfilmed, encode_corpus, encoding_folder, find_encoding
from dnnvss.face.points import PointsFace
from dnnvss.timing import Alignment, Tier


def corpus(root: Path, dimensions: int) -> Corpus:
    """Five utterances of landmarks; the last has no valid frame."""
    utterances = []
    for k in range(5):
        path = f"landmarks/u{k}.npz"
        valid = np.full(200, k < 4)
        points = recorded(dimensions, k, turned(dimensions, k)).astype(np.float32)
        files.write_arrays(root / path, points=points, valid=valid)
        tiers = [Tier("phones", [(0, 1, "sil"), (1, 7, "AA"), (7, 8, "sil")]), Tier("words", [(0, 8, "")])]
        utterances.append(Utterance(f"u{k}", "ah", Alignment(tiers), landmarks=path, frames=200))
    info = CorpusInfo("case", (0, 0), "25", GROUPS, dimensions=dimensions, unit={2: "px", 3: "mm"}[dimensions])
    Corpus.write(root, info, utterances, {"train": ["u0", "u1", "u2"], "val": ["u3"], "test": ["u4"]})
    return Corpus.open(root)


SPLITS = {"train": ["u0", "u1", "u2"], "val": ["u3"], "test": ["u4"]}


@pytest.mark.parametrize("dimensions", [2, 3])
def test_a_corpus_without_pictures_is_encoded(tmp_path: Path, dimensions: int) -> None:
    data = corpus(tmp_path / "corpus", dimensions)
    encoded = encode_corpus(data, SPLITS, SETTINGS, tmp_path / "face", progress=False)
    assert isinstance(encoded.face, PointsFace) and encoded.face.dimensions == dimensions
    assert encoded.dropped == {"u4": "no frame has usable landmarks"}
    code = encoded.clip("u3")
    assert code.parameters.shape == (200, 2) and code.valid.all()
    tracked = encoded.tracked(data, "u3")
    assert tracked == pytest.approx(encoded.face.points(code.parameters), abs=1e-2)
    report = encoded.report
    assert report["unit"] == data.info.unit and report["modes"] == 2
    assert report["reconstruction"]["train"][data.info.unit] < 0.01
    assert report["reconstruction"]["val"]["frames"] == 200
    assert max(report["between_clips"]["all_frames"]) < 1e-3
    again = encode_corpus(data, SPLITS, SETTINGS, tmp_path / "face", progress=False)
    assert again.folder == encoded.folder
    other = encode_corpus(data, SPLITS, replace(SETTINGS, modes="raw"), tmp_path / "face", progress=False)
    assert other.folder != encoded.folder and other.clip("u3").parameters.shape == (200, 13 * dimensions)
    assert find_encoding(data, encoded.folder / "face.npz") is None  # it lies elsewhere than in the corpus


def test_a_folder_that_cannot_be_written_is_told_before_a_face_is_fitted(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dnnvss.face.encoding._make", lambda *given: pytest.fail("it was fitted"))
    monkeypatch.setattr("os.access", lambda path, mode: Path(path) != tmp_path)
    with pytest.raises(DnnvssError, match=r"face\.npz: cannot be written \(Permission denied\)"):
        encode_corpus(corpus(tmp_path / "data", 2), SPLITS, SETTINGS, tmp_path / "face", progress=False)


def test_a_face_that_lies_in_the_folder_of_an_encoding_is_taken(tmp_path: Path) -> None:
    data = corpus(tmp_path / "corpus", 2)
    other = encode_corpus(data, SPLITS | {"train": ["u0"]}, SETTINGS, tmp_path / "face", progress=False)
    home = files.make_folder(encoding_folder(data, SPLITS, SETTINGS, tmp_path / "face"))
    shutil.copyfile(other.folder / FACE, home / FACE)
    encoded = encode_corpus(data, SPLITS, SETTINGS, tmp_path / "face", progress=False)
    assert encoded.folder == home != other.folder
    np.testing.assert_array_equal(encoded.clip("u3").parameters, other.clip("u3").parameters)


@pytest.mark.parametrize(("dimensions", "said"), [
    (2, "none of the 3 training utterances has a video"), (3, "landmarks have 3 coordinates")])
def test_a_face_that_needs_pictures_says_that_there_are_none(tmp_path: Path, dimensions: int, said: str) -> None:
    data = corpus(tmp_path / "corpus", dimensions)
    with pytest.raises(DnnvssError, match=said) as caught:
        encode_corpus(data, SPLITS, AAMConfig(points=SETTINGS.points), tmp_path / "face", progress=False)
    assert "face=points" in str(caught.value)


def test_curves_of_a_rig_want_the_face_that_moves_one(tmp_path: Path) -> None:
    rig: Any = SimpleNamespace(info=SimpleNamespace(dimensions=1), root=tmp_path)
    with pytest.raises(DnnvssError, match=r"curves of a rig.*face=rig"):
        _unfilmed(rig, (), ())

"""The cached stage: what it writes, that it opens at once, and that it resumes."""

import errno
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from face.aam_cases import CONFIG, corpus

from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.face import clips as clips_module
from dnnvss.face.aam import ClipCode
from dnnvss.face.aam import kind as kind_module
from dnnvss.face.encoding import EncodedCorpus, encode_corpus, find_encoding, newest_encoding
from dnnvss.face.kinds import face_kind, load_face
from dnnvss.face.report import between_share

SPLITS = {"train": ["toy0", "toy1", "toy2", "toy3", "toy4"], "test": ["toy5"]}


@pytest.fixture
def toy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Corpus:
    """A prepared corpus whose pictures are read without a video codec."""
    monkeypatch.setattr(clips_module, "video_frames", np.load)
    return corpus(tmp_path / "toy")


def _encode(toy: Corpus, folder: Path, **more: Any) -> EncodedCorpus:
    return encode_corpus(toy, more.pop("splits", SPLITS), more.pop("config", CONFIG), folder, progress=False)


def test_everything_is_written_and_reported(toy: Corpus, tmp_path: Path) -> None:
    encoded = _encode(toy, tmp_path / "aam")
    assert encoded.folder == tmp_path / "aam" / encoded.key
    assert sorted(p.stem for p in (encoded.folder / "codes").iterdir()) == [f"toy{i}" for i in range(6)]
    code = encoded.clip("toy5")
    assert code.parameters.shape == (20, len(encoded.face.names)) and code.parameters.dtype == np.float32
    report = encoded.report
    assert report["reconstruction"]["test"]["pixels"] < 0.1 and report["reconstruction"]["test"]["grey_levels"] < 1
    assert report["reconstruction"]["test"]["frames"] == 20
    assert report["reconstruction"]["test"]["pixels_without_offset"] > report["reconstruction"]["test"]["pixels"]
    assert report["between_clips"]["all_frames"] == pytest.approx([0] * len(encoded.face.names), abs=1e-3)
    assert len(report["between_clips"]["speech"]) == len(encoded.face.names)
    assert report["outliers"] == report["dropped"] == {} and json.dumps(report)


def test_second_call_opens_without_reading_the_corpus(
    toy: Corpus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = _encode(toy, tmp_path / "aam")

    def forbidden(*_: object, **__: object) -> None:
        raise AssertionError("the cache was not used")

    monkeypatch.setattr(kind_module, "KIND", replace(kind_module.KIND, fit=forbidden))
    monkeypatch.setattr(clips_module, "video_frames", forbidden)
    second = _encode(toy, tmp_path / "aam")
    assert second == first and (second.clip("toy0").parameters == first.clip("toy0").parameters).all()


def test_settings_splits_and_data_each_have_a_cache_of_their_own(toy: Corpus, tmp_path: Path) -> None:
    keys = {_encode(toy, tmp_path / "aam").key,
            _encode(toy, tmp_path / "aam", config=replace(CONFIG, modes=3)).key,
            _encode(toy, tmp_path / "aam", splits={"train": SPLITS["train"][:4], "test": ["toy5"]}).key}
    (toy.root / "utterances.jsonl").write_text((toy.root / "utterances.jsonl").read_text().replace('"ah"', '"oh"'))
    keys.add(_encode(Corpus.open(toy.root), tmp_path / "aam").key)
    assert len(keys) == 4


def test_only_the_train_split_is_fitted(toy: Corpus, tmp_path: Path) -> None:
    one = _encode(toy, tmp_path / "a").face
    np.save(toy.root / "video" / "toy5.npy", np.load(toy.root / "video" / "toy5.npy") // 2)
    two = _encode(toy, tmp_path / "b").face
    assert (one.texture_modes == two.texture_modes).all() and (one.mean_shape == two.mean_shape).all()


def test_resumes_after_a_kill_to_the_same_result(toy: Corpus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = _encode(toy, tmp_path / "whole")
    real, done = kind_module.measure_clip, []

    def interrupted(model: object, clip: Any) -> Any:
        if len(done) == 3:
            raise KeyboardInterrupt
        done.append(clip.id)
        return real(model, clip)

    monkeypatch.setattr(kind_module, "measure_clip", interrupted)
    with pytest.raises(KeyboardInterrupt):
        _encode(toy, tmp_path / "aam")
    home = tmp_path / "aam" / whole.key
    assert sorted(p.name for p in (home / "codes").iterdir()) == ["toy0.npz", "toy1.npz", "toy2.npz"]
    assert not (home / "report.json").exists()

    monkeypatch.setattr(kind_module, "KIND", replace(kind_module.KIND, fit=None))  # the fit is kept
    monkeypatch.setattr(kind_module, "measure_clip", lambda model, clip: done.append(clip.id) or real(model, clip))
    resumed = _encode(toy, tmp_path / "aam")
    assert done == ["toy0", "toy1", "toy2", "toy3", "toy4", "toy5"] and resumed.report == whole.report
    for name in done:
        assert (resumed.clip(name).parameters == whole.clip(name).parameters).all()


def test_a_clip_without_a_usable_frame_is_dropped_with_its_reason(toy: Corpus, tmp_path: Path) -> None:
    path = toy.root / "landmarks" / "toy3.npz"
    with np.load(path) as arrays:
        points, valid = arrays["points"], arrays["valid"]
    np.savez(path, points=points, valid=valid & False)
    encoded = _encode(toy, tmp_path / "aam")
    assert encoded.dropped == {"toy3": "no frame has usable landmarks"} == encoded.report["dropped"]
    with pytest.raises(DnnvssError, match="toy3: was not encoded: no frame"):
        encoded.clip("toy3")


def test_a_full_disk_says_so_and_leaves_nothing_half_written(
    toy: Corpus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(np.lib.format, "write_array", full)
    with pytest.raises(DnnvssError, match=r"face\.npz: cannot be written \(No space left on device\)"):
        _encode(toy, tmp_path / "aam")
    assert not [p for p in (tmp_path / "aam").rglob("*") if p.is_file()]


@pytest.mark.parametrize(("splits", "message"), [
    ({"test": ["toy5"]}, "no utterance in split 'train'"),
    ({"train": ["toy0", "toy9"]}, "utterance toy9: is in a split and not in the corpus"),
])
def test_splits_that_cannot_be_say_so(toy: Corpus, tmp_path: Path, splits: dict, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        _encode(toy, tmp_path / "aam", splits=splits)


def test_codes_survive_the_disk(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    code = ClipCode(random.normal(size=(4, 3)).astype(np.float32), random.normal(size=(4, 4)).astype(np.float32),
                    random.normal(size=(5, 2)).astype(np.float32), random.normal(size=(9, 3)).astype(np.float32),
                    np.array([True, False, True, False]), {"texture": [1, 3], "shape": [3]})
    back = ClipCode.load(code.save(tmp_path / "x.npz"))
    assert (back.parameters == code.parameters).all() and (back.pose == code.pose).all()
    assert (back.valid == code.valid).all() and back.outliers == code.outliers
    assert back.texture_offset == pytest.approx(code.texture_offset, abs=2e-3)
    (tmp_path / "x.npz").write_bytes((tmp_path / "x.npz").read_bytes()[:100])
    with pytest.raises(DnnvssError, match=r"x\.npz: cannot be read"):
        ClipCode.load(tmp_path / "x.npz")


def test_share_between_clips_by_hand() -> None:
    clips = [np.array([[0.0, 0.0], [2.0, 0.0]]), np.array([[4.0, 0.0], [6.0, 1.0]])]
    # first column: means 1 and 5, between 4, total 5; second: means 0 and .5, between 1/16, total 3/16
    assert between_share(clips) == pytest.approx([0.8, 1 / 3])


def test_a_corpus_without_pictures_says_which_face_needs_none(tmp_path: Path) -> None:
    toy = corpus(tmp_path / "toy")
    bare = [replace(u, video=None) for u in toy.utterances.values()]
    Corpus.write(toy.root, toy.info, bare, {"train": [u.id for u in bare]})
    with pytest.raises(DnnvssError, match=r"none of the 5 training utterances has a video.*face=points"):
        _encode(Corpus.open(toy.root), tmp_path / "face")


def test_recordings_without_video_are_left_out(toy: Corpus, tmp_path: Path) -> None:
    some = [replace(u, video=None) if u.id in ("toy1", "toy4") else u for u in toy.utterances.values()]
    Corpus.write(toy.root, toy.info, some, {"train": [u.id for u in some]})
    encoded = _encode(Corpus.open(toy.root), tmp_path / "face")
    assert encoded.dropped == {"toy1": "it has no video", "toy4": "it has no video"}
    assert encoded.clip("toy0").parameters.shape[1] == len(encoded.face.names)


def test_an_encoding_is_found_by_its_face_and_gives_tracked_points(toy: Corpus, tmp_path: Path) -> None:
    encoded = _encode(toy, toy.root / "face")
    elsewhere = encoded.face.save(tmp_path / "run" / "aam.npz")
    found = find_encoding(toy, elsewhere)
    assert found is not None and found.folder == encoded.folder and newest_encoding(toy).key == encoded.key
    tracked = found.tracked(toy, "toy5")
    expressed = encoded.face.points(encoded.clip("toy5").parameters)
    assert tracked is not None and tracked == pytest.approx(expressed, abs=0.1)
    assert find_encoding(toy, toy.root / "corpus.json") is None
    assert load_face(elsewhere).kind == "aam"
    with pytest.raises(DnnvssError, match="no face is of the kind 'wax'"):
        face_kind("wax")

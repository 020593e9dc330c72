"""``data_prep.demo``: the built-in talker as a corpus on disk."""

from pathlib import Path

import numpy as np
import pytest

from data_prep import demo
from data_prep.demo import prepare_demo
from dnnvss.corpus import Corpus
from dnnvss.corpus.talker import LANDMARK_GROUPS, Articulators, perform_take, render_frame
from dnnvss.errors import DnnvssError
from dnnvss.media import read_audio, read_video, video_info

SMALL = {"sentences": 4, "size": 80, "jobs": 1}


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Corpus:
    return prepare_demo(tmp_path_factory.mktemp("demo"), **SMALL)


def test_the_corpus_is_whole(corpus: Corpus):
    assert corpus.info.landmark_groups == LANDMARK_GROUPS
    for variant in ("", "unseen"):
        ids = [u.id for name in ("train", "val", "test") for u in corpus.split(name, variant)]
        assert sorted(ids) == sorted(corpus.utterances) == [f"demo_{i:03d}" for i in range(4)]
    for u in corpus.utterances.values():
        points, valid = corpus.landmarks(u)
        assert points.shape == (u.frames, 82, 2)
        assert points.dtype == np.float32 and valid.all()
        assert u.alignment.end == pytest.approx(u.frames / 30)
        sound = read_audio(corpus.path(u, "audio"))
        assert len(sound) == pytest.approx(u.alignment.end * 16000, abs=1)
        assert np.abs(sound).max() > 0.1


def test_video_shows_the_take(corpus: Corpus):
    u = corpus.split("test")[0]
    video = read_video(corpus.path(u, "video"))
    info = video_info(corpus.path(u, "video"))
    assert video.shape == (u.frames, 80, 80, 3) and info.rate == 30
    take = perform_take(u.id, u.text)
    assert take.alignment.to_json() == u.alignment.to_json()
    for frame in (0, u.frames // 2, u.frames - 1):
        drawn = render_frame(Articulators(*take.articulators[frame]), 80).astype(float)
        assert np.sqrt(np.mean((drawn - video[frame]) ** 2)) < 8  # grey levels: camera noise and H.264


def test_resumes_where_it_was_killed(corpus: Corpus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    true_record, made = demo._write_video, []

    def killed(path: Path, take: object, size: int) -> None:
        made.append(path.stem)
        if len(made) == 3:
            raise KeyboardInterrupt
        true_record(path, take, size)

    monkeypatch.setattr(demo, "_write_video", killed)
    with pytest.raises(KeyboardInterrupt):
        prepare_demo(tmp_path, **SMALL)
    assert not (tmp_path / "corpus.json").exists()
    assert len(list((tmp_path / "video").iterdir())) == 2  # nothing half-written
    again = prepare_demo(tmp_path, **SMALL)
    assert len(made) == 3 + 2
    for u in again.utterances.values():
        for kind in ("landmarks", "video", "audio"):
            assert again.path(u, kind).read_bytes() == corpus.path(corpus.utterances[u.id], kind).read_bytes()
    prepare_demo(tmp_path, **SMALL)
    assert len(made) == 5


def test_makes_again_what_was_removed(corpus: Corpus, tmp_path: Path):
    first = prepare_demo(tmp_path, sentences=3, size=64, jobs=1)
    path = first.path(first.utterances["demo_001"], "landmarks")
    before = path.read_bytes()
    path.unlink()
    prepare_demo(tmp_path, sentences=3, size=64, jobs=1)
    assert path.read_bytes() == before


@pytest.mark.parametrize("wrong", [{"sentences": 2}, {"size": 97}, {"size": 32}])
def test_numbers_out_of_range_are_named(wrong: dict[str, int], tmp_path: Path):
    with pytest.raises(DnnvssError, match=str(next(iter(wrong.values())))):
        prepare_demo(tmp_path / "x", **wrong)
    assert not (tmp_path / "x").exists()

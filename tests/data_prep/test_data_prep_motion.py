"""Takes of curves and markers become corpora; what does not fit is told."""

import json
from pathlib import Path

import numpy as np
import pytest

from data_prep import session
from data_prep.facegood import curve_names, prepare_facegood
from data_prep.motion import prepare_motion
from data_prep.session import CURVES, prepare_session
from dnnvss import files
from dnnvss.corpus import Corpus
from dnnvss.corpus.talker.hours import times_of_day
from dnnvss.corpus.talker.session import MARKERS, Faults, capture
from dnnvss.errors import DnnvssError
from dnnvss.face.encoding import encode_corpus
from dnnvss.face.point_set import PointSet
from dnnvss.face.points import PointsSettings
from dnnvss.face.rig import RigSettings
from dnnvss.formats import Curves, Markers, write_alignment, write_curves, write_trc
from dnnvss.media import write_wav
from dnnvss.timing import Alignment, Tier


def curves(
    path: Path, seed: int, names: tuple[str, ...] = ("JawOpen", "MouthClose"), seconds: float = 1.5
) -> None:
    """Write a take of curves at 60 Hz with its words and phone times."""
    times = np.arange(round(60 * seconds)) / 60
    values = 0.5 + 0.4 * np.sin(2 * np.pi * (seed + 1) * times[:, None] + np.arange(len(names)))
    write_curves(path.with_suffix(".csv"), Curves(names, values, times + 3600))
    edges = [0, 0.3, 0.6, 0.9, seconds]
    phones = Tier("phones", zip(edges[:-1], edges[1:], ("sil", "AA", "M", "sil"), strict=True))
    words = Tier("words", [(0, 0.3, ""), (0.3, 0.9, "om"), (0.9, seconds, "")])
    write_alignment(path.with_suffix(".TextGrid"), Alignment([phones, words]))
    files.write_text(path.with_suffix(".txt"), "om")


def tone(path: Path, seconds: float) -> None:
    """Write a sound of two bursts."""
    times = np.arange(round(16000 * seconds)) / 16000
    write_wav(path, (0.3 * np.sin(880 * times) * ((times % 1) < 0.6)).astype(np.float32), 16000)


def test_takes_of_curves_are_a_corpus_of_a_rig(tmp_path: Path) -> None:
    raw = tmp_path / "raw"
    for k in range(4):
        curves(raw / f"take{k}", k)
    curves(raw / "other", 1, ("JawOpen", "Nose"))
    corpus = Corpus.open(prepare_motion(raw, tmp_path / "out", jobs=1, lexicon={"om": "AA M"}))
    assert sorted(corpus.utterances) == ["take0", "take1", "take2", "take3"]
    assert corpus.info.dimensions == 1 and corpus.info.unit == "curve" and corpus.info.rate == "60"
    assert corpus.info.landmark_groups == {"JawOpen": (0, 1), "MouthClose": (1, 2)}
    points, valid = corpus.landmarks(corpus.utterances["take2"])
    assert points.shape == (90, 2, 1) and valid.all() and points[0, 0, 0] == pytest.approx(0.5)
    assert "not those of the corpus: MouthClose" in (tmp_path / "out" / "report.md").read_text()
    ids = list(corpus.utterances)
    encoded = encode_corpus(
        corpus, {"train": ids[:3], "test": ids[3:]}, RigSettings(), tmp_path / "f", progress=False
    )
    assert (
        encoded.face.names == ("JawOpen", "MouthClose") and encoded.tracked(corpus, ids[0]) is None
    )


def test_a_voice_without_words_stands_as_one_neutral_phone(tmp_path: Path) -> None:
    raw = tmp_path / "raw"
    (raw).mkdir()
    files.write_text(raw / "bsname.txt", "3\njaw\nlip\nbrow\n")
    for k in range(3):
        tone(raw / f"t{k}.wav", 4.0)
        np.savez(
            raw / f"bs_value_t{k}.npz",
            bs=np.random.default_rng(k).random((120, 3)).astype(np.float32),
        )
    corpus = Corpus.open(prepare_facegood(raw, tmp_path / "out", jobs=1))
    assert set(corpus.utterances) == {"t0", "t1", "t2"} and list(corpus.info.landmark_groups) == [
        "brow",
        "jaw",
        "lip",
    ]
    utterance = corpus.utterances["t1"]
    assert utterance.text == "" and set(utterance.alignment["phones"].labels) == {"AH", "sil"}
    assert utterance.frames == 120 and corpus.landmarks(utterance)[0].shape == (120, 3, 1)
    with pytest.raises(DnnvssError, match="first line says 4"):
        curve_names(files.write_text(tmp_path / "names.txt", "4\na\nb\n"))


def test_markers_become_points_in_space(tmp_path: Path) -> None:
    raw = tmp_path / "raw"
    for k, text in enumerate(times_of_day(3)):
        take = capture(k, text, faults=Faults(swaps=1, flickers=1))
        write_trc(raw / f"take{k}.trc", Markers(MARKERS, take.seen[:200], 120.0))
        edges = [s for s in take.alignment["phones"] if s.end < 190 / 120]
        phones = Tier("phones", [*edges, (edges[-1].end, 200 / 120, "sil")])
        write_alignment(raw / f"take{k}.TextGrid", Alignment([phones]))
        files.write_text(raw / f"take{k}.txt", "the time is")
    lost = capture(5, "The time is now, two, am.").seen[:100]
    lost[:, MARKERS.index("jig1") :] = np.nan
    write_trc(raw / "lost.trc", Markers(MARKERS, lost, 120.0))
    files.write_text(raw / "lost.txt", "the time")
    corpus = Corpus.open(prepare_motion(raw, tmp_path / "out", jobs=1))
    assert set(corpus.utterances) == {"take0", "take1", "take2"} and corpus.info.rate == "120"
    assert corpus.info.dimensions == 3 and corpus.info.landmark_groups["jig"] == (66, 73)
    told = files.read_json(tmp_path / "out" / "repairs" / "take0.json")
    assert len(told["gaps"]) > 50 and len({frozenset(s[:2]) for s in told["swaps"]}) <= 1
    report = (tmp_path / "out" / "report.md").read_text()
    assert "head motion of" in report and "jig is seen in 0 of 100" in report
    points = PointSet.from_setting("auto", "points")
    encoded = encode_corpus(
        corpus,
        {"train": ["take0", "take1"], "test": ["take2"]},
        PointsSettings(points=points),
        tmp_path / "f",
        progress=False,
    )
    assert {"aperture", "width", "lower_lip"} <= set(encoded.face.gauges) and len(
        encoded.face.names
    ) == 198
    assert encoded.report["reconstruction"]["test"]["mm"] < 1e-3


def test_takes_of_the_user_are_not_taken_for_a_session(tmp_path: Path) -> None:
    raw = tmp_path / "raw"
    (raw / "truth").mkdir(parents=True)
    (raw / "take_001.trc").write_text("recorded")
    old = '{"version": 1, "form": "markers", "sentences": 3, "held_out": 1, "seed": 0}'
    for told in (None, '{"camera": 3}', "[1]", old):
        if told is not None:
            (raw / "session.json").write_text(told)
        with pytest.raises(DnnvssError, match="not empty, and no session"):
            prepare_session(raw, tmp_path / "out", jobs=1)
        assert (raw / "take_001.trc").read_text() == "recorded"


@pytest.mark.parametrize("form", ["markers", "curves"])
def test_a_session_that_was_killed_as_it_was_made_goes_on(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    raw, made = tmp_path / "raw", []
    raw.mkdir()
    (raw / ".session.json.a2b4c6d8.part.json").write_text("killed before it was moved")

    def performed(raw: Path, *asked: object) -> None:
        made.append(asked[:4])
        (raw / "take_000.csv").write_text("begun")
        if len(made) == 1:
            raise KeyboardInterrupt

    monkeypatch.setattr(session, "_perform", performed)
    monkeypatch.setattr(session, "prepare_motion", lambda *asked, **more: raw)
    with pytest.raises(KeyboardInterrupt):
        prepare_session(raw, tmp_path / "out", form=form)
    for _ in range(2):
        assert prepare_session(raw, tmp_path / "out", form=form) == raw
    assert len(made) == 2  # what is whole is not made again
    prepare_session(raw, tmp_path / "out", form=form, seed=1)
    assert len(made) == 3 and json.loads((raw / "session.json").read_text())["whole"] is True


def test_what_is_no_session_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DnnvssError, match="holds no take"):
        (tmp_path / "empty").mkdir()
        prepare_motion(tmp_path / "empty", tmp_path / "out", jobs=1)
    raw = tmp_path / "raw"
    curves(raw / "one", 0)
    write_trc(raw / "two.trc", Markers(("a",), np.zeros((4, 1, 3)), 60.0))
    with pytest.raises(DnnvssError, match=r"curves \(one\) and markers \(two\)"):
        prepare_motion(raw, tmp_path / "out", jobs=1)
    with pytest.raises(DnnvssError, match="not empty, and no session"):
        prepare_session(raw, tmp_path / "out", jobs=1)


@pytest.mark.slow
def test_the_built_in_talker_is_captured_as_curves(tmp_path: Path) -> None:
    corpus = Corpus.open(
        prepare_session(
            tmp_path / "raw", tmp_path / "out", form="curves", sentences=4, held_out=2, jobs=1
        )
    )
    assert len(corpus.utterances) == 6 and list(corpus.info.landmark_groups) == list(CURVES)
    assert [u.id for u in corpus.split("test")] == ["take_004", "take_005"]
    points, _ = corpus.landmarks(corpus.utterances["take_000"])
    assert points.min() >= 0 and points.max() <= 1 and np.ptp(points[:, 0]) > 0.2

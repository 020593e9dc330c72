"""Studies of correlations: draws against covariances of each draw by itself, and a study of the built-in talker."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT, run_command

from dnnvss.commands.conf import read_choice
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.correlations import Series, Study, _covariances, _drawn
from dnnvss.settings import read_settings
from dnnvss.systems.canonical import canonical

MEL = {"name": "mel", "labels": {"blocks": ["logmel"], "logmel": {"bands": 4, "window": 40}}}


def study(**settings: object) -> Study:
    series = [{**MEL, "context": t} for t in (0, 1)]
    return read_settings(Study, {"name": "s", "series": series, **settings}, "study")


def test_running_sums_give_the_covariance_of_each_number_of_frames() -> None:
    rows = np.random.default_rng(0).normal(size=(60, 3))
    for n, found in zip((20, 35, 60), _covariances(rows, np.array([20, 35, 60])), strict=True):
        np.testing.assert_allclose(found, np.cov(rows[:n].T, bias=True), atol=1e-12)


def test_draws_are_those_of_canonical_correlation_itself() -> None:
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=(80, 3)), rng.normal(size=(80, 4))
    y[:, 0] += x[:, 1]
    made = study(first=40, last=80, step=40, repeats=3)
    found = _drawn(made, [(0, x, y)], {"shape": (0, 1), "texture": (2, 3)})
    draws = np.random.default_rng(0)
    for k in range(3):
        drawn = draws.permutation(80)
        for group, own in (("shape", [0, 1]), ("texture", [2, 3])):
            for i, n in enumerate((40, 80)):
                each = np.cov(np.hstack([x, y[:, own]])[drawn[:n]].T, bias=True)
                np.testing.assert_allclose(found[0, group][k, i], canonical(each, 3).correlations[:2], atol=1e-9)
    assert np.ptp(found[0, "shape"][:, 1], axis=0) == pytest.approx([0, 0], abs=1e-9)  # all frames: one draw


def test_a_study_of_a_talker_is_a_picture_a_table_and_numbers(demo: Path, tmp_path: Path,
                                                              capsys: pytest.CaptureFixture) -> None:
    from dnnvss.corpus import SPLITS, Corpus
    from dnnvss.face.encoding import encode_corpus
    from dnnvss.face.kinds import read_face_settings

    corpus = Corpus.open(shutil.copytree(demo, tmp_path / "demo"))
    ids = {name: [u.id for u in corpus.split(name)] for name in SPLITS}
    settings = {**read_choice(ROOT / "conf" / "aam" / "demo.yaml"), "kind": "separate", "texture_modes": 6}
    home = encode_corpus(corpus, ids, read_face_settings("aam", settings), corpus.root / "face", progress=False).folder
    series = "[{name: mel, labels: {blocks: [logmel], logmel: {bands: 4}}}]"
    given = [f"folder={home}", f"out={tmp_path}", f"study.series={series}", "study.repeats=3"]
    assert run_command("correlations", *given, "study.first=40", "study.last=90", "study.step=10") == 0
    kept = json.loads((tmp_path / "sizes.json").read_text())
    assert {k["face"] for k in kept} == {"shape", "texture"} and len(kept) == 4
    assert all(len(k["frames"]) == 6 and 0 <= k["low"][0] <= k["mean"][0] <= k["high"][0] <= 1 for k in kept)
    assert "3 draws" in (tmp_path / "sizes.md").read_text() and (tmp_path / "sizes.png").stat().st_size > 10_000
    assert run_command("correlations", *given, "study.last=100000") == 1
    assert "draws 100000 frames" in capsys.readouterr().err


@pytest.mark.parametrize("name", sorted(p.stem for p in (ROOT / "conf" / "study").glob("*.yaml")))
def test_studies_of_the_paper_can_be_read(name: str) -> None:
    made = read_settings(Study, read_choice(ROOT / "conf" / "study" / f"{name}.yaml"), "study")
    assert made.name == name and made.repeats == 100


def test_labels_that_read_more_than_the_sound_are_refused() -> None:
    with pytest.raises(DnnvssError, match="read more than the sound"):
        read_settings(Series, {"name": "ph", "labels": {"blocks": ["centre_phone"]}}, "study.series")
    with pytest.raises(DnnvssError, match="compares nothing"):
        study(first=100, last=50)

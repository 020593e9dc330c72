"""A folder as users bring it: what is in it is understood or named, and nothing is silently wrong."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from films import talker_folder

from data_prep.align import contrast
from data_prep.folder import prepare_folder
from dnnvss import files
from dnnvss.corpus import Corpus
from dnnvss.formats import read_alignment, write_alignment
from dnnvss.timing import Tier


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return talker_folder(tmp_path_factory.mktemp("brought"), 5, 64)


@pytest.fixture
def raw(recordings: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(recordings, tmp_path / "raw"))


def prepared(raw: Path, out: Path) -> tuple[Corpus, str]:
    corpus = Corpus.open(prepare_folder(raw, out, jobs=1))
    return corpus, files.read_text(out / "report.md", "")


def test_the_alignment_of_another_sentence_is_not_taken(raw: Path, tmp_path: Path) -> None:
    shutil.copyfile(raw / "demo_002.TextGrid", raw / "demo_001.TextGrid")
    corpus, report = prepared(raw, tmp_path / "out")
    assert set(corpus.utterances) == {"demo_000", "demo_002", "demo_003", "demo_004"}
    assert "demo_001.TextGrid: utterance demo_001: its words are" in report


def test_one_other_word_is_noted(raw: Path, tmp_path: Path) -> None:
    text = files.read_text(raw / "demo_001.txt", "")
    first, *rest = text.split()
    files.write_text(raw / "demo_001.txt", " ".join(["Elephants", *rest]))
    corpus, report = prepared(raw, tmp_path / "out")
    assert "demo_001" in corpus.utterances and f"its alignment says {first.lower()!r} where" in report


def test_times_ten_times_too_small_are_refused(raw: Path, tmp_path: Path) -> None:
    alignment = read_alignment(raw / "demo_001.TextGrid")
    (raw / "demo_001.TextGrid").unlink()
    text = write_alignment(raw / "demo_001.lab", alignment).read_text()
    rows = [line.split() for line in text.splitlines()]
    lines = [f"{int(a) // 10} {int(b) // 10} {' '.join(rest)}" for a, b, *rest in rows]
    files.write_text(raw / "demo_001.lab", "\n".join(lines))
    corpus, report = prepared(raw, tmp_path / "out")
    assert "demo_001" not in corpus.utterances and "too small, about 10 times" in report


def test_silence_that_is_louder_than_speech_is_told() -> None:
    loud = np.random.default_rng(0).normal(0, 0.1, 16000).astype(np.float32)
    loud[8000:] *= 0.001
    right = Tier("phones", [(0, 0.5, "AA"), (0.5, 1, "sil")])
    assert contrast(right, loud) == pytest.approx(60, abs=3)
    assert contrast(Tier("phones", [(0, 0.5, "sil"), (0.5, 1, "AA")]), loud) == pytest.approx(-60, abs=3)
    assert contrast(Tier("phones", [(0, 1, "AA")]), loud) == 0

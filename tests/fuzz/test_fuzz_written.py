"""Every kind of text file in any legal dress reads as what was written: ``make fuzz`` tries 10,000 of them."""

import os
import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fuzz import written
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dnnvss import files
from dnnvss.corpus.store import split_files
from dnnvss.formats import read_alignment, read_mlf, read_openface, read_pts
from dnnvss.text.overrides import read_overrides
from dnnvss.timing import Alignment

EXAMPLES = max(20, 4 * int(os.environ.get("DNNVSS_FUZZ", 0)))
"""Of each of the nine kinds: 1,200 each under ``make fuzz``."""


def same(found: Alignment, true: Alignment, *names: str, near: float = 1e-6) -> None:
    """Two alignments have tiers of the same labels and times."""
    for name in names:
        assert found[name].labels == true[name].labels
        assert found[name].edges == pytest.approx(true[name].edges, abs=near)


def a_textgrid(path: Path, rng: random.Random) -> None:
    true = written.alignment(rng)
    path.with_suffix(".TextGrid").write_bytes(written.textgrid(rng, true))
    same(read_alignment(path.with_suffix(".TextGrid")), true, "phones", "words")


def a_lab(path: Path, rng: random.Random) -> None:
    true = written.alignment(rng)
    lines = written.labels(rng, true)
    path.with_suffix(".lab").write_bytes(written.dress(rng, "\n".join(lines) + rng.choice(("", "\n", "\n\n"))))
    same(read_alignment(path.with_suffix(".lab")), true, "phones", "words")


def a_mlf(path: Path, rng: random.Random) -> None:
    true = {f"u{k}": written.alignment(rng) for k in range(rng.randint(1, 3))}
    lines = ["#!MLF!#"]
    for name, own in true.items():
        place, suffix = rng.choice(("*/", "", "/a b/")), rng.choice(("lab", "rec"))
        lines += [f'"{place}{name}.{suffix}"', *written.labels(rng, own), "."]
    path.with_suffix(".mlf").write_bytes(written.dress(rng, "\n".join(lines) + "\n"))
    found = read_mlf(path.with_suffix(".mlf"))
    assert found.keys() == true.keys()
    for name, own in true.items():
        same(found[name], own, "phones", "words")


def a_table(path: Path, rng: random.Random) -> None:
    true = written.alignment(rng)
    path.with_suffix(".csv").write_bytes(written.word_table(rng, true))
    found = read_alignment(path.with_suffix(".csv"))["words"]
    assert found.labels == true["words"].labels[:-1]
    assert found.edges == pytest.approx(true["words"].edges[:-1], abs=1e-6)


def an_align(path: Path, rng: random.Random) -> None:
    true = written.alignment(rng)
    rows = [f"{round(s.start * 25000)}{rng.choice((' ', chr(9)))}{round(s.end * 25000)} {s.label or 'sil'}"
            for s in true["words"]]
    path.with_suffix(".align").write_bytes(written.dress(rng, "\n".join(rows) + rng.choice(("", "\n\n"))))
    same(read_alignment(path.with_suffix(".align")), true, "words", near=2e-5)


def an_openface(path: Path, rng: random.Random) -> None:
    draw = np.random.default_rng(rng.randrange(2**32))
    points, valid = draw.normal(200, 60, (5, 68, 2)), draw.random(5) < 0.7
    path.with_suffix(".csv").write_bytes(written.openface(rng, points, valid))
    found = read_openface(path.with_suffix(".csv"))
    assert found.valid.tolist() == valid.tolist()
    np.testing.assert_allclose(found.points[valid], points[valid], atol=1e-3)


def a_pts(path: Path, rng: random.Random) -> None:
    points = np.random.default_rng(rng.randrange(2**32)).normal(200, 60, (rng.randint(1, 70), 2))
    path.with_suffix(".pts").write_bytes(written.points_file(rng, points))
    np.testing.assert_allclose(read_pts(path.with_suffix(".pts")), points, atol=1e-3)


def splits(path: Path, rng: random.Random) -> None:
    ids = [rng.choice(("café_", "müll", "clip ", "a.b_", "日本")) + str(k) for k in range(rng.randint(1, 9))]
    lines = [line for i in ids for line in ([i + rng.choice(("", "  ")), ""] if rng.random() < 0.2 else [i])]
    folder = path / "splits"
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    (folder / rng.choice(("train.txt", "Train.TXT"))).write_bytes(written.dress(rng, "\n".join(lines) + "\n"))
    assert split_files(folder) == {"train": ids}


def texts(path: Path, rng: random.Random) -> None:
    words = ("Zoë", "says", "“don\u2019t”", "stop,", "naïve", "€5", "ok")
    text = " ".join(rng.choice(words) for _ in range(20)) + "\nend\n"
    path.with_suffix(".txt").write_bytes(written.dress(rng, text))
    assert files.read_text(path.with_suffix(".txt"), "") == text
    own = {"grid": "G R IH D", "zoë": "Z OW1 IY0"}
    lines = [f"{word.upper()}{rng.choice((' ', chr(9)))}{phones}" for word, phones in own.items()]
    path.with_suffix(".dict").write_bytes(written.dress(rng, "\n".join(["# mine", "", *lines]) + "\n"))
    assert read_overrides(path.with_suffix(".dict")) == own


@pytest.mark.parametrize("kind", [a_textgrid, a_lab, a_mlf, a_table, an_align, an_openface, a_pts, splits, texts],
                         ids=lambda kind: kind.__name__)
def test_a_file_in_any_dress_reads_as_what_was_written(kind: Callable[[Path, random.Random], None],
                                                       tmp_path: Path) -> None:
    @settings(max_examples=EXAMPLES, deadline=None, derandomize=True, database=None,
              suppress_health_check=list(HealthCheck))
    @given(st.integers(0, 2**48))
    def holds(seed: int) -> None:
        kind(tmp_path / "a", random.Random(seed))

    holds()

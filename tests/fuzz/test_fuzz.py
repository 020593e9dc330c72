"""Damaged files end in a right answer or in an error of ours: no other exception, no hang, no gigabyte.

``DNNVSS_FUZZ=1000`` tries so many damages of each kind of file (``make fuzz``); the same number tries the same ones.
"""

import os
import random
import resource
import signal
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from formats.test_formats_timed_text import RECOGNISED
from fuzz.damage import damaged
from fuzz.inputs import Input, all_inputs
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dnnvss.errors import DnnvssError

EXAMPLES = int(os.environ.get("DNNVSS_FUZZ", "6"))
SECONDS, BYTES = 20, 1e9
FIXED = settings(
    max_examples=EXAMPLES,
    derandomize=True,
    database=None,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
KINDS = (
    "TextGrid",
    "lab",
    "mlf",
    "csv",
    "align",
    "openface",
    "openface 3",
    "pts",
    "landmarks npz",
    "landmarks json",
    "corpus json",
    "utterances",
    "split",
    "corpus landmarks",
    "encoding report",
    "durations",
    "talker",
    "voice",
    "points face",
    "aam face",
    "points code",
    "clip code",
    "neutral",
    "config",
    "run json",
    "model",
    "model as arrays",
    "metrics",
    "reference",
    "speech",
    "bundle json",
    "labels",
    "label points",
    "labelme",
    "coco",
    "via",
    "keys csv",
    "keys json",
    "overrides",
    "code store",
    "trc",
    "markers csv",
    "live link",
    "c3d",
    "obj",
    "glb",
    "gltf",
    "gltf bytes",
    "srt",
    "vtt",
    *(f"heard by {name}" for name in RECOGNISED),
    "take json",
    "head points",
    "session json",
    "run scores",
    "rig face",
    "rig code",
    "judged",
    "viewing test preference",
    "answer preference",
    "viewing test single",
    "answer single",
)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Input]:
    """Every kind of file, a right one."""
    return all_inputs(tmp_path_factory.mktemp("fuzz"))


def test_every_kind_is_tried(inputs: dict[str, Input]) -> None:
    assert set(inputs) | {"c3d"} == set(KINDS)  # which needs a package to be written
    for name, kind in inputs.items():
        if name != "bundle json":  # which names files that are not there
            kind.read(kind.path)


@pytest.mark.parametrize("name", KINDS)
def test_damage_ends_in_an_answer_or_an_error_of_ours(name: str, inputs: dict[str, Input]) -> None:
    if name not in inputs:
        pytest.skip("ezc3d writes the right file, of pip install dnnvss[motion]")
    kind = inputs[name]
    right = kind.path.read_bytes()

    @FIXED
    @given(st.integers(0, 2**48))
    def holds(seed: int) -> None:
        kind.path.write_bytes(damaged(right, random.Random(f"{name} {seed}")))
        tried(kind)

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            holds()
    finally:
        kind.path.write_bytes(right)


def tried(kind: Input) -> None:
    """Read a file as :func:`answered` does, within bounds of time and memory."""
    before, start = _peak(), time.process_time()
    with _within(round(3 * SECONDS * max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1)))):
        answered(kind)
    assert time.process_time() - start < SECONDS
    assert _peak() - before < BYTES


@contextmanager
def _within(seconds: int) -> Iterator[None]:
    """Let a block fail that lasts longer; only the main thread can be told so."""

    def over(*_: Any) -> None:
        raise TimeoutError(f"more than {seconds} seconds")

    if not hasattr(signal, "SIGALRM") or threading.current_thread() is not threading.main_thread():
        yield
        return
    signal.signal(signal.SIGALRM, over)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)


def answered(kind: Input) -> None:
    """Read a file; an error of ours names a file or says what to do."""
    try:
        kind.read(kind.path)
    except DnnvssError as error:
        assert error.file is not None or error.remedy
        assert len(str(error)) < 3000
        assert not set(str(error)) & {"\x1b", "\x07", "\r", "\x9b", "\u202e"}


def _peak() -> float:
    """The largest memory of this process so far in bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def test_what_campaigns_found_stays_mended(tmp_path: Path, inputs: dict[str, Input]) -> None:
    """Inputs that once ended in tracebacks, by kind of file."""
    for name, text in CASES:
        kind = inputs[name]
        right = kind.path.read_bytes()
        try:
            kind.path.write_text(text, encoding="utf-8")
            with pytest.raises(DnnvssError) as caught:
                kind.read(kind.path)
            assert caught.value.remedy or caught.value.file, name
        finally:
            kind.path.write_bytes(right)


CASES = (
    ("corpus json", "NaN"),
    ("corpus json", "0"),
    ("corpus json", '{"name": "a", "size": [96, false], "rate": "25", "landmark_groups": {}}'),
    ("corpus json", '{"name": "a", "size": [96, 96], "rate": "25", "landmark_groups": Infinity}'),
    ("corpus json", '{"name": "a", "size": [96, 96], "rate": "25", "landmark_groups": {"jaw": [-1]}}'),
    ("corpus json", '{"name": "a", "size": [96, 96], "rate": "25", "landmark_groups": {"jaw": [35, "1/0"]}}'),
    ("run json", "null"),
    ("bundle json", '{"dnnvss": "0.1.0"}'),
    ("bundle json", '{"network": [[]], "run": "a", "dnnvss": "0.1.0", "digests": {}}'),
    ("keys json", "5"),
    ("keys json", "-1"),
    ("keys json", '[{"time": 0.1, "name": "aam01", "value": 1, "end": 1e999}]'),
    ("keys json", '[{"time": 0.1, "name": "aam01", "low": 1, "high": 2, "phone": "N", "index": Infinity}]'),
    ("openface", "frame,success,x_0,y_0\nnan,1,5,6\n"),
    ("openface", "frame,success,x_0,y_0\n400000000,1,5,6\n"),
    ("openface", "frame,success,x_0,y_0\n1,1,5,6\n1,1,5,6\n"),
    ("openface", "frame,success,x_0,y_0\n-1,1,5,6\n"),
    ("lab", "0 ٣000000 sil\n"),
    ("lab", "5" * 400),
    ("mlf", f'#!MLF!#\n"*/a.lab"\n0 {"5" * 400} sil\n.\n'),
    ("align", "0 1e999 sil\n"),
    (
        "labels",
        '{"groups": {"lips": [0, 4]}, "labels": [{"video": "v", "frame": 0, "image": '
        '"../../etc/passwd", "points": "a.pts"}]}',
    ),
    ("config", "../../../../etc/passwd\n...\n"),
    (
        "voice",
        '{"phones": ["AA", []], "pauses": [], "variant": "en_us", '
        '"rate": "25", "credit": "", "triphones": []}',
    ),
    ("labelme", '{"imagePath": "a_0.png", "shapes": [{"label": "0", "points": -1}]}'),
    ("labelme", '{"imagePath": "a_0.png", "shapes": [{"label": "0", "points": [[1.0]]}]}'),
    ("labelme", '{"imagePath": "a_0.png", "shapes": [Infinity]}'),
    ("via", '{"k": {"filename": "a_0.png", "regions": [{"a": 1}]}}'),
    (
        "coco",
        '{"images": [{"id": 0, "file_name": "a_0.png"}], "annotations": [{"image_id": 0, "keypoints": [1, 2]}]}',
    ),
    (
        "coco",
        '{"images": [{"id": 0, "file_name": "a_0.png"}], "annotations": [{"image_id": 0, "keypoints": [1, "-5", 2]}]}',
    ),
)

"""Examples of a corpus: the recorded sound reaches the labels that read it, and no others."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from conftest import CLOCK

from dnnvss.acoustics import LogMel, analyse
from dnnvss.corpus import Corpus, CorpusInfo, Utterance
from dnnvss.curves import STATIC_DELTA_DELTA2
from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable, Settings
from dnnvss.media import Sound, write_wav
from dnnvss.systems.examples import Task, make_examples, with_altered
from dnnvss.timing import Alignment, Tier

TABLE = FeatureTable(("centre_phone", "logmel"), Settings(logmel=LogMel(bands=3)), "labels=mine")


def corpus_of(root: Path) -> Corpus:
    """Two utterances of 0.4 s, the second without sound."""
    tiers = Alignment([Tier("phones", [(0, 0.1, "sil"), (0.1, 0.4, "AA")]),
                       Tier("words", [(0, 0.1, ""), (0.1, 0.4, "ah")])])
    write_wav(root / "audio" / "a.wav", np.random.default_rng(0).normal(0, 0.1, 6400), 16000)
    rows = [Utterance("a", "ah", tiers, audio="audio/a.wav", frames=10), Utterance("b", "ah", tiers, frames=10)]
    Corpus.write(root, CorpusInfo("toy", (64, 48), "25"), rows, {"train": ["a"], "val": ["b"]})
    return Corpus.open(root)


def encoded() -> Any:
    clip = SimpleNamespace(parameters=np.zeros((10, 2)), valid=np.ones(10, dtype=bool))
    return SimpleNamespace(dropped={}, clip=lambda _: clip)


def test_the_recorded_sound_reaches_the_labels(tmp_path: Path) -> None:
    corpus = corpus_of(tmp_path)
    utterance = corpus.utterances["a"]
    sound = corpus.sound(utterance)
    assert (sound.rate, len(sound.samples), sound.seconds) == (16000, 6400, 0.4)
    task = Task(TABLE, CLOCK, STATIC_DELTA_DELTA2)
    other = Tier("visemes", [(0, 0.4, "1")])
    for visemes in (None, {"a": [other, other]}):
        (example,) = make_examples(task, corpus, [utterance], encoded(), visemes)
        for codes in (example.codes, *example.alternatives):
            np.testing.assert_array_equal(codes.numeric(np.arange(40)), analyse(sound, LogMel(bands=3), CLOCK, 0, 40))
        assert len(example.alternatives) == (visemes is not None)


def test_labels_without_sound_open_none(tmp_path: Path) -> None:
    corpus = corpus_of(tmp_path)
    phones = Task(FeatureTable(("centre_phone",)), CLOCK, STATIC_DELTA_DELTA2)
    assert [e.id for e in make_examples(phones, corpus, list(corpus.utterances.values()), encoded())] == ["a", "b"]
    task = Task(TABLE, CLOCK, STATIC_DELTA_DELTA2)
    with pytest.raises(DnnvssError, match=r"utterance b: has no audio"):
        task.sound(corpus, corpus.utterances["b"])
    with pytest.raises(DnnvssError, match=r"labels=mine reads the sound, and there is none.*wav="):
        task.example(corpus.utterances["a"])
    assert isinstance(task.sound(corpus, corpus.utterances["a"]), Sound)


def test_altered_sounds_are_learnt_from_the_same_each_time(tmp_path: Path) -> None:
    corpus = corpus_of(tmp_path)
    task = Task(TABLE, CLOCK, STATIC_DELTA_DELTA2)
    examples = list(make_examples(task, corpus, [corpus.utterances["a"]], encoded()))
    (first,), (again,) = (list(with_altered(task, corpus, examples, 3, [corpus.utterances["a"]])) for _ in range(2))
    numbers = [codes.numeric(np.arange(40)) for codes in (first.codes, *first.further)]
    assert len(numbers) == 4
    assert all((one != other).any() for k, one in enumerate(numbers) for other in numbers[:k])
    assert not first.alternatives and first.further == first.altered  # which nobody predicts from
    for codes, same in zip(first.altered, again.altered, strict=True):
        np.testing.assert_array_equal(codes.numeric(np.arange(40)), same.numeric(np.arange(40)))
        np.testing.assert_array_equal(codes.active(np.arange(40)), first.codes.active(np.arange(40)))

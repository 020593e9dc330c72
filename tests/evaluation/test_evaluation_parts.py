"""Sentences left out in turn: what each is said by is the system of the run, but for what it has not heard."""

from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from conftest import CLOCK, TABLE, composed, make_example
from face.face_cases import LinearFace

from dnnvss import files
from dnnvss.commands.train_settings import run_settings
from dnnvss.corpus import Corpus, CorpusInfo, Utterance
from dnnvss.curves import STATIC_DELTA_DELTA2
from dnnvss.errors import DnnvssError
from dnnvss.evaluation import run as evaluated
from dnnvss.evaluation.run import unheard_parts
from dnnvss.evaluation.viewing.stimuli import Studio
from dnnvss.media import write_wav
from dnnvss.runs.files import RunFiles
from dnnvss.runs.fitting import Material, gather
from dnnvss.runs.folds import folded
from dnnvss.systems import Example, VisualModel
from dnnvss.systems.examples import Task, word_frames
from dnnvss.systems.network import NetworkModel
from dnnvss.timing import Alignment, Tier

judging = import_module("dnnvss.evaluation.outside.judge")  # whose function has its name in the package
FACE = LinearFace(np.zeros((4, 2)), np.random.default_rng(0).normal(size=(3, 4, 2)), contours={"lips": [0, 1]})


def material(examples: list[Example], *given: str) -> Material:
    settings = run_settings(composed("train", "labels=ph_d", *given))
    encoded: Any = SimpleNamespace(face=FACE)
    corpus: Any = SimpleNamespace(fingerprint="abc")
    return Material(settings, corpus, encoded, {"train": examples, "val": [], "test": examples}, folds=2)


def test_a_part_knows_the_face_as_the_run_does(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    parts = unheard_parts(material(examples["train"], "model=clusters", "model.clusters=8", "model.starts=2",
                                   "model.nodes=[{name: mouth, groups: [lips]}]"), tmp_path)
    assert [set(part.generator.model.state()["parts"]) for part in parts] == [{"face", "mouth"}] * 2


def test_a_part_is_refined_as_the_run_is(examples: dict[str, list[Example]], tmp_path: Path,
                                         monkeypatch: pytest.MonkeyPatch) -> None:
    passes: list[tuple[Path, set[str]]] = []

    def spied(model: NetworkModel, train: list[Example], val: list[Example], join: object, folder: Path) -> None:
        passes.append((folder, {e.id for e in (*train, *val)}))

    monkeypatch.setattr(NetworkModel, "refine", spied)
    monkeypatch.setattr(NetworkModel, "fit", lambda *given: None)
    monkeypatch.setattr(evaluated, "learn_talker", lambda *given: None)
    made = material(examples["train"], "model=feedforward", "trainer.refine=1")

    def without(part: int) -> VisualModel:
        return evaluated.make_model(made.settings, made.settings.task)

    for _ in range(2):  # with networks of its own, and with those of a training of several talkers
        parts = list(unheard_parts(made, tmp_path, without if passes else None))
        assert [folder for folder, _ in passes[-2:]] == [tmp_path / "1" / "refined", tmp_path / "2" / "refined"]
        for (_, seen), part in zip(passes[-2:], parts, strict=True):
            assert not seen & {e.id for e in part.examples["test"]}


def talkative(root: Path) -> Corpus:
    """Five utterances of 0.4 s with sound."""
    tiers = Alignment([Tier("phones", [(0, 0.1, "sil"), (0.1, 0.4, "AA")]),
                       Tier("words", [(0, 0.1, ""), (0.1, 0.4, "ah")])])
    rng = np.random.default_rng(0)
    for name in "abcde":
        write_wav(root / "audio" / f"{name}.wav", rng.normal(0, 0.1, 6400), 16000)
    rows = [Utterance(name, "ah", tiers, audio=f"audio/{name}.wav", frames=10) for name in "abcde"]
    Corpus.write(root, CorpusInfo("toy", (64, 48), "25"), rows, {"train": ["a", "b", "c"], "val": ["d"], "test": ["e"]})
    return Corpus.open(root)


@pytest.mark.parametrize("folds", [0, 5])
def test_every_part_learns_from_altered_sounds_and_says_the_recorded_one(tmp_path: Path, folds: int) -> None:
    corpus = talkative(tmp_path)
    clip = SimpleNamespace(parameters=np.random.default_rng(1).normal(size=(10, 2)), valid=np.ones(10, dtype=bool))
    encoded: Any = SimpleNamespace(dropped={}, clip=lambda _: clip)
    settings = run_settings(composed("train", "labels=mel", "model=recurrent", "trainer.altered=2", f"folds={folds}"))
    made = gather(settings, corpus, encoded)
    assert {len(e.further) for e in made.examples["train"]} == {2}
    parts = folded(made.examples["test"], folds) if folds else []
    assert {len(e.further) for part in parts for e in part["train"]} == ({2} if folds else set())
    assert not any(e.alternatives for part in (made.examples, *parts) for own in part.values() for e in own)


@pytest.mark.parametrize("tested, shown", [("e", ["e"]), ("ecadb", ["d"])])
def test_viewers_and_trackers_see_sentences_that_the_run_has_not_learnt_from(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tested: str, shown: list[str]) -> None:
    """Left out in turn, all five were tested; what speaks has learnt from all but the one that validates."""
    corpus, settings = talkative(tmp_path), SimpleNamespace(split="", corpus_folder=tmp_path, style=None)
    data: Any = SimpleNamespace(arrays={"reference": dict.fromkeys(tested)}, settings=settings)
    design: Any = None
    assert Studio(design, (), (data, data), corpus, ()).unlearnt == shown

    files.write_arrays(RunFiles(tmp_path).prediction("reference"), **{i: np.zeros((1, 1)) for i in tested})
    run: Any = SimpleNamespace(face=None, files=RunFiles(tmp_path), folder=tmp_path, settings=settings)
    monkeypatch.setattr(judging.Run, "open", lambda folder: run)
    monkeypatch.setattr(judging, "Textured", object)
    monkeypatch.setattr(judging, "open_corpus", lambda *given: corpus)
    with pytest.raises(DnnvssError, match="that it has not learnt from has a video"):  # none of these is filmed
        judging.judge(tmp_path, Any)  # type: ignore[arg-type]
    seen: list[str] = []
    monkeypatch.setattr(judging, "_drawn", lambda ids, count, seed: seen.extend(ids) or [])
    with pytest.raises(DnnvssError):
        judging.judge(tmp_path, Any)  # type: ignore[arg-type]
    assert seen == shown


def test_inside_new_words_all_curves_count_where_a_face_has_no_points(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    known, new = make_example("known", rng, 7), make_example("new", rng, 7)
    words = new.alignment["words"]
    new = replace(new, alignment=new.alignment.with_tier(words.renamed("other" if w else "" for w in words.labels)))
    said = new.measured[0][:, 0] + rng.normal(0, 0.5, (len(new.codes), 7))
    part: Any = SimpleNamespace(examples={"train": [known], "test": [new]})
    face = LinearFace(np.zeros((0, 2)), np.zeros((7, 0, 2)))
    line, _ = evaluated._unseen_words(tmp_path, Task(TABLE, CLOCK, STATIC_DELTA_DELTA2), face, [part],
                                      {"model": {"new": said}}, {"new": new.measured[0][:, 0]},
                                      {"new": new.measured[1]})
    frames = word_frames(new.alignment, CLOCK, {"word"})
    told = [np.corrcoef(new.measured[0][frames, 0, d], said[frames, d])[0, 1] for d in range(7)]
    assert line == [f"Inside words that never occur in training (1 sentence): correlation model {np.mean(told):.3f}"]

"""Words never heard: what is held back, the mean over splits, and a run that is fitted without them."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import make_example, run_command

from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.unseen import HeldOut, Leaving, Unheard, held_out, without
from dnnvss.runs.files import RunFiles
from dnnvss.timing import Alignment, Tier


def said(*words: str) -> Alignment:
    """A sentence whose words last a second and have the phones of their letters."""
    letters = {"a": "AA", "b": "B", "m": "M", "s": "S", "o": "OW"}
    phones = [(k + i / len(w), k + (i + 1) / len(w), letters[p]) for k, w in enumerate(words) for i, p in enumerate(w)]
    return Alignment([Tier("phones", phones), Tier("words", [(k, k + 1, w) for k, w in enumerate(words)])])


SENTENCES = [*[said("ba", "so")] * 8, said("ma", "so"), said("ma", "ba")]


def test_a_split_holds_back_all_words_of_a_phone() -> None:
    found = held_out(SENTENCES, 3, share=0.2)
    assert {each.words for each in found} == {("ma",)} and {each.phones for each in found} == {("M",)}


def test_no_more_than_the_share_of_sentences_is_lost_and_phones_differ() -> None:
    sentences = [said(word, "ba") for word in ("so", "os", "ma", "am", "oo", "mm", "ab", "bb", "sb", "bs")]
    found = held_out(sentences, 2, share=0.4)
    for each in found:
        lost = sum(not set(s["words"].labels).isdisjoint(each.words) for s in sentences)
        assert 0 < lost <= 4
    assert set(found[0].phones).isdisjoint(found[1].phones) and all(each.phones for each in found)
    assert found == held_out(sentences, 2, share=0.4) and found != held_out(sentences, 2, seed=1, share=0.4)


def test_words_that_all_sentences_say_are_refused() -> None:
    with pytest.raises(DnnvssError, match="every word is said in more than 15%"):
        held_out([said("ba")] * 5)


def test_sentences_with_a_word_held_back_are_only_tested() -> None:
    examples = [make_example(str(k), np.random.default_rng(1)) for k in range(len(SENTENCES))]
    examples = [replace(e, alignment=s) for e, s in zip(examples, SENTENCES, strict=True)]
    kept, tested = without(examples, HeldOut(("ma",), ("M",)))
    assert [e.id for e in tested] == ["8", "9"] and len(kept) == 8


def test_the_mean_over_splits_has_students_interval() -> None:
    held = HeldOut(("ma",), ())
    values = {"inside the words": (0.5, 0.6, 0.7), "inside the phones": (None, 0.2, None), "beside them": (0.9,) * 3}
    unheard = Unheard(tuple(Leaving(held, (2, 8), {"model": {m: v[k] for m, v in values.items()}}) for k in range(3)))
    assert unheard.mean("model", "inside the words") == pytest.approx((0.6, 4.302653 * 0.1 / np.sqrt(3)))
    assert unheard.mean("model", "inside the phones") == pytest.approx((0.2, np.nan), nan_ok=True)
    assert "0.600 ± 0.248" in unheard.table() and "| ma | none | 2 of 8 |" in unheard.markdown()


@pytest.mark.slow
def test_a_run_is_fitted_without_words_and_goes_on(demo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
                                                   ) -> None:
    shutil.copytree(demo, tmp_path / "corpus")
    run = tmp_path / "run"
    assert run_command("train", "corpus=demo", f"corpus.out={tmp_path / 'corpus'}", "face=points", "model=phone_mean",
                       "sample=false", f"run={run}", "folds=0", "jobs=1") == 0
    assert run_command("unseen", run, "--splits", "2") == 0
    path = RunFiles(run).unheard
    found = json.loads(path.read_text())
    corpus = Corpus.open(tmp_path / "corpus")
    sentences = [u for split in ("train", "val") for u in corpus.split(split)]
    for leaving in found["leavings"]:
        say = [not set(u.alignment["words"].labels).isdisjoint(leaving["held"]["words"]) for u in sentences]
        assert leaving["sentences"][0] == sum(say)
        assert leaving["correlations"]["model"] == leaving["correlations"]["phone mean"]
    capsys.readouterr()
    assert run_command("unseen", run, "--splits", "2") == 0
    assert "split 1: without" not in capsys.readouterr().out and json.loads(path.read_text()) == found

"""Several corpora on the command line: what a list stands for, and the settings that each of them has."""

from pathlib import Path

import pytest
from conftest import ROOT, run_command
from hydra import compose, initialize_config_dir

from dnnvss.commands.several import SeveralCorpora, each_alone, several_corpora, with_lists
from dnnvss.commands.usage import UsageError
from dnnvss.errors import DnnvssError


@pytest.mark.parametrize("typed, found", [
    ("corpus=[ann, bob]", ["corpus=several", "corpus.talkers=['ann','bob']"]),
    ("corpus=[data/my corpus,demo]", ["corpus=several", "corpus.talkers=['data/my corpus','demo']"]),
    ("corpus=[a,b],[a,c]", ["corpus=several", "corpus.talkers=['a','b'],['a','c']"]),
    ("corpus=demo", ["corpus=demo"]), ("trainer.stream_weights=[1,1,1]", ["trainer.stream_weights=[1,1,1]"])])
def test_a_list_of_corpora_stands_for_settings(typed: str, found: list[str]) -> None:
    assert with_lists(["seed=1", typed]) == ["seed=1", *found]


@pytest.mark.parametrize("typed", ["corpus=[a,b],c", "corpus=[a,b", "corpus=[[a],b]"])
def test_a_list_that_is_none_is_refused(typed: str) -> None:
    with pytest.raises(UsageError, match=r"cannot be read.*corpus=\[a,b\],\[a,c\]"):
        with_lists([typed])


def test_each_talker_has_the_settings_of_a_training_of_its_own() -> None:
    given = ["++corpus.talkers=[demo,ann,/some where/bob]", "corpus=several", "++corpus.balance=0.3", "seed=3",
             "++aam.modes=7", "++corpus.split=unseen"]
    configs = each_alone(SeveralCorpora(talkers=("demo", "ann", "/some where/bob")), given)
    assert [str(c.corpus.out) for c in configs.values()] == ["data/demo", "data/ann", "/some where/bob"]
    assert list(configs) == ["demo", "ann", "bob"]
    assert {c.seed for c in configs.values()} == {3} and {c.aam.modes for c in configs.values()} == {7}
    assert configs["ann"].aam.points == "auto" and configs["demo"].aam.points.name == "demo"
    assert {c.corpus.split for c in configs.values()} == {"unseen"}


def test_one_aam_for_all_where_it_is_given() -> None:
    configs = each_alone(SeveralCorpora(talkers=("demo", "ann")), ["aam=grid"])
    assert {c.aam.points.name for c in configs.values()} == {"lips_jaw_nostrils"}


def test_a_setting_of_one_corpus_is_none_of_several() -> None:
    with initialize_config_dir(str(ROOT / "conf"), version_base="1.3"):
        plain = compose("train", [])
        wrong = compose("train", ["corpus=several", "corpus.talkers=[a,b]", "++corpus.out=x"])
        far = compose("train", ["corpus=several", "corpus.talkers=[a,b]", "corpus.balance=2"])
    assert several_corpora(plain) is None
    with pytest.raises(DnnvssError, match=r"corpus\.out is no setting"):
        several_corpora(wrong)
    with pytest.raises(DnnvssError, match=r"corpus\.balance=2 is too much"):
        several_corpora(far)
    with pytest.raises(DnnvssError, match="corpus=ann is named twice"):
        each_alone(SeveralCorpora(talkers=("ann", "data/ann")), [])


@pytest.mark.parametrize("command, words, message", [
    ("train", ["corpus=[ann]"], "ann/corpus.json: no such file"),
    ("train", ["corpus=[ann,bob]", "corpus.raw=x"], "corpus.raw is no setting"),
    ("train", ["corpus=[ann,bob]", "trainer.epochs=z"], "trainer.epochs=z is no whole number"),
    ("train", ["corpus=[ann,bob],c"], r"cannot be read"),
    ("prepare", ["corpus=several"], "corpus=several is no corpus")])
def test_mistakes_are_told_in_one_line(command: str, words: list[str], message: str, tmp_path: Path,
                                       monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert run_command(command, *words) in (1, 2)
    assert message in capsys.readouterr().err and not list(tmp_path.iterdir())

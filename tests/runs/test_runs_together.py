"""The folder of a training of several talkers: what names it, what it refuses, and how a talker is found in it."""

from dataclasses import replace
from pathlib import Path

import pytest
from conftest import ROOT
from hydra import compose, initialize_config_dir

from dnnvss import files
from dnnvss.commands.train_settings import run_settings
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.choice import largest
from dnnvss.runs.choice import finished_runs
from dnnvss.runs.files import RunFiles
from dnnvss.runs.naming import run_folder, run_name, what_counts
from dnnvss.runs.run import Run, provenance
from dnnvss.runs.settings import RunSettings
from dnnvss.runs.talkers import TalkersIndex, is_together, talker_run
from dnnvss.runs.together import begin_together, joined

PRINTS = {"ann": "aaaa", "bob": "bbbb", "cy": "cccc"}


def of(name: str, *given: str) -> RunSettings:
    with initialize_config_dir(str(ROOT / "conf"), version_base="1.3"):
        return run_settings(compose("train", ["corpus=folder", f"++corpus.name={name}", "model=feedforward", *given]))


@pytest.fixture(scope="module")
def three() -> dict[str, RunSettings]:
    return {name: of(name) for name in ("cy", "ann", "bob")}


def test_a_talkers_run_is_named_by_who_was_heard_with_it(three: dict[str, RunSettings]) -> None:
    two = {name: three[name] for name in ("ann", "bob")}
    names = [run_name(joined(some, PRINTS, balance)["ann"], "aaaa") for some, balance in (
        (two, 0.5), (dict(reversed(two.items())), 0.5), (three, 0.5), (two, 0.3))]
    other = joined({**two, "bob": of("bob", "aam.modes=9")}, PRINTS, 0.5)["ann"]
    assert names[0] == names[1] and len({*names, run_name(three["ann"], "aaaa"), run_name(other, "aaaa")}) == 5
    assert not {"heard_with", "balance"} & what_counts(three["ann"], "aaaa").keys()


def test_all_runs_lie_in_one_folder(three: dict[str, RunSettings]) -> None:
    made = joined(three, PRINTS, 0.5)
    folders = {run_folder(own, PRINTS[name]).parent for name, own in made.items()}
    assert len(folders) == 1 and folders.pop().name.startswith("ann+bob+cy-ph_class-feedforward-")
    assert list(made) == ["ann", "bob", "cy"] and list(made["bob"].heard_with) == ["ann", "cy"]
    assert provenance(made["bob"], "x").heard_with == ("ann", "cy")
    named = joined({name: replace(own, run="there") for name, own in three.items()}, PRINTS, 0.5)
    assert run_folder(named["ann"], "aaaa").parent == Path("there")
    many = {f"t{k}": three["ann"] for k in range(7)}
    assert Path(joined(many, dict.fromkeys(many, "x"), 0)["t0"].runs).name.startswith("t0+t1+t2+t3+3-")


@pytest.mark.parametrize("given, message", [
    (["model=kernel"], "model=kernel is no network that several talkers can share.*feedforward"),
    (["model=guided"], "model=guided is no network"), (["labels=ph_dv"], "labels=ph_dv hold dynamic visemes"),
    (["model.members=2", "trainer.together=true"], "trainer.together stacks networks"),
    (["knowledge=nowhere"], "no such file")])
def test_what_talkers_cannot_share_is_refused(given: list[str], message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        joined({name: of(name, *given) for name in ("ann", "bob")}, PRINTS, 0.5)


def test_one_talker_is_no_company() -> None:
    with pytest.raises(DnnvssError, match="1 corpus is no training of several talkers"):
        joined({"ann": of("ann")}, PRINTS, 0.5)


def test_where_the_system_is_to_be_chosen_it_is_the_network(three: dict[str, RunSettings]) -> None:
    chosen = largest(of("ann", "model=auto"))
    assert chosen.model_name == "feedforward" and chosen.model["fit"]["steps"] == 2000
    assert largest(three["ann"]) is three["ann"]


def test_a_folder_goes_on_as_it_was_begun(tmp_path: Path) -> None:
    folder = tmp_path / "both"
    runs = {name: folder / f"{name}-1" for name in ("ann", "bob")}
    begin_together(folder, runs, overwrite=False)
    kept = files.write_text(folder / "ann-1" / "x", "")
    begin_together(folder, runs, overwrite=False)
    assert kept.is_file()
    with pytest.raises(DnnvssError, match="holds a training of ann, bob with other settings"):
        begin_together(folder, {"ann": folder / "ann-2"}, overwrite=False)
    begin_together(folder, {"ann": folder / "ann-2"}, overwrite=True)
    assert not kept.exists() and TalkersIndex.load(folder).talkers == {"ann": "ann-2"}
    files.write_text(tmp_path / "other" / "thesis.txt", "")
    with pytest.raises(DnnvssError, match="holds something that is not a training of several talkers"):
        begin_together(tmp_path / "other", runs, overwrite=True)
    assert (tmp_path / "other" / "thesis.txt").is_file()


def test_a_talker_is_found_by_name(tmp_path: Path) -> None:
    folder = tmp_path / "runs" / "both"
    begin_together(folder, {name: folder / f"{name}-1" for name in ("ann", "bob")}, overwrite=False)
    of("ann").write(files.make_folder(folder / "ann-1"))
    files.write_json(RunFiles(folder / "ann-1").metrics, {"headline": 0.5})
    files.write_json(RunFiles(folder / "ann-1").provenance, {"corpus": "aaaa"})
    assert is_together(folder) and talker_run(folder, "ann") == folder / "ann-1"
    assert [candidate.folder for candidate in finished_runs(tmp_path / "runs")] == [folder / "ann-1"]
    for talker, message in (("eve", "holds no run of talker=eve.*one of ann, bob"),
                            (None, "holds runs of ann, bob.*Add talker=NAME"), ("bob", "a run that has not ended")):
        with pytest.raises(DnnvssError, match=message):
            talker_run(folder, talker)
    with pytest.raises(DnnvssError, match=r"holds runs of ann, bob.*Add talker=NAME"):
        Run.open(folder)
    files.write_json(folder / "talkers.json", {"talkers": {"ann": "../../elsewhere"}})
    with pytest.raises(DnnvssError, match="elsewhere"):
        talker_run(folder, "ann")

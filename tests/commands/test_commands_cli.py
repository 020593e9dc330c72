"""What is typed on the command line reaches the settings as it was typed, and mistakes are told in our words."""

import errno
import os
import runpy
import sys
from collections.abc import Iterator
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest
from conftest import ROOT, composed, run_command
from hypothesis import given, settings
from hypothesis import strategies as st

from dnnvss.commands import prepare, speak, train
from dnnvss.commands.arguments import SettingsCommand, parse_arguments
from dnnvss.commands.compose import compose as without_hydra
from dnnvss.commands.entry import COMMANDS
from dnnvss.commands.usage import guarded

WEIRD = "we,ird = it's $5 ${x} %d {a: b} [c] ünï \\ #é"


def heard(command: SettingsCommand, key: str, text: str) -> Iterator[str]:
    """What hydra, and what our own composer, make of a text given for a setting."""
    given = parse_arguments(command, [f"{key}={text}"])
    found = []
    found.append(composed(command.config, *given.for_hydra()))
    if command is not train.COMMAND:
        found.append(without_hydra(given))
    for config in found:
        for part in key.split("."):
            config = config[part]
        yield str(config)


@pytest.mark.parametrize("text", [
    "Hello, I am: here", "it's {W AY1 N D}", "the ${price} is $5", "a \\${b} and \\\\${c}", "${", "back\\", "a\\'b",
    '"quoted"', "[1, 2]", "x=y", "C:\\new\\'quote", "\\\\", WEIRD,
])
def test_texts_arrive_as_they_were_typed(text: str) -> None:
    assert set(heard(speak.COMMAND, "text", text)) == {text}


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.text(st.sampled_from("ab \\'\"${},;:=[]#%"), min_size=1, max_size=8))
def test_any_text_arrives_as_it_was_typed(text: str) -> None:
    if text.strip():
        assert set(heard(speak.COMMAND, "text", text)) == {text}


@pytest.mark.parametrize("command, key", [
    *((speak.COMMAND, key) for key in ("run", "runs", "wav", "alignment", "out", "into", "overrides", "import_keys",
                                       "export_keys", "export_curves", "export_alignment", "render", "style.name",
                                       "speech.voice")),
    *((train.COMMAND, key) for key in ("runs", "run", "corpus.out", "corpus.name", "corpus.split", "labels.name",
                                       "model.name", "trainer.accelerator")),
    *((prepare.COMMAND, key) for key in ("corpus.raw", "corpus.out", "corpus.name")),
])
def test_any_path_or_text_of_any_command_arrives_as_it_was_typed(command: SettingsCommand, key: str) -> None:
    assert set(heard(command, key, WEIRD)) == {WEIRD}


def test_a_text_may_stand_in_quotes_for_hydra_and_refer_to_other_settings() -> None:
    assert set(heard(prepare.COMMAND, "corpus.raw", "'a b'")) == {"a b"}
    assert set(heard(train.COMMAND, "runs", "out/${corpus.name}")) == {"out/demo"}


def test_other_settings_are_left_to_hydra() -> None:
    given = parse_arguments(speak.COMMAND, ["rate=25", "text=null", "style.rest=true", "+style.by_group.jaw=2"])
    assert given.for_hydra() == ["rate=25", "text=null", "++style.rest=true", "++style.by_group.jaw=2"]
    swept = parse_arguments(train.COMMAND, ["-m", "+experiment=table2", "labels=ph", "corpus.split=,unseen"])
    assert swept.for_hydra() == ["-m", "experiment=table2", "labels=ph", "++corpus.split='','unseen'"]


def test_what_is_swept_replaces_an_experiments_values_or_is_added_where_no_file_holds_it(tmp_path: Path) -> None:
    def handed_on(*typed: str) -> list[str]:
        return parse_arguments(train.COMMAND, ["-m", *typed]).for_hydra()[1:]

    assert handed_on("+experiment=table4", "model.network.hidden=[5],[6]")[1] == "model.network.hidden=[5],[6]"
    assert handed_on("+experiment=segments", "++labels.segment=3,5")[1] == "labels.segment=3,5"
    assert handed_on("labels.segment=3,5", "model=kernel", "model.width=0.5,0.7") == [
        "++labels.segment=3,5", "model=kernel", "++model.width=0.5,0.7"]
    assert handed_on("+experiment=table4", "~model.network.hidden")[1] == "~model.network.hidden"
    (tmp_path / "experiment").mkdir()
    (tmp_path / "experiment" / "own.yaml").write_text(
        "# @package _global_\nhydra: {sweeper: {params: {++model.width: '1,2'}}}\n")
    assert handed_on("--config-dir", str(tmp_path), "experiment=own", "model.width=3")[3] == "++model.width=3"


def test_runs_of_a_sweep_that_lack_a_setting_fail_by_themselves(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert run_command("train", "-m", "model=hsmm,kernel", "model.width=0.5") == 1
    told = capsys.readouterr().err
    assert "error: model.width is no setting of model=hsmm, which has model.growth" in told
    assert "error: data/demo/corpus.json: no such file" in told  # the other run lacks nothing but its corpus
    assert told.splitlines()[-1] == ("error: 2 run(s) of the sweep failed: model=hsmm model.width=0.5; "
                                     "model=kernel model.width=0.5")


@pytest.mark.parametrize("typed, said", [
    ("train corpus=ann", "corpus=ann is unknown. Did you mean corpus=folder corpus.name=ann? There are demo, facegood"),
    ("train corpus=gird", "corpus=gird is unknown. Did you mean corpus=grid?"),
    ("train trainer.epoch=3", "trainer.epoch is no setting of train. Did you mean trainer.epochs=3?"),
    ("train model=feedforwrd", "model=feedforwrd is unknown. Did you mean model=feedforward?"),
    ("train -m model=hsmm,gided", "model=gided is unknown. Did you mean model=guided?"),
    ("train aam.alignmnt=rigid", "aam.alignmnt is no setting of train. Did you mean aam.alignment=rigid?"),
    ("train grid", "grid is no setting. Did you mean corpus=grid?"),
    ("train hidden=5", "hidden is no setting of train. Did you mean model.network.hidden=5?"),
    ("train predictor.hidden=5", "predictor.hidden is no setting of train. Did you mean visemes.predictor.hidden=5?"),
    ("train --multrun", "--multrun is no option of train. Did you mean --multirun?"),
    ("train --cfg", "--cfg needs a value"),
    ("train --config-dir nowhere", "nowhere: no such folder"),
    ("train trainer.epochs=[1", "trainer.epochs=[1 cannot be read"),
    ("train trainer=null", "trainer=null is unknown. There are default, paper"),
    ("train seed=1,2", "seed=1,2 gives several values. Add -m"),
    ("train model=hsmm model.members=2", "model.members is no setting"),
    ("prepare corpus=demo corpus.importer.sentences=9", "corpus.importer is no setting of the built-in talker"),
    ("train model=hsmm model.network.hiden=[5]",
     "model.network is no setting of model=hsmm, which has model.growth, model.duration_growth, model.realignments. "
     "Leave it out, or take one of model=blend, convolutional, feedforward, gaussian, guided, recurrent."),
    ("train -m hydra.hiden=5",
     "hydra.hiden is no setting of every run that is asked for. Check its name, or leave out the systems"),
    ("train model.network.hidden=[5]", "model.network is no setting of model=auto, which has model.candidates,"),
    ("train model=feedforward model.network.hiden=[5]",
     "model.network.hiden is no setting. Did you mean model.network.hidden?"),
    ("train model=feedforward model.hiden=[5]", "model.hiden is no setting of train. Did you mean model.network."),
    ("train model.hidden=[3]", "model.hidden is no setting of train. Did you mean model.network.hidden='[3]'?"),
    ("train -m model.hidden=[3],[4]", "model.hidden is no setting of train. Did you mean model.network.hidden="),
    ("train model=feedforward model.epochs=3", "model.epochs is no setting of train. Did you mean trainer.epochs=3?"),
    ("train model=feedforward model.memebrs=2", "model.memebrs is no setting. Did you mean model.members?"),
    ("train +foo=3", "foo is no setting. Choose among seed, runs, run, overwrite, jobs, folds, knowledge, sample, "
     "face, corpus, aam, labels"),
    ("train model=hsmm model.growth.mld=2", "model.growth.mld is no setting. Did you mean model.growth.mdl?"),
    ("train hydra.job.chdir=true", "hydra.job.chdir=true would look for every path below the folder of the job"),
    ("prepare raw=x", "raw is no setting of prepare. Did you mean corpus.raw=x?"),
    ("prepare corpus=grid", "corpus.raw is not set. Add corpus.raw=... to the command"),
    ("prepare corpus=folder corpus.raw=x corpus.importer.kind=foldr", "corpus.importer.kind=foldr is unknown"),
    ("prepare my_videos", "my_videos is no setting. Did you mean corpus.raw=my_videos?"),
    ("speak --text hi", "--text is no option of speak. Did you mean text=hi?"),
    ("speak hello", "hello is no setting. Did you mean text=hello?"),
    ("speak text=Hello, I am out=x.mp4", "I is no setting. Did you mean text='Hello, I am'?"),
    ("prepare corpus=folder corpus.raw=my videos", "videos is no setting. Did you mean corpus.raw='my videos'?"),
    ("speak trainer=paper", "trainer=paper is not used by speak"),
    ("speak style=loud", "style=loud is unknown. There are articulated, plain"),
    ("speak --cfg x", "--cfg shows one of job, hydra, all. Write --cfg job"),
    ("speak style.articulation=1e9", "style.articulation=1000000000.0 is too much"),
    ("speak rate=[1", "rate=[1 cannot be read"),
    ("speak style.rest.deep=1", "style.rest.deep is no setting"),
    ("compare", "RUN is missing"),
    ("compare x --frist 3", "--frist is no option of dnnvss compare. Did you mean --first?"),
    ("compare x out=y", "out=y is no option of dnnvss compare. Did you mean --out y?"),
    ("compare x --first 0", "--first=0 is out of range: 1 or more"),
    ("figure x --coeficient 5", "--coeficient is no option of dnnvss figure. Did you mean --coefficient?"),
    ("features --rate fast", "--rate=fast"),
    ("export x --network tf", "--network: 'tf' is unknown"),
    ("label chose x", "COMMAND: 'chose' is unknown; there are 'choose'"),
    ("trian", "trian is no command. Did you mean train?"),
])
def test_a_mistake_on_the_command_line_is_told_with_what_was_meant(typed: str, said: str,
                                                                   capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(*typed.split()) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"error: {said}") and error.count("\n") == 1


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(name, "--help") == 0
    said = capsys.readouterr().out
    assert len(said.splitlines()) > 5 and "``" not in said
    assert run_command("--help") == 0
    assert f"  {name} " in capsys.readouterr().out


@pytest.mark.parametrize("name", ["page", "import", "check"])
def test_help_of_labelling_says_which_folder_is_meant(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("label", name, "--help") == 0
    said = " ".join(capsys.readouterr().out.split())
    assert said.startswith(f"usage: dnnvss label {name} ") and "LABELS the folder that `dnnvss label choose`" in said


def test_help_says_what_settings_mean(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("speak", "run=x", "--help") == 0
    said = capsys.readouterr().out
    assert "speed: 1.0 " in said and "2 is twice as fast" in said and "# style=... one of: articulated, plain" in said
    assert "hydra:" not in said


@pytest.mark.parametrize("number, said", [(errno.EACCES, "error: x.mp4: Permission denied. Choose another place"),
                                          (errno.ENOSPC, "error: x.mp4: No space left on device. Free some")])
def test_trouble_with_files_ends_in_a_line(number: int, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    @guarded
    def write() -> None:
        raise OSError(number, os.strerror(number), "x.mp4")

    with pytest.raises(SystemExit, match="1"):
        write()
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("error", [BrokenProcessPool("a worker died"), MemoryError()])
def test_want_of_memory_ends_in_a_line(error: Exception, capsys: pytest.CaptureFixture[str]) -> None:
    @guarded
    def work() -> None:
        raise error

    with pytest.raises(SystemExit, match="1"):
        work()
    said = capsys.readouterr().err
    assert said.startswith("error: there was too little memory") and said.count("\n") == 1


@pytest.mark.parametrize("words", [["prepare", "corpus=demo"], ["train"], ["speak", "text=hi"], ["compare", "x"]])
def test_ctrl_c_ends_every_command_alike(words: list[str], monkeypatch: pytest.MonkeyPatch,
                                         capsys: pytest.CaptureFixture[str]) -> None:
    def interrupted(*given: object, **named: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("data_prep.demo.prepare_demo", interrupted)
    monkeypatch.setattr("dnnvss.commands.train.train", interrupted)
    monkeypatch.setattr("dnnvss.commands.speak.synthesise", interrupted)
    monkeypatch.setattr("dnnvss.evaluation.finished.compare_runs", interrupted)
    assert run_command(*words) == 130
    assert capsys.readouterr().err.startswith("interrupted: ")


@pytest.mark.parametrize("module, command", [
    ("dnnvss.pipeline.label", "label"), ("dnnvss.pipeline.track", "track"), ("dnnvss.pipeline.figure", "figure"),
    ("dnnvss.pipeline.face_figures", "face-figures"), ("dnnvss.pipeline.picture_book", "units"),
    ("dnnvss.pipeline.visemes", "visemes"), ("dnnvss.labels", "features"), ("dnnvss.evaluation", "compare"),
    ("dnnvss.export", "export")])
def test_old_names_of_commands_say_what_replaced_them(module: str, command: str, monkeypatch: pytest.MonkeyPatch,
                                                      capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", [module, "a b", "--out", "x"])
    with pytest.raises(SystemExit, match="2"):
        runpy.run_module(module, run_name="__main__")
    assert f"is now: dnnvss {command} 'a b' --out x" in capsys.readouterr().err


@pytest.mark.parametrize("program", [["train.py"], ["synth.py"], ["data_prep"], ["dnnvss", "speak"]])
def test_all_doors_lead_to_the_same_entry(program: list[str], monkeypatch: pytest.MonkeyPatch,
                                          capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", [*program, "--verbose"])
    with pytest.raises(SystemExit, match="2"):
        if program[0].endswith(".py"):
            runpy.run_path(str(ROOT / program[0]), run_name="__main__")
        else:
            runpy.run_module(program[0], run_name="__main__")
    assert capsys.readouterr().err.startswith("error: --verbose is no option of ")

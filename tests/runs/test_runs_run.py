"""A run goes on under the settings that it was begun with, and says which split has nothing to learn from."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import composed

from dnnvss import __version__, files
from dnnvss.commands.train_settings import run_settings
from dnnvss.errors import DnnvssError
from dnnvss.runs.bundle import BundleIndex
from dnnvss.runs.files import RunFiles
from dnnvss.runs.naming import check_begun, run_name
from dnnvss.runs.run import Run
from dnnvss.runs.settings import RunSettings
from dnnvss.runs.voice import Voice
from dnnvss.systems.examples import _reached, split_examples
from dnnvss.systems.viseme_plan import UnitPlan


def configured(*settings: str) -> RunSettings:
    return run_settings(composed("train", "model=feedforward", *settings))


def begun(folder: Path, *settings: str) -> Path:
    """Return a run folder as a killed run leaves it."""
    configured(*settings).write(folder)
    files.write_json(RunFiles(folder).provenance, {"corpus": "abc"})
    return folder


def test_a_folder_of_runs_is_no_run_and_one_of_them_is_named(tmp_path: Path) -> None:
    with pytest.raises(DnnvssError, match=r"no such file\. Train a system first"):
        RunSettings.load(tmp_path)
    begun(tmp_path / "a")
    with pytest.raises(DnnvssError, match=r"no such file\. Name one of the runs in it, such as .*/a\."):
        RunSettings.load(tmp_path)
    with pytest.raises(DnnvssError, match=r"Name the folder of the run: .*/a\."):
        RunSettings.load(RunFiles(tmp_path / "a").config)


@pytest.mark.parametrize("name", ["runs/ann-ph-kernal-1a2b3c4d", "ann-ph-kernel-1a2b3c4d", "ann-ph-kernel"])
def test_a_run_that_is_not_there_is_told_its_likest(name: str, tmp_path: Path) -> None:
    begun(tmp_path / "runs" / "ann-ph-kernel-1a2b3c4d")
    begun(tmp_path / "runs" / "bob-voice-feedforward-1a2b3c4d")
    with pytest.raises(DnnvssError, match=r"no such file\. Did you mean .*/runs/ann-ph-kernel-1a2b3c4d\?"):
        RunSettings.load(tmp_path / name)


def test_a_run_goes_on_under_its_own_settings_alone(tmp_path: Path) -> None:
    folder = begun(tmp_path, "trainer.epochs=3")
    check_begun(folder, configured("trainer.epochs=3", "trainer.progress=false", "jobs=2"), "abc")
    check_begun(tmp_path / "not there", configured(), "abc")
    with pytest.raises(DnnvssError, match=r"trainer\.epochs \(3, now 5\).*overwrite=true"):
        check_begun(folder, configured("trainer.epochs=5"), "abc")
    with pytest.raises(DnnvssError, match=r"corpus\.fingerprint \(abc, now xyz\)"):
        check_begun(folder, configured("trainer.epochs=3"), "xyz")
    with pytest.raises(DnnvssError, match=r"and \d+ more"):
        check_begun(folder, configured("model=hsmm"), "abc")


def test_what_makes_no_other_run_name_makes_no_other_run(tmp_path: Path) -> None:
    for settings in (["trainer.figure_every=1"], ["visemes.units=7"], ["trainer.refine_rate=0.5"],
                     ["+labels.segment=5"], ["+labels.sound_norm=none"],
                     ["trajectory.rate=100.0"], ["trajectory.rate='100'"]):
        assert run_name(configured(*settings), "abc") == run_name(configured(), "abc"), settings
        check_begun(begun(tmp_path / settings[0]), configured(*settings), "abc")
    for settings in (["+labels.segment=7"], ["trajectory.rate=100.5"], ["labels.blocks=[centre_phone]"]):
        assert run_name(configured(*settings), "abc") != run_name(configured(), "abc"), settings


def test_systems_of_an_ensemble_name_a_run_by_what_they_learn_by() -> None:
    own = run_name(configured("model=network_trees"), "abc")
    assert run_name(configured("model=network_trees", "trainer.progress=false"), "abc") == own
    assert run_name(configured("model=network_trees", "trainer.epochs=3"), "abc") != own


def test_a_split_without_a_measured_frame_is_named(tmp_path: Path) -> None:
    splits = {"train": ["a"], "val": ["b", "c"], "test": ["d"]}
    corpus = SimpleNamespace(root=tmp_path, split=lambda name, _: [SimpleNamespace(id=i) for i in splits[name]])
    encoded = SimpleNamespace(dropped={"b": "dark"}, clip=lambda i: SimpleNamespace(valid=np.array([i != "c"])))
    task = SimpleNamespace(example=lambda *_: None)
    with pytest.raises(DnnvssError, match="'val' has no measured frame: 1 utterances, and 1 left out"):
        split_examples(task, corpus, encoded, "")  # type: ignore[arg-type]


def test_a_split_of_single_frames_whose_movement_was_not_measured_is_named(tmp_path: Path) -> None:
    ids = {"train": ["a"], "val": ["b", "c"], "test": ["d"]}
    corpus = SimpleNamespace(root=tmp_path, split=lambda name, _: [SimpleNamespace(id=i) for i in ids[name]],
                             sound=lambda _: None)
    valid = {i: np.arange(9) % 3 == 1 if i in "bc" else np.ones(9, bool) for i in "abcd"}
    encoded = SimpleNamespace(dropped={}, clip=lambda i: SimpleNamespace(valid=valid[i], parameters=np.zeros((9, 2))))
    whole = configured().task  # at 100 frames a second, as the video

    def example(u: SimpleNamespace, parameters: np.ndarray, known: np.ndarray, *_: object) -> SimpleNamespace:
        reached = _reached(known, whole.windows.reach)
        return SimpleNamespace(measured=(parameters, reached))

    task = SimpleNamespace(example=example, sound=lambda *_: None)
    with pytest.raises(DnnvssError, match="'val' has no frame that was measured together with those beside it"):
        split_examples(task, corpus, encoded, "")  # type: ignore[arg-type]
    valid["c"][:3] = True
    assert len(split_examples(task, corpus, encoded, "")["val"]) == 2  # type: ignore[arg-type]


def test_settings_that_the_viseme_network_would_not_heed_are_refused() -> None:
    with pytest.raises(DnnvssError, match=r"visemes\.predictor\.fit\.precision is no setting of this fit"):
        configured("labels=ph_dv", "+visemes.predictor.fit.precision=auto")
    assert UnitPlan.from_config(configured("labels=ph_dv").visemes).predictor.folds == 4


def test_a_run_of_another_version_is_refused_with_the_command_that_trains_it_anew(tmp_path: Path) -> None:
    folder = begun(tmp_path, "model=hsmm", "labels=ph_d")
    files.write_json(RunFiles(folder).provenance, {"corpus": "abc", "dnnvss": "0.1.0"})
    anew = rf"Train it anew: dnnvss train corpus=demo labels=ph_d model=hsmm run={folder} overwrite=true"
    with pytest.raises(DnnvssError, match=rf"was trained by dnnvss 0\.1\.0, and this is .*{anew}"):
        Run.open(folder)
    with pytest.raises(DnnvssError, match=anew):
        check_begun(folder, configured("model=hsmm", "labels=ph_d"), "abc")
    files.write_json(RunFiles(folder).provenance, {"corpus": "abc", "dnnvss": __version__})
    with pytest.raises(DnnvssError, match="has not ended"):
        Run.open(folder)


def test_settings_that_mean_nothing_are_named_with_the_file(tmp_path: Path) -> None:
    folder = begun(tmp_path)
    config = RunFiles(folder).config
    files.write_text(config, config.read_text().replace("windows:", "window:"))
    with pytest.raises(DnnvssError, match=rf"{config}: trajectory\.window is no setting\. Train it anew: dnnvss"):
        RunSettings.load(folder)
    files.write_text(config, "- no run\n")
    with pytest.raises(DnnvssError, match=rf"{config}: "):
        RunSettings.load(folder)


def test_what_a_voice_lacks_is_named(tmp_path: Path) -> None:
    voice = Voice(("AA", "M"), ("sil",), "en_us", "25", "nobody", frozenset({"AA-M+sil"}))
    path = voice.save(tmp_path / "voice.json")
    assert Voice.load(path) == voice
    files.write_json(path, {"phones": ["AA"]})
    with pytest.raises(DnnvssError, match=r"voice\.json: pauses is not set.*Train"):
        Voice.load(path)


def test_a_bundle_says_what_it_must(tmp_path: Path) -> None:
    index = BundleIndex("model.onnx", "a", "0.2.0", {"model.onnx": "0" * 64})
    index.save(tmp_path)
    assert BundleIndex.load(tmp_path) == index
    files.write_json(RunFiles(tmp_path).index, {"network": "model.onnx", "run": 3, "dnnvss": "0.2.0"})
    with pytest.raises(DnnvssError, match=r"bundle\.json: run=3 is no text.*dnnvss export"):
        BundleIndex.load(tmp_path)

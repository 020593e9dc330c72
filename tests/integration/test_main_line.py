"""The whole row on a small built-in talker: prepare, train, evaluate, speak; and what happens when it goes wrong."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT
from hydra import compose, initialize_config_dir
from omegaconf import DictConfig

from data_prep.demo import prepare_demo
from dnnvss import files
from dnnvss.corpus import read_audio, read_video, video_info
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.__main__ import main as evaluate_runs
from dnnvss.formats import read_alignment
from dnnvss.pipeline.folder import Run
from dnnvss.pipeline.synthesise import replace_unseen, synthesise
from dnnvss.pipeline.train import train
from dnnvss.timing import Alignment, Tier

FAST = ["trainer.epochs=2", "trainer.progress=false", "trainer.figure_every=0", "trainer.accelerator=cpu",
        "model.network.hidden=[32]", "aam.modes=8", "jobs=1", "sample=false"]


def configure(name: str, *overrides: str) -> DictConfig:
    with initialize_config_dir(str(ROOT / "conf"), version_base="1.3"):
        return compose(name, list(overrides))


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small prepared corpus and a finished run of each of two label sets."""
    home = tmp_path_factory.mktemp("home")
    prepare_demo(home / "demo", sentences=8, size=96, jobs=1)
    for labels in ("ph", "ph_a"):
        train(configure("train", f"corpus.out={home}/demo", f"runs={home}/runs", f"run={home}/runs/{labels}",
                        f"labels={labels}", *FAST))
    return home


def speak(home: Path, out: str, *overrides: str) -> Path:
    synthesise(configure("synth", f"run={home}/runs/ph", f"out={home}/{out}", "speech=formant", *overrides))
    return home / out


def test_run_folder_holds_what_synthesis_and_reader_need(home: Path) -> None:
    names = {p.name for p in (home / "runs" / "ph").iterdir()}
    assert {"config.yaml", "run.json", "model.pt", "aam.npz", "face.npz", "durations.npz", "voice.json", "metrics.json",
            "metrics.md", "figures", "predictions", "tensorboard", "checkpoints"} <= names
    table = json.loads((home / "runs" / "ph" / "metrics.json").read_text())
    assert set(table["systems"]) == {"model", "training mean", "phone mean"}


def test_finished_run_is_reported_and_not_trained_again(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (home / "runs" / "ph" / "model.pt").stat().st_mtime_ns
    again = train(configure("train", f"corpus.out={home}/demo", f"run={home}/runs/ph", *FAST))
    assert (home / "runs" / "ph" / "model.pt").stat().st_mtime_ns == before
    assert "is finished" in capsys.readouterr().out
    assert again == pytest.approx(files.read_json(home / "runs" / "ph" / "metrics.json")["headline"])


def test_killed_evaluation_resumes_to_the_same_numbers(home: Path) -> None:
    """A run whose fit was finished and whose evaluation was not goes on and ends alike."""
    folder = home / "runs" / "ph_a"
    before = files.read_json(folder / "metrics.json")["headline"]
    for name in ("metrics.json", "model.pt", "voice.json"):
        (folder / name).unlink()
    headline = train(configure("train", f"corpus.out={home}/demo", f"run={folder}", "labels=ph_a", *FAST))
    assert headline == pytest.approx(before, abs=1e-6)


def test_text_becomes_a_video_with_sound_and_everything_beside_it(home: Path) -> None:
    out = speak(home, "a.mp4", "text='Hello there, it is: {W AY1 N D}'", "rate=29.97")
    info = video_info(out)
    assert str(info.rate) == "30000/1001" and info.has_audio and info.size == (96, 96)
    arrays = files.read_arrays(out.with_suffix(".npz"))
    alignment = read_alignment(out.with_suffix(".TextGrid"))
    frames = round(alignment.end * 100)
    assert arrays["parameters"].shape == (frames, 8) and arrays["points"].shape[::2] == (frames, 2)
    assert len(arrays["columns"]) == 8 and arrays["rate"] == 100
    assert len(read_video(out)) == pytest.approx(alignment.end * 29.97, abs=1)
    assert len(read_audio(out)) / 16000 == pytest.approx(alignment.end, abs=0.1)
    assert out.with_suffix(".png").is_file()
    report = json.loads(out.with_suffix(".json").read_text())
    assert report["engine"] == "formant" and report["pronunciation"][0]["spoken"] == "hello"


def test_face_moves_with_the_words_and_rests_in_silence(home: Path) -> None:
    arrays = files.read_arrays(speak(home, "b.mp4", "text='my papa may buy a puppy'").with_suffix(".npz"))
    phones = read_alignment(home / "b.TextGrid")["phones"]
    speed = np.linalg.norm(np.diff(arrays["points"], axis=0), axis=(1, 2))
    first, last = round(phones[0].end * 100), round(phones[-1].start * 100)
    assert speed[first:last].mean() > speed[: first // 2].mean()


def test_voice_and_alignment_take_the_place_of_text(home: Path) -> None:
    speak(home, "c.mp4", "text='hello my friend'")
    speak(home, "d.mp4", f"alignment={home}/c.TextGrid")
    first, second = (files.read_arrays(home / f"{n}.npz")["parameters"] for n in "cd")
    assert np.abs(first - second).max() < 0.05 * first.std()  # TextGrid keeps times to its own precision
    speak(home, "e.mp4", "text='hello my friend'", f"wav={home}/c.wav")
    assert read_alignment(home / "e.TextGrid")["words"].labels == read_alignment(home / "c.TextGrid")["words"].labels


@pytest.mark.parametrize("wrong, message", [
    ("text=''", "text is empty"), ("text='—'", "no word to speak"), ("text=hello", "cannot be written"),
    ("alignment=nothing.TextGrid", "nothing.TextGrid: no such file")])
def test_bad_input_is_named_and_nothing_is_left(home: Path, tmp_path: Path, wrong: str, message: str) -> None:
    out = "/proc/no/x.mp4" if "hello" in wrong else f"{tmp_path}/x.mp4"
    with pytest.raises(DnnvssError, match=message):
        synthesise(configure("synth", f"run={home}/runs/ph", f"out={out}", "speech=formant", wrong))
    assert not list(tmp_path.iterdir())


def test_run_of_another_feature_table_is_refused(home: Path, tmp_path: Path) -> None:
    for name in ("model.pt", "config.yaml"):
        source = "ph" if name == "model.pt" else "ph_a"
        (tmp_path / name).write_bytes((home / "runs" / source / name).read_bytes())
    with pytest.raises(DnnvssError, match=r"model.pt.*phone_window"):
        Run.open(tmp_path)


def test_checkpoint_cut_short_is_refused(home: Path, tmp_path: Path) -> None:
    (tmp_path / "config.yaml").write_bytes((home / "runs" / "ph" / "config.yaml").read_bytes())
    (tmp_path / "model.pt").write_bytes((home / "runs" / "ph" / "model.pt").read_bytes()[:5000])
    with pytest.raises(DnnvssError, match=r"model.pt: cannot be read"):
        Run.open(tmp_path)


def test_runs_are_compared_in_one_table(home: Path) -> None:
    assert evaluate_runs([str(home / "runs" / "ph"), str(home / "runs" / "ph_a"), "--out", str(home / "compared")]) == 0
    table = (home / "compared" / "evaluation.md").read_text()
    for name in ("ph", "ph_a"):
        headline = files.read_json(home / "runs" / name / "metrics.json")["headline"]
        assert f"{headline:.3f}".lstrip("0") in table


def test_unseen_phone_gets_its_neighbour() -> None:
    tier = Tier("phones", [(0, 0.1, "sil"), (0.1, 0.2, "ZH"), (0.2, 0.3, "AA")])
    alignment, replaced = replace_unseen(Alignment([tier]), ["SH", "AA", "M"])
    assert alignment["phones"].labels == ("sil", "SH", "AA") and replaced == {"ZH": "SH"}


def test_commands_print_one_line_for_a_mistake(home: Path, tmp_path: Path) -> None:
    for program, arguments in (("train.py", ["corpus.out=nowhere"]), ("synth.py", ["runs=nowhere", "text=a, b: c"])):
        command = [sys.executable, ROOT / program, *arguments]
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
        assert done.returncode == 1 and done.stderr.startswith("error: nowhere") and done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())

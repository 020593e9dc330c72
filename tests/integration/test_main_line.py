"""The whole row on a small built-in talker: prepare, train, evaluate, speak; and what happens when it goes wrong."""

import json
import pickle
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import ROOT, composed, run_command
from omegaconf import DictConfig, OmegaConf

from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.commands.speak import synthesise
from dnnvss.commands.sweep import CompareRuns, _free, run_folder, what_differs
from dnnvss.commands.train import train
from dnnvss.corpus import Corpus, Utterance
from dnnvss.curves import mlpg
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.cells import number_of
from dnnvss.evaluation.videos import write_side_by_side
from dnnvss.face.mesh import packaged_head
from dnnvss.face.mesh.gltf_read import read_gltf
from dnnvss.formats import read_alignment, write_alignment
from dnnvss.formats.curves import read_curves
from dnnvss.media import read_audio, read_video, video_info
from dnnvss.phones import BILABIALS
from dnnvss.runs.bundle import BundleIndex
from dnnvss.runs.bundling import write_bundle
from dnnvss.runs.fitting import encode
from dnnvss.runs.run import Run
from dnnvss.style import read_keys, write_keys
from dnnvss.style.rules import phone_frames
from dnnvss.synthesis import outputs
from dnnvss.synthesis.request import SpeakRequest
from dnnvss.synthesis.speak import replace_unseen
from dnnvss.synthesis.speak import speak as speak_purely
from dnnvss.systems.examples import make_examples, speech_frames
from dnnvss.systems.network import NetworkModel
from dnnvss.systems.plain_network import PlainNetwork
from dnnvss.timing import Alignment, FrameClock, Tier
from dnnvss.training.checkpoints import load_checkpoint, save_checkpoint

QUICK = ["trainer.progress=false", "trainer.figure_every=0", "trainer.accelerator=cpu", "aam.modes=8", "jobs=1",
         "sample=false", "folds=0"]
FAST = ["model=feedforward", "model.network.hidden=[32]", "trainer.epochs=2", *QUICK]


def configure(name: str, *overrides: str) -> DictConfig:
    return composed(name, *overrides)


@pytest.fixture(scope="module")
def home(encoded: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small prepared corpus and a finished run of each of two label sets."""
    home = tmp_path_factory.mktemp("home")
    shutil.copytree(encoded, home / "demo")
    for labels in ("ph", "ph_a"):
        train(configure("train", f"corpus.out={home}/demo", f"runs={home}/runs", f"run={home}/runs/{labels}",
                        f"labels={labels}", *FAST))
    return home


def speak(home: Path, out: str, *overrides: str) -> Path:
    synthesise(configure("synth", f"run={home}/runs/ph", f"out={home}/{out}", "speech=formant", *overrides))
    return home / out


def test_run_folder_holds_what_synthesis_and_reader_need(home: Path) -> None:
    names = {p.name for p in (home / "runs" / "ph").iterdir()}
    assert {"config.yaml", "run.json", "model.npz", "face.npz", "neutral.npz", "durations.npz", "voice.json",
            "metrics.json", "metrics.md", "figures", "predictions", "tensorboard", "checkpoints", "talker.npz"} <= names
    table = json.loads((home / "runs" / "ph" / "metrics.json").read_text())
    assert set(table["systems"]) == {"model", "model, articulated", "training mean", "phone mean"}
    speech = table["systems"]["model"]["regions"]["speech"]
    assert table["headline"] == pytest.approx(speech["correlation"]["mean"], abs=1e-6)
    lively = table["liveliness"]
    assert lively["model, articulated"]["gv_ratio"] > lively["model"]["gv_ratio"]
    assert {"truth", "truth + 40 ms", "mean"} <= set(lively)
    assert "closure recall" in (home / "runs" / "ph" / "metrics.md").read_text()


def test_a_run_keeps_what_it_is_worth_on_the_validation_split(home: Path) -> None:
    """The number by which runs are chosen, recomputed by NumPy's correlation; no test sentence is among its own."""
    run, corpus = Run.open(home / "runs" / "ph"), Corpus.open(home / "demo")
    kept = files.read_json(home / "runs" / "ph" / "metrics.json")
    sentences = corpus.split("val")
    assert kept["validation"]["sentences"] == [u.id for u in sentences] and kept["validation"]["sentences"]
    assert not set(kept["validation"]["sentences"]) & set(kept["systems"]["model"]["sentences"])
    encoded = encode(run.settings, corpus)
    found = []
    for e in make_examples(run.settings.task, corpus, sentences, encoded):
        targets, valid = e.measured
        spoken = speech_frames(e.alignment, run.settings.task.clock) & valid
        said = run.model.predict(e)
        curves = np.asarray(mlpg(said.mean, said.variance, run.settings.task.windows))
        found.append([np.corrcoef(targets[spoken, 0, d], curves[spoken, d])[0, 1] for d in range(5)])
    assert kept["validation"]["headline"] == pytest.approx(np.mean(found), abs=1e-4)
    assert (f"({number_of(len(sentences), 'sentence')}): correlation {kept['validation']['headline']:.3f}"
            in (home / "runs" / "ph" / "metrics.md").read_text())


def test_finished_run_is_reported_and_not_trained_again(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (home / "runs" / "ph" / "model.npz").stat().st_mtime_ns
    again = train(configure("train", f"corpus.out={home}/demo", f"run={home}/runs/ph", "labels=ph", *FAST))
    assert (home / "runs" / "ph" / "model.npz").stat().st_mtime_ns == before
    assert "is finished" in capsys.readouterr().out
    assert again == pytest.approx(files.read_json(home / "runs" / "ph" / "metrics.json")["headline"])


@pytest.mark.slow
def test_auto_trains_what_it_chose_tests_it_on_all_sentences_and_finds_its_run(
        home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = (f"corpus.out={home}/demo", f"runs={home}/auto", *QUICK[:-1])
    headline = train(configure("train", *given))
    told = capsys.readouterr().out
    folder, = (home / "auto").iterdir()
    choice, run = files.read_json(folder / "choice.json"), Run.open(folder)
    assert run.settings.model_name == choice["system"] and f"model=auto takes {choice['system']}" in told
    assert set(choice["trials"]) == {"phone_mean", "codebook", "hsmm", "kernel", "ensemble"}
    corpus = Corpus.open(home / "demo")
    everyone = {u.id for part in ("train", "val", "test") for u in corpus.split(part)}
    table = files.read_json(folder / "metrics.json")
    assert set(table["systems"]["model"]["sentences"]) == everyone and len(table["verdict"]) == 5
    assert "Verdict\n1. Trained on 7 sentences" in told and (folder / "verdict.html").is_file()
    assert not (folder / "parts").exists()
    assert train(configure("train", *given)) == headline and "is finished" in capsys.readouterr().out
    assert train(configure("train", *given, f"model={choice['system']}")) == headline  # the run of that name
    bundle = Run.open(write_bundle(run, home / "auto_bundle"))
    request = SpeakRequest("pack my box", engine="none")
    ours, theirs = (speak_purely(each, request) for each in (bundle, run))
    assert np.array_equal(ours.trajectory, theirs.trajectory)


def test_a_model_that_has_learnt_durations_speaks_with_its_own(home: Path) -> None:
    train(configure("train", f"corpus.out={home}/demo", f"run={home}/runs/hsmm", "model=hsmm", *QUICK))

    def phones(out: str, *settings: str) -> Tier:
        synthesise(configure("synth", f"run={home}/runs/hsmm", f"out={home}/{out}.mp4", "speech=none", "lead_in=0",
                             "lead_out=0", "text=pack my box", *settings))
        return read_alignment(home / f"{out}.TextGrid")["phones"]

    corpus, own = phones("corpus"), phones("own", "durations=model")
    assert corpus.labels == own.labels and not np.allclose(corpus.edges, own.edges, atol=0.005)
    run = Run.open(home / "runs" / "hsmm")
    words = read_alignment(home / "own.TextGrid")["words"]
    example = run.example(Utterance("own", "pack my box", Alignment([own, words])))
    expected = run.model.phone_durations(example)
    assert expected is not None
    np.testing.assert_allclose(np.diff(own.edges) * 100, expected, atol=0.6)


def test_a_system_that_is_no_network_is_bundled_with_what_it_learnt(home: Path, tmp_path: Path) -> None:
    train(configure("train", f"corpus.out={home}/demo", f"run={home}/runs/means", "model=phone_mean", *QUICK))
    whole = Run.open(home / "runs" / "means")
    bundle = Run.open(write_bundle(whole, tmp_path / "bundle"))
    assert BundleIndex.load(bundle.folder).network == "model.npz" and not (bundle.folder / "model.onnx").exists()
    request = SpeakRequest("pack my box", engine="none")
    ours, theirs = (speak_purely(run, request) for run in (bundle, whole))
    assert np.array_equal(ours.trajectory, theirs.trajectory) and ours.plan == theirs.plan
    with pytest.raises(DnnvssError, match="is a bundle already"):
        write_bundle(bundle, tmp_path / "again")


def test_a_bundle_does_not_replace_what_is_none(home: Path, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(DnnvssError, match="not a bundle"):
        write_bundle(Run.open(home / "runs" / "ph"), tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["notes.txt"]


def test_speaking_reads_prints_and_writes_nothing(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    run = Run.open(home / "runs" / "ph")
    before = sorted(p.stat().st_mtime_ns for p in home.rglob("*"))
    spoken = speak_purely(run, SpeakRequest("my papa may buy a puppy", engine="formant", lead_in=0.1))
    pictures = list(spoken.frames())
    assert len(pictures) == len(spoken.shown) and len(spoken.curves()["aperture"]) == len(pictures)
    names = {key.name for key in spoken.keys(["aperture", "aam01"], [0.25, 0.75])}
    assert names == {"aperture", "aam01"} and spoken.plan.alignment["phones"][0].end == pytest.approx(0.1)
    assert capfd.readouterr() == ("", "") and sorted(p.stat().st_mtime_ns for p in home.rglob("*")) == before


def test_a_run_of_a_network_speaks_without_torch(home: Path, tmp_path: Path) -> None:
    slow = "{'torch', 'lightning', 'hydra', 'sklearn', 'pocketsphinx', 'scipy.interpolate', 'scipy.optimize'}"
    program = (f"import atexit, runpy, sys; atexit.register(lambda: print('LOADED', *{slow} & set(sys.modules))); "
               "sys.argv = sys.argv[1:]; runpy.run_path(sys.argv[0], run_name='__main__')")
    done = subprocess.run([sys.executable, "-c", program, ROOT / "synth.py", f"run={home}/runs/ph", "text=hello there",
                           "speech=none", f"out={tmp_path}/a.mp4"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "LOADED" and (tmp_path / "a.png").is_file()
    run = Run.open(home / "runs" / "ph")
    assert isinstance(run.model, PlainNetwork) and isinstance(run.trained, NetworkModel)
    example = run.example(Corpus.open(home / "demo").split("test")[0])
    ours, theirs = run.model.predict(example), run.trained.predict(example)
    np.testing.assert_allclose(ours.mean, theirs.mean, atol=1e-5 * np.abs(theirs.mean).max())


def test_a_run_of_before_is_opened(home: Path, tmp_path: Path) -> None:
    """Its system lies in a file of torch's."""
    run = home / "runs" / "ph"
    for name in ("config.yaml", "run.json"):
        shutil.copyfile(run / name, tmp_path / name)
    save_checkpoint(tmp_path / "model.pt", load_checkpoint(run / "model.npz"))
    example = Run.open(run).example(Corpus.open(home / "demo").split("test")[0])
    ours, theirs = (Run.open(folder).model.predict(example) for folder in (tmp_path, run))
    np.testing.assert_allclose(ours.mean, theirs.mean, atol=1e-5 * np.abs(theirs.mean).max())


def test_killed_evaluation_resumes_to_the_same_numbers(home: Path) -> None:
    """A run whose fit was finished and whose evaluation was not goes on and ends alike."""
    folder = home / "runs" / "ph_a"
    before = files.read_json(folder / "metrics.json")["headline"]
    for name in ("metrics.json", "model.npz", "voice.json"):
        (folder / name).unlink()
    headline = train(configure("train", f"corpus.out={home}/demo", f"run={folder}", "labels=ph_a", *FAST))
    assert headline == pytest.approx(before, abs=1e-6)


def test_text_becomes_a_video_with_sound_and_everything_beside_it(home: Path) -> None:
    out = speak(home, "a.mp4", "text='Hello there, it is: {W AY1 N D}'", "rate=29.97")
    info = video_info(out)
    assert str(info.rate) == "30000/1001" and info.has_audio and info.size == (96, 96)
    arrays = read_arrays(out.with_suffix(".npz"))
    alignment = read_alignment(out.with_suffix(".TextGrid"))
    frames = round(alignment.end * 100)
    assert arrays["parameters"].shape == (frames, 8) and arrays["points"].shape[::2] == (frames, 2)
    assert len(arrays["columns"]) == 8 and arrays["rate"] == 100
    assert len(read_video(out)) == pytest.approx(alignment.end * 29.97, abs=1)
    assert len(read_audio(out)) / 16000 == pytest.approx(alignment.end, abs=0.1)
    assert out.with_suffix(".png").is_file()
    report = json.loads(out.with_suffix(".json").read_text())
    assert report["engine"] == "formant" and report["pronunciation"][0]["spoken"] == "hello"
    risks = report["risks"]
    assert (risks["frames"], risks["rate"]) == (frames, "100")
    assert any(r["kind"] in ("unseen triphone", "unseen neighbours") for span in risks["spans"] for r in span["risks"])


def test_length_silences_lead_and_labels_are_as_asked(home: Path) -> None:
    labels = home / "t.full.lab"
    lengths = ("total=3", "lead_in=400", "lead_out=200")
    usual = trajectory(speak(home, "t.mp4", "text='Hello there, my friend.'", *lengths, f"export_alignment={labels}"))
    times = read_alignment(home / "t.TextGrid")["phones"]
    assert (times.end, times[0].end, times.end - times[-1].start) == pytest.approx((3.0, 0.4, 0.2), abs=1e-3)
    assert read_alignment(labels)["phones"].labels == times.labels
    early = trajectory(speak(home, "t2.mp4", "text='Hello there, my friend.'", *lengths, "anticipation=50"))
    assert np.array_equal(early[:-5], usual[5:])


def test_text_is_spoken_in_the_footage_of_an_utterance(home: Path) -> None:
    utterance = next(iter(Corpus.open(home / "demo").utterances.values()))
    out = speak(home, "f.mp4", "text='hello my friend'", f"into={utterance.id}", "render=reference+face+patch+mesh")
    recorded, *views = np.split(read_video(out)[:, 28:].astype(float), 4, axis=2)  # 28: the line of text above
    again = read_video(Corpus.open(home / "demo").path(utterance, "video")).astype(float)
    count = min(len(recorded), len(again))
    assert np.abs(recorded[:count] - again[:count]).mean() < 4  # what the encoder costs
    face, patch, mesh = views
    assert np.abs(face - recorded)[:, :20].mean() < 3 < np.abs(face - recorded)[:, 50:80, 30:66].mean()
    assert (patch[:, :20] > 240).all() and (mesh[:, :20] > 240).all()
    assert json.loads(out.with_suffix(".json").read_text())["into"] == utterance.id


@pytest.mark.parametrize("wrong, message", [
    ("into=nothing", "no utterance and no video file is named 'nothing'"), ("render=soul", "no view 'soul'"),
    ("render=reference", "needs footage")])
def test_footage_that_is_not_there_is_refused(home: Path, tmp_path: Path, wrong: str, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        synthesise(configure("synth", f"run={home}/runs/ph", f"out={tmp_path}/x.mp4", "speech=none", "text=hello",
                             wrong))
    assert not list(tmp_path.iterdir())


def test_face_moves_with_the_words_and_rests_in_silence(home: Path) -> None:
    arrays = read_arrays(speak(home, "b.mp4", "text='my papa may buy a puppy'").with_suffix(".npz"))
    phones = read_alignment(home / "b.TextGrid")["phones"]
    speed = np.linalg.norm(np.diff(arrays["points"], axis=0), axis=(1, 2))
    first, last = round(phones[0].end * 100), round(phones[-1].start * 100)
    assert speed[first:last].mean() > speed[: first // 2].mean()


def test_voice_and_alignment_take_the_place_of_text(home: Path) -> None:
    speak(home, "c.mp4", "text='hello my friend'")
    speak(home, "d.mp4", f"alignment={home}/c.TextGrid")
    first, second = (read_arrays(home / f"{n}.npz")["parameters"] for n in "cd")
    assert np.abs(first - second).max() < 0.05 * first.std()  # TextGrid keeps times to its own precision
    speak(home, "e.mp4", "text='hello my friend'", f"wav={home}/c.wav")
    assert read_alignment(home / "e.TextGrid")["words"].labels == read_alignment(home / "c.TextGrid")["words"].labels


def trajectory(out: Path) -> np.ndarray:
    return read_arrays(out.with_suffix(".npz"))["parameters"]


def test_plain_style_is_mlpg_bit_for_bit_and_articulated_lips_close(home: Path) -> None:
    plain = trajectory(speak(home, "f.mp4", "text='my papa may buy a puppy'", "style=plain"))
    run = Run.open(home / "runs" / "ph")
    tiers = read_alignment(home / "f.TextGrid")
    prediction = run.model.predict(run.example(Utterance("f", "my papa may buy a puppy", tiers)))
    assert np.array_equal(plain, mlpg(prediction.mean, prediction.variance, run.task.windows))
    lively = trajectory(speak(home, "g.mp4", "text='my papa may buy a puppy'"))
    talker = run.generator.talker
    for _, frames in phone_frames(tiers["phones"], run.task.clock, BILABIALS, len(lively), (0.25, 0.75)):
        assert talker.gauges["aperture"](lively[frames]).max() < talker.levels["aperture"] + 1e-3


def test_side_by_side_video_has_the_recording_and_both_styles(home: Path) -> None:
    run, corpus = Run.open(home / "runs" / "ph"), Corpus.open(home / "demo")
    name = corpus.split("test")[0].id
    path, = write_side_by_side(run, corpus, [name])
    info, recorded = video_info(path), read_video(corpus.path(corpus.utterances[name], "video"))
    assert info.size == (4 * 96, 96 + 28) and info.has_audio  # recorded, through the face, and the two styles
    shown = read_video(path)
    assert abs(len(shown) - len(recorded)) <= 1
    first = shown[len(shown) // 2][28:, :96].astype(int)
    assert np.abs(first - recorded[len(shown) // 2]).mean() < 6  # grey levels that compression costs


@pytest.mark.parametrize("kind", ["csv", "json"])
def test_keys_are_exported_edited_and_survive_another_timing(home: Path, kind: str) -> None:
    file, text = home / f"keys.{kind}", "text='my papa'"
    whole = trajectory(speak(home, "h.mp4", text, f"export_keys={file}"))
    keys = read_keys(file)
    phones = read_alignment(home / "h.TextGrid")["phones"]
    assert {k.name for k in keys} == {"aperture", "lower_lip", "width"} and len(keys) == 3 * len(phones)
    again = trajectory(speak(home, "i.mp4", text, f"import_keys={file}"))
    assert np.abs(again - whole).max() < 1e-3 * whole.std()  # unedited keys change nothing
    wanted = next(k for k in keys if k.name == "aperture" and k.phone == "P")
    write_keys(file, [replace(wanted, low=9.0, high=9.0)])  # an artist's will against the rule that lips close on p
    for out, speed in (("j.mp4", "speed=1.0"), ("k.mp4", "speed=1.5")):
        x = trajectory(speak(home, out, text, f"import_keys={file}", speed))
        segment = read_alignment((home / out).with_suffix(".TextGrid"))["phones"][wanted.index]
        at = int(0.5 * (segment.start + segment.end) * 100 + 1e-6)
        aperture = Run.open(home / "runs" / "ph").face.gauges["aperture"](x)
        assert np.abs(aperture[at - 1 : at + 2] - 9.0).min() < 1e-3  # TextGrid times are rounded


def test_curves_have_a_line_for_each_picture(home: Path) -> None:
    out = speak(home, "curves.mp4", "text='my papa'", "rate=29.97", f"export_curves={home}/curves.csv")
    head, *lines = (home / "curves.csv").read_text().splitlines()
    names, rows = head.split(","), np.array([[float(v) for v in line.split(",")] for line in lines])
    assert names[:5] == ["frame", "seconds", "aperture", "lower_lip", "width"] and names[5] == "aam01"
    assert len(rows) == len(read_video(out)) and rows[30, 1] == pytest.approx(30 * 1001 / 30000, abs=1e-6)
    run = Run.open(home / "runs" / "ph")
    np.testing.assert_allclose(run.face.gauges["aperture"](rows[:, 5:]), rows[:, 2], atol=1e-2)
    phones = read_alignment(home / "curves.TextGrid")["phones"]
    closed = [i for s, at in phone_frames(phones, FrameClock("29.97"), BILABIALS, len(rows)) for i in at]
    assert rows[closed, 2].min() < rows[:, 2].mean()


def test_speech_moves_the_head_of_an_animators_program(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = speak(home, "rig.mp4", "text='my papa'", "render=face+head", f"export_rig={home}/rig.glb",
                f"export_visemes={home}/rig.tsv")
    assert "of the mouth's width RMS is not reached" in capsys.readouterr().out
    assert (home / "rig.fit.png").is_file() and read_video(out).shape[2] > read_video(out).shape[1]
    speak(home, "rig.mp4", "text='my papa'", f"export_rig={home}/rig.csv", "rig_rate=60", "rig_timecode=10:00:00:00")
    taken, head = read_curves(home / "rig.csv"), packaged_head()
    assert taken.times is not None and taken.times[0] == 36000 and len(taken.times) > 60
    ring = head.curves["lips_inner"]
    vertices = head.vertices(head.weights(dict(zip(taken.names, taken.values.T, strict=True))))
    gap = 1000 * (vertices[:, ring[9], 1] - vertices[:, ring[-9], 1])
    phones = read_alignment(home / "rig.TextGrid")["phones"]
    closed = [i for s, at in phone_frames(phones, FrameClock(60), BILABIALS, len(gap)) for i in at]
    opened = [i for s, at in phone_frames(phones, FrameClock(60), ("AA", "AY"), len(gap)) for i in at]
    assert gap[closed].min() < 1.5 < 4 < gap[opened].max()
    assert read_gltf(home / "rig.glb").names[:52] == head.names
    assert (home / "rig.tsv").read_text().startswith("0.00\tX")


@pytest.mark.parametrize("kind, rate", [("plain", "50"), ("arkit", "59.94")])
def test_curves_that_were_edited_come_back_as_keys(home: Path, kind: str, rate: str) -> None:
    asked = ("text='my papa'", f"rig_curves={kind}", f"rig_rate={rate}")
    speak(home, "back.mp4", *asked, f"export_rig={home}/back.csv")
    lines = [line.split(",") for line in (home / "back.csv").read_text().splitlines()]
    column = lines[0].index("open" if kind == "plain" else "JawOpen")
    before = np.array([float(line[column]) for line in lines[1:]])
    for line in lines[21:25]:
        line[column] = str(float(line[column]) + 0.2)
    (home / "edited.csv").write_text("\n".join(map(",".join, lines)) + "\n")
    speak(home, "back.mp4", *asked, f"import_curves={home}/edited.csv", f"export_edits={home}/edits.csv",
          f"export_rig={home}/again.csv")
    again = (home / "again.csv").read_text().splitlines()[1:]
    moved = np.array([float(line.split(",")[column]) for line in again]) - before
    assert moved[20:24].mean() > 0.1 and np.abs(moved[45:]).max() < 0.05
    edits = read_keys(home / "edits.csv")
    assert all(key.phone and 14 < key.time * float(rate) < 30 for key in edits)
    speak(home, "slow.mp4", "text='my papa'", "speed=0.8", f"import_keys={home}/edits.csv")


@pytest.mark.parametrize("wrong, message", [
    ("export_rig=x.fbx", r"cannot be written as \.fbx"), ("export_edits=k.csv", "needs curves that were edited"),
    ("export_visemes=x.csv", r"visemes of rhubarb are not written as \.csv"), ("rig_timecode=1:2", "no time code"),
    ("speed=fast", "speed=fast is no number"), ("key_names=aperture", "key_names=aperture is no list"),
    ("key_positions=[2]", r"key_positions\[0\]=2 is too much"),
    ("key_positions=null", "key_positions=null is no list"), ("total=abc", "total=abc is no number"),
    ("wav=nothing.wav", "nothing.wav: no such file.*given as wav="),
    ("out=", r"out= does not end in \.mp4"), ("rate=1e9", "rate=1000000000"),
    ("out=x.npz", r"out=x\.npz does not end in \.mp4.*export_curves"),
    ("export_curves=x.txt", r"export_curves=x\.txt does not end in \.csv"),
    ("+style.groups.jaw=[aam99]", "named 'aam99'"), ("+style.by_group.jaw=2", "no group is named 'jaw'"),
    ("style.articulation=-1", "style.articulation=-1"), ("import_keys=nowhere.csv", "nowhere.csv: no such file"),
    ("export_keys=keys.txt", "cannot be kept as .txt"), ("key_names=[smile]", "nothing is named 'smile'")])
def test_wrong_styles_and_keys_are_named_before_anything_is_rendered(
        home: Path, tmp_path: Path, wrong: str, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        synthesise(configure("synth", f"run={home}/runs/ph", f"out={tmp_path}/x.mp4", "speech=none", "text=hello",
                             f"export_keys={tmp_path}/y.csv", wrong))
    assert not list(tmp_path.iterdir())


def test_nothing_that_is_read_or_written_is_overwritten(home: Path, tmp_path: Path) -> None:
    recording = tmp_path / "mine.wav"
    recording.write_bytes(b"a recording")
    (tmp_path / "link.csv").symlink_to(tmp_path / "mine.json")
    (tmp_path / "mine.json").touch()
    for settings in ([f"import_keys={tmp_path}/link.csv"], [f"export_keys={tmp_path}/mine.json"],
                     [f"alignment={tmp_path}/mine.wav"]):
        with pytest.raises(DnnvssError, match=r"would overwrite what is read|two outputs have this name"):
            synthesise(configure("synth", f"run={home}/runs/ph", f"out={tmp_path}/mine.mp4", "text=hello", *settings))
    assert recording.read_bytes() == b"a recording" and len(list(tmp_path.iterdir())) == 3


def test_a_recording_is_left_alone_beside_its_video(home: Path, tmp_path: Path) -> None:
    speak(home, "said.mp4", "text='hello my friend'")
    recording = tmp_path / "hello.wav"
    recording.write_bytes((home / "said.wav").read_bytes()[:-2] + b"\x07\x00")
    before = recording.read_bytes()
    (tmp_path / "link.wav").symlink_to(recording)
    for wav in (recording, tmp_path / "link.wav"):
        speak(home, "h.mp4", f"out={tmp_path}/hello.mp4", "text='hello my friend'", f"wav={wav}")
        assert recording.read_bytes() == before and video_info(tmp_path / "hello.mp4").has_audio
        assert not list(tmp_path.glob(".*"))


def test_an_utterance_whose_name_is_that_of_an_output_is_no_file(home: Path, monkeypatch: pytest.MonkeyPatch,
                                                                 tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    name = next(iter(Corpus.open(home / "demo").utterances))
    speak(home, "n.mp4", f"out={tmp_path}/{name}.mp4", "text='hello'", f"into={name}")
    assert json.loads((tmp_path / f"{name}.json").read_text())["into"] == name
    with pytest.raises(DnnvssError, match=r"would overwrite what is read"):
        speak(home, "n.mp4", f"out={tmp_path}/{name}.mp4", "text='hello'", f"into={tmp_path}/{name}.mp4")


def test_times_that_start_late_are_moved_to_the_start_of_the_face(home: Path, tmp_path: Path) -> None:
    speak(home, "early.mp4", "text='pack my box'", "speech=none", "style=plain")
    given = read_alignment(home / "early.TextGrid")
    late = Alignment(tier.moved(0.75) for tier in given.tiers)  # 75 frames of the trajectory
    write_alignment(tmp_path / "late.lab", late)
    out = speak(home, "late.mp4", f"alignment={tmp_path}/late.lab", "speech=none", "style=plain")
    written = read_alignment(home / "late.TextGrid")
    assert written.start == 0 and written["phones"].edges == pytest.approx(given["phones"].edges, abs=1e-3)
    early, shifted = ([(s["first"], s["last"]) for s in files.read_json(home / f"{name}.json")["risks"]["spans"]]
                      for name in ("early", "late"))
    assert shifted == early and early
    assert shifted[-1][1] < len(trajectory(out)) == len(trajectory(home / "early.mp4"))


@pytest.mark.parametrize("broken", ["draw", "report", "write_wav", "write_alignment"])
def test_nothing_beside_the_video_costs_it(home: Path, monkeypatch: pytest.MonkeyPatch, broken: str,
                                           tmp_path: Path) -> None:
    def fail(*args: object, **more: object) -> None:
        raise ValueError("no room on the canvas")

    monkeypatch.setattr(outputs, broken, fail)
    with pytest.raises(DnnvssError, match=r"ValueError: no room on the canvas.*the video .*x\.mp4 is whole"):
        speak(home, "x.mp4", f"out={tmp_path}/x.mp4", "text='hello'")
    kept = {"draw": ".png", "report": ".json", "write_wav": ".wav", "write_alignment": ".TextGrid"}
    assert {p.suffix for p in tmp_path.iterdir()} == {".mp4", ".npz", *kept.values()} - {kept[broken]}


def test_overwrite_deletes_runs_alone(home: Path, tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(DnnvssError, match="holds something that is not a run"):
        train(configure("train", f"corpus.out={home}/demo", f"run={tmp_path}", "overwrite=true", *FAST))
    with pytest.raises(DnnvssError, match="epochs"):
        train(configure("train", f"corpus.out={home}/demo", f"run={home}/runs/ph", "overwrite=true", *FAST,
                        "trainer.epochs=0"))
    assert (tmp_path / "thesis.txt").exists() and (home / "runs" / "ph" / "model.npz").exists()


def test_a_run_that_was_killed_is_not_spoken_with(home: Path, tmp_path: Path) -> None:
    (tmp_path / "config.yaml").write_text((home / "runs" / "ph" / "config.yaml").read_text())
    with pytest.raises(DnnvssError, match=r"has not ended.*dnnvss train"):
        Run.open(tmp_path)


def test_the_dial_of_one_coefficient_leaves_the_others(home: Path) -> None:
    text = "text='hello my friend'"
    plain, one = (trajectory(speak(home, "l.mp4", text, "style=plain", *more))
                  for more in ([], ["+style.by_group.aam01=2"]))
    assert one[:, 0].var() > 1.5 * plain[:, 0].var()
    assert np.corrcoef(one[:, 0], plain[:, 0])[0, 1] > 0.9


@pytest.mark.parametrize("wrong, message", [
    ("text=''", "text is empty"), ("text='—'", "no word to speak"), ("text=hello", "cannot be written"),
    ("alignment=nothing.TextGrid", "nothing.TextGrid: no such file")])
def test_bad_input_is_named_and_nothing_is_left(home: Path, tmp_path: Path, wrong: str, message: str) -> None:
    out = "/proc/no/x.mp4" if "hello" in wrong else f"{tmp_path}/x.mp4"
    with pytest.raises(DnnvssError, match=message):
        synthesise(configure("synth", f"run={home}/runs/ph", f"out={out}", "speech=formant", wrong))
    assert not list(tmp_path.iterdir())


def test_durations_of_a_model_that_learnt_none_are_refused(home: Path, tmp_path: Path) -> None:
    for source, message in (("model", "feedforward has learnt no durations"), ("mine", "durations=mine is unknown")):
        with pytest.raises(DnnvssError, match=message):
            speak(home, str(tmp_path / "x.mp4"), "text=hello", f"durations={source}")
    assert not list(tmp_path.iterdir())


def test_run_of_another_feature_table_is_refused(home: Path, tmp_path: Path) -> None:
    for name in ("model.npz", "config.yaml"):
        source = "ph" if name == "model.npz" else "ph_a"
        (tmp_path / name).write_bytes((home / "runs" / source / name).read_bytes())
    with pytest.raises(DnnvssError, match=r"model.npz.*phone_window"):
        Run.open(tmp_path)


def test_checkpoint_cut_short_is_refused(home: Path, tmp_path: Path) -> None:
    (tmp_path / "config.yaml").write_bytes((home / "runs" / "ph" / "config.yaml").read_bytes())
    (tmp_path / "model.npz").write_bytes((home / "runs" / "ph" / "model.npz").read_bytes()[:5000])
    with pytest.raises(DnnvssError, match=r"model.npz: cannot be read"):
        Run.open(tmp_path)


def test_runs_are_compared_in_one_table(home: Path) -> None:
    assert run_command("compare", home / "runs" / "ph", home / "runs" / "ph_a", "--out", home / "compared") == 0
    table = (home / "compared" / "evaluation.md").read_text()
    compared = files.read_json(home / "compared" / "evaluation.json")["values"]
    for name, own in files.read_json(home / "runs" / "ph" / "metrics.json")["liveliness"].items():
        if name == "phone mean":
            continue
        row = compared[name.replace("model", "ph")]
        told = {metric: row[metric]["value"] for metric, value in own.items() if value is not None}
        assert told == pytest.approx({m: own[m] for m in told}, rel=1e-4, abs=1e-4)
    for name in ("ph", "ph_a"):
        headline = files.read_json(home / "runs" / name / "metrics.json")["headline"]
        assert f"{headline:.3f}".lstrip("0") in table


def test_unseen_phone_gets_its_neighbour() -> None:
    tier = Tier("phones", [(0, 0.1, "sil"), (0.1, 0.2, "ZH"), (0.2, 0.3, "AA")])
    alignment, replaced = replace_unseen(Alignment([tier]), ["SH", "AA", "M"])
    assert alignment["phones"].labels == ("sil", "SH", "AA") and replaced == {"ZH": "SH"}
    paused = Alignment([Tier("phones", [(0, 0.1, "sil"), (0.1, 0.2, "AA"), (0.2, 0.3, "sp"), (0.3, 0.4, "M")])])
    assert replace_unseen(paused, ["AA", "M"], ["sil"])[0]["phones"].labels == ("sil", "AA", "sil", "M")
    assert replace_unseen(paused, ["AA", "M"])[0] == paused


def test_commands_print_one_line_for_a_mistake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                               capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    for words in (["train", "corpus.out=nowhere"], ["speak", "runs=nowhere", "text=a, b: c"]):
        assert run_command(*words) == 1
        told = capsys.readouterr().err
        assert told.startswith("error: nowhere") and told.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_an_experiment_may_be_written_with_a_plus(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("train", "+experiment=paper", "--cfg", "job") == 0
    assert "3000" in capsys.readouterr().out


def test_a_sweep_ends_with_one_table_and_one_video(home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    sweep = CompareRuns("both")
    sweep.on_multirun_start(OmegaConf.create({}))
    elsewhere = pickle.loads(pickle.dumps(sweep))  # launchers run jobs in other processes
    for name in ("ph", "ph_a"):
        job = configure("train", f"run={home}/runs/{name}", f"runs={home}/runs", f"labels={name}",
                        f"corpus.out={home}/demo", "model=feedforward")
        given = ["corpus=demo", f"labels={name}"]
        ended = SimpleNamespace(status=SimpleNamespace(name="COMPLETED"), return_value=0.5, overrides=given)
        elsewhere.on_job_end(job, ended)
    sweep.on_job_end(job, SimpleNamespace(status=SimpleNamespace(name="FAILED"), overrides=[]))
    sweep.on_multirun_end(job)
    assert not list(tmp_path.iterdir())
    places = [_free(home / "runs" / "both-demo", names).name for names in (["ph", "x"], ["ph", "ph_a"], ["ph", "x"])]
    assert places == ["both-demo-2", "both-demo", "both-demo-2"]  # another sweep leaves this one's table
    out = home / "runs" / "both-demo"
    assert "| labels=ph_a |" in (out / "evaluation.md").read_text()
    width, height = video_info(out / "side_by_side.mp4").size
    corpus = Corpus.open(home / "demo")
    points, _ = corpus.landmarks(corpus.split("test")[0])
    face = np.ptp(points.reshape(-1, 2), axis=0)
    assert 2 * face[0] < width <= 2 * corpus.info.size[0] and height > 2 * face[1]  # three faces in two rows


def test_jobs_are_named_by_what_not_all_were_given() -> None:
    assert what_differs([("corpus=grid", "model=hsmm"), ("corpus=grid", "model=guided", "seed=1")]) == [
        "model=hsmm", "model=guided seed=1"]
    assert what_differs([("corpus=grid",), ("corpus=grid",)]) == ["1", "2"]


def test_a_run_is_found_by_what_its_job_was_given(home: Path) -> None:
    job = configure("train", f"runs={home}/runs", f"corpus.out={home}/demo", "model=feedforward")
    with_hydra = OmegaConf.create({**job, "hydra": {"sweep": {"dir": "elsewhere"}}})
    other = configure("train", f"runs={home}/runs", f"corpus.out={home}/demo", "model=feedforward", "seed=1")
    assert run_folder(with_hydra) == run_folder(job) != run_folder(other)

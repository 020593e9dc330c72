"""A voice without its words drives a face, by a run that reads the sound alone."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from conftest import composed

from dnnvss.archives import read_arrays
from dnnvss.commands.speak import synthesise
from dnnvss.commands.train import train
from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.formats import read_alignment
from dnnvss.media import read_video, write_wav
from dnnvss.runs.run import Run
from dnnvss.style import read_keys
from dnnvss.synthesis.request import Recording, SpeakRequest
from dnnvss.synthesis.speak import speak
from dnnvss.timing import Alignment, Tier

FAST = ["trainer.epochs=2", "trainer.progress=false", "trainer.figure_every=0", "trainer.accelerator=cpu",
        "aam.modes=8", "jobs=1", "sample=false", "folds=0"]


def command(home: Path, name: str, *given: str) -> None:
    config = composed(name, *given)
    if name == "train":
        train(config)
    else:
        synthesise(config)


@pytest.fixture(scope="module")
def home(encoded: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A corpus and two runs of it: one over time that only listens, one of phones."""
    home = tmp_path_factory.mktemp("voice")
    shutil.copytree(encoded, home / "demo")
    heard = ["labels=mel", "labels.blocks=[logmel]", "model=recurrent", "model.network.width=16"]
    for name, given in (("heard", heard),
                        ("phones", ["labels=ph_a", "model=feedforward", "model.network.hidden=[16]"])):
        command(home, "train", f"corpus.out={home}/demo", f"run={home}/runs/{name}", f"runs={home}/runs", *given, *FAST)
    corpus = Corpus.open(home / "demo")
    sound = corpus.sound(corpus.utterances[corpus.split("test")[0].id])
    write_wav(home / "said.wav", sound.samples, sound.rate)
    return home


def test_a_voice_alone_becomes_a_face(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command(home, "synth", f"runs={home}/runs", f"wav={home}/said.wav", f"out={home}/a.mp4",
            f"export_keys={home}/keys.csv", f"export_curves={home}/curves.csv", "key_names=[aperture]")
    told = capsys.readouterr().out
    assert "runs/heard (labels=mel model=recurrent" in told and "the last run that needs no text" in told
    assert "a voice alone tells no phones: style.closures has no effect" in told
    report = json.loads((home / "a.json").read_text())
    assert report["text"] == "" and not {
        risk["kind"] for span in report["risks"]["spans"] for risk in span["risks"]} - {"unheard sound"}
    times = read_alignment(home / "a.TextGrid")
    assert [tier.name for tier in times.tiers] == ["speech"] and "speech" in times["speech"].labels
    seconds = len(read_arrays(home / "a.npz")["parameters"]) / 100
    assert seconds == pytest.approx(times.end, abs=0.011)
    assert len(read_video(home / "a.mp4")) == pytest.approx(30 * seconds, abs=1)
    keys = read_keys(home / "keys.csv")
    assert len(keys) == int(10 * seconds) and {key.index for key in keys} == {None}


def test_keys_and_text_do_with_a_voice(home: Path) -> None:
    run = Run.open(home / "runs" / "heard")
    corpus = Corpus.open(home / "demo")
    utterance = corpus.split("test")[0]
    sound = corpus.sound(utterance)
    voice = Recording(sound.samples, sound.rate)
    alone = speak(run, SpeakRequest(recording=voice))
    both = speak(run, SpeakRequest(text=utterance.text, recording=voice, alignment=utterance.alignment))
    assert alone.plan.phones is None and both.plan.phones is not None
    frames = min(len(alone.movement), len(both.movement))
    np.testing.assert_allclose(alone.movement[:frames], both.movement[:frames], atol=1e-3)  # plain: the same sound
    keys = alone.keys(["aperture"], [0.5])
    held = speak(run, SpeakRequest(recording=voice, keys=tuple(keys)))
    again = run.face.gauges["aperture"](held.movement)
    at = [int(key.time * 100 + 1e-6) for key in keys]
    np.testing.assert_allclose(again[at], [key.low for key in keys], atol=1e-3)


@pytest.mark.parametrize("given, message", [
    (["run=phones"], r"labels=ph_a of the run needs phones, which a voice alone does not tell.*text="),
    (["run=heard", "wav=null"], r"nothing to say: text is empty.*wav=FILE")])
def test_what_is_missing_is_said(home: Path, given: list[str], message: str) -> None:
    given = [f"run={home}/runs/{g[4:]}" if g.startswith("run=") else g for g in given]
    with pytest.raises(DnnvssError, match=message):
        command(home, "synth", f"wav={home}/said.wav", f"out={home}/b.mp4", *given)


def test_a_recording_without_sound_is_refused(home: Path) -> None:
    run = Run.open(home / "runs" / "heard")
    with pytest.raises(DnnvssError, match="holds no sound"):
        speak(run, SpeakRequest(recording=Recording(np.zeros(0), 16000)))
    still = speak(run, SpeakRequest(recording=Recording(np.zeros(16000), 16000)))
    assert len(still.movement) == 100 and still.plan.tier.labels == ("sil",)


def test_a_sound_unlike_the_training_is_a_risk(home: Path) -> None:
    run = Run.open(home / "runs" / "heard")
    loud = np.random.default_rng(0).uniform(-1, 1, 16000).astype(np.float32)
    risks = speak(run, SpeakRequest(recording=Recording(loud, 16000))).risks
    assert risks and {risk["kind"] for span in risks for risk in span.risks} == {"unheard sound"}


def test_settings_of_times_that_a_recording_tells_are_named_and_errors_name_it(home: Path) -> None:
    run, samples = Run.open(home / "runs" / "heard"), np.zeros(16000, np.float32)
    samples[4000:9000] = np.sin(np.arange(5000) / 9) / 2
    recording = Recording(samples, 16000, samples, home / "said.wav")
    assert SpeakRequest(speed=2, total=3).idle == ()
    spoken = speak(run, SpeakRequest(recording=recording, speed=2, durations="model"))
    assert {"times are given: speed has no effect", "times are given: durations has no effect"} <= set(spoken.remarks)
    with pytest.raises(DnnvssError, match=r"said\.wav: "):
        speak(run, SpeakRequest(text="nothing of this was said", recording=recording))


def test_phones_are_no_risk_to_a_run_that_does_not_read_them(home: Path) -> None:
    strange = [(0.0, 0.2, "sil"), (0.2, 0.4, "ZH"), (0.4, 0.6, "ZH"), (0.6, 1.0, "sil")]
    times = Alignment([Tier("phones", strange), Tier("words", [(0.0, 0.2, ""), (0.2, 0.6, "x"), (0.6, 1.0, "")])])
    sound = Recording(np.zeros(16000, np.float32), 16000)
    kinds = {name: {risk["kind"] for span in speak(Run.open(home / "runs" / name), SpeakRequest(
        alignment=times, recording=sound)).risks for risk in span.risks} for name in ("heard", "phones")}
    assert kinds["phones"] and not kinds["heard"] - {"unheard sound"}

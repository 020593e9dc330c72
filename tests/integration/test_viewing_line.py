"""From runs to a viewing test, answers and a comparison with what viewers saw; the viewers are simulated."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from conftest import run_command
from viewing_cases import plain, simulated

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.runs import read_run
from dnnvss.evaluation.viewing.design import Condition, Design
from dnnvss.evaluation.viewing.making import make_test
from dnnvss.evaluation.viewing.run_scores import read_scores
from dnnvss.evaluation.viewing.sheet import Sheet
from dnnvss.media import SPEECH_RATE, opened, read_audio, read_video
from dnnvss.settings import read_settings

QUICK = ["trainer.progress=false", "trainer.figure_every=0", "trainer.accelerator=cpu", "aam.modes=8", "jobs=1",
         "sample=false", "folds=0", "labels=ph"]
SYSTEMS = ("phone_mean", "training_mean", "kernel")


@pytest.fixture(scope="module")
def home(encoded: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small prepared corpus, two sentences of it to be tested on, and three finished runs."""
    home = tmp_path_factory.mktemp("viewing")
    shutil.copytree(encoded, home / "demo")
    train, test = (home / "demo" / "splits" / f"{name}.txt" for name in ("train", "test"))
    ids = [*train.read_text().split(), *test.read_text().split()]
    train.write_text("\n".join(ids[:-3]) + "\n")
    test.write_text("\n".join(ids[-3:]) + "\n")
    for system in SYSTEMS:
        own = (f"run={home}/runs/{system}", f"model={system}")
        assert run_command("train", f"corpus.out={home}/demo", *own, *QUICK) == 0
    return home


def runs(home: Path) -> list[Path]:
    return [home / "runs" / system for system in SYSTEMS]


def written(home: Path, name: str, **more: object) -> Path:
    """A small design as a file of the user's own."""
    values = yaml.safe_load((Path(__file__).parents[2] / "conf" / "viewing" / f"{name}.yaml").read_text())
    path = home / f"{name}.yaml"
    path.write_text(yaml.safe_dump({**values, "sentences": 2, "per_viewer": 2, "practice": 1, "checks": 1, **more}))
    return path


@pytest.mark.slow
def test_a_test_is_made_answered_analysed_and_stands_beside_the_measures(
    home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    design = written(home, "preference")
    words = ["viewing", "make", design, *runs(home), "--out", tmp_path]
    assert run_command(*words) == 0
    said = capsys.readouterr().out
    assert "9 stimuli, 24 lists of 3 trials" in said and "key.json" in said
    page = tmp_path / "page"
    assert {p.name for p in page.iterdir()} == {"index.html", "page.css", "page.js", "trial.js", "icon.svg", "test.js",
                                                "stimuli"}
    assert not any(system in (page / "test.js").read_text() for system in SYSTEMS)
    sheet = Sheet.open(tmp_path)
    for stimulus in sheet.stimuli:
        frames = list(read_video(page / "stimuli" / f"{stimulus.id}.mp4"))
        assert len(frames) / stimulus.rate == pytest.approx(stimulus.seconds, abs=1e-5)
    times = {p: p.stat().st_mtime_ns for p in (page / "stimuli").iterdir()}
    assert run_command(*words, "--jobs", "2") == 0 and Sheet.open(tmp_path) == sheet
    assert {p: p.stat().st_mtime_ns for p in (page / "stimuli").iterdir()} == times

    quality = dict(zip((c.name for c in sheet.conditions), (0.5, -1.0, 0.8), strict=True))
    for number in range(18):
        files.write_json(tmp_path / "answers" / f"{number}.json", plain(simulated(sheet, number, quality)))
    (tmp_path / "answers" / "cut.json").write_text('{"format": 1,')
    capsys.readouterr()
    assert run_command("viewing", "analyse", tmp_path / "answers") == 0
    said = capsys.readouterr().out
    assert "refused 'cut.json': is no JSON" in said and "Strength (Bradley-Terry)" in said
    assert run_command(*words, "--seed", "5") == 1 and Sheet.open(tmp_path) == sheet
    assert "holds answers to another test" in capsys.readouterr().err
    assert run_command(*words) == 0 and Sheet.open(tmp_path) == sheet
    result = json.loads((tmp_path / "viewing.json").read_text())
    assert result["refused"].keys() == {"cut.json"} and len(result["viewers"]) + len(result["left_out"]) == 18
    seen = read_scores(runs(home)[0])
    assert len(seen) == 1 and seen[0].score == pytest.approx(result["scores"][sheet.conditions[0].name]["value"])

    assert run_command("compare", *runs(home), "--out", tmp_path / "compared") == 0
    text = (tmp_path / "compared" / "evaluation.md").read_text()
    assert "### What viewers saw: Which talking face looks more natural?" in text
    assert "### Ranks of viewers and of measures" in text and "| 3 |" in text
    html = (tmp_path / "compared" / "evaluation.html").read_text()
    assert "What viewers saw" in html and f"{seen[0].score:.3f}" in html
    (runs(home)[0] / "model.npz").write_bytes(b"trained anew")
    assert read_scores(runs(home)[0]) == ()


@pytest.mark.slow
def test_conditions_show_what_they_say(home: Path, tmp_path: Path) -> None:
    design = read_settings(Design, yaml.safe_load(written(home, "single", headphones=True).read_text()), "")
    folder = runs(home)[2:]
    shows = ("run", "through", "random", "frozen", "recording")
    conditions = tuple(Condition(name, name) for name in shows)
    conditions += (Condition("smoothed", "through", smooth=2.0), Condition("strong", dials={"articulation": 1.5}),
                   Condition("engine", "run", sound="engine"), Condition("silent", "frozen", sound="silent"))
    made = replace(design, conditions=conditions, anchors=(), engine="formant", sentences=1, per_viewer=1, practice=0)
    twice = replace(made, conditions=(Condition("a", "recording"), Condition("b", "recording")))
    with pytest.raises(DnnvssError, match="a and b show the same"):
        make_test(twice, folder, ["mean"], tmp_path / "twice")
    sheet = make_test(made, folder, ["mean"], tmp_path)
    films = {sheet.conditions[s.condition].name: tmp_path / "page" / "stimuli" / f"{s.id}.mp4" for s in sheet.stimuli}
    pictures = {name: np.stack([f.astype(float) for f in read_video(path)]) for name, path in films.items()}
    moved = {name: np.abs(np.diff(f, axis=0)).mean() for name, f in pictures.items()}
    assert moved["frozen"] < 0.05 < moved["random"]
    assert moved["smoothed"] < moved["through"] and moved["run"] < moved["strong"]
    name = sheet.sentences[0]
    recorded = np.stack([f.astype(float) for f in read_video(home / "demo" / "video" / f"{name}.mp4")])
    assert np.abs(pictures["recording"][:len(recorded)] - recorded).mean() < 4
    away = {k: np.abs(pictures[k] - pictures["recording"]).mean() for k in ("through", "random", "frozen")}
    assert away["through"] < away["random"] and away["through"] < away["frozen"]
    assert len({len(pictures[k]) for k in shows}) == 1
    own = read_audio(films["through"], SPEECH_RATE)
    truth = read_audio(home / "demo" / "audio" / f"{name}.wav", SPEECH_RATE)
    count = min(len(own), len(truth))
    assert np.corrcoef(own[:count], truth[:count])[0, 1] > 0.95
    assert len(read_audio(films["engine"], SPEECH_RATE)) > 0 and not _has_sound(films["silent"])
    assert read_run(folder[0]).arrays["reference"].keys() >= {name}


def _has_sound(path: Path) -> bool:
    with opened(path) as container:
        return bool(container.streams.audio)


@pytest.mark.slow
def test_words_are_monosyllables_in_their_place(home: Path, tmp_path: Path) -> None:
    design = read_settings(Design, yaml.safe_load(written(home, "intelligibility", alternatives=2).read_text()), "")
    sheet = make_test(replace(design, monosyllables=True, practice=0), runs(home)[2:], ["a"], tmp_path)
    assert len(set(sheet.words)) == 2 and all(":" in name for name in sheet.sentences)
    assert all(0.2 < s.seconds < 1.5 for s in sheet.stimuli)
    assert all(set(t.choices) <= set(sheet.words) for t in sheet.trials)

"""Viewing tests of tiny videos, and simulated viewers for the tests of the code; nobody ever looked at these."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from dnnvss.evaluation.viewing.answers import Answer, Device, Row, Seen
from dnnvss.evaluation.viewing.design import Design, conditions_of
from dnnvss.evaluation.viewing.making import lay_out, write_sheet
from dnnvss.evaluation.viewing.sheet import PAGE, Sheet, Shown, Stimulus, Trial
from dnnvss.media import write_video
from dnnvss.settings import read_settings

CONF = Path(__file__).parents[1] / "conf" / "viewing"
WORDS = ("bin", "lay", "place", "set", "blue", "green", "red", "white", "now", "please", "soon", "again")


def design(name: str, **changes: Any) -> Design:
    """A design of ``conf/viewing``, small."""
    small = {"sentences": 4, "per_viewer": 4, "practice": 1, "checks": 1, "rest": 3}
    found = read_settings(Design, yaml.safe_load((CONF / f"{name}.yaml").read_text()), "")
    return replace(found, **{**small, **changes})


def sheet_of(made: Design, runs: tuple[str, ...] = ("good", "bad")) -> Sheet:
    """The sheet of a test of runs that there are not."""
    conditions = conditions_of(made, runs[:max(c.run for c in made.conditions)] if made.conditions else runs)
    said = [(f"s{k}", WORDS[k % len(WORDS)]) for k in range(made.sentences + made.practice)]
    stimuli = [Stimulus(f"{k:08x}{c:08x}", c, k, 0.48, 25.0, made.seed, "1") for k in range(len(said))
               for c in range(len(conditions))]
    shown = [Shown(c.name, c.shows) for c in conditions]
    return lay_out(made, conditions, shown, said, made.sentences, list(range(made.sentences, len(said))), stimuli)


def write_test(folder: Path, sheet: Sheet) -> Path:
    """Write a test with a short video for every stimulus, and its page."""
    from dnnvss.studio.viewing import write_page

    write_sheet(sheet, folder)
    write_page(folder)
    rng = np.random.default_rng(0)
    tone = (0.1 * np.sin(np.arange(21168) / 20)).astype(np.float32)
    for stimulus in sheet.stimuli:
        ground = rng.integers(60, 200, (96, 128, 3), dtype=np.uint8)
        frames = [np.roll(ground, 3 * k, axis=1) for k in range(12)]
        write_video(folder / PAGE / "stimuli" / f"{stimulus.id}.mp4", frames, 25, tone, 44100)
    return folder


def seen(sheet: Sheet, trial: Trial) -> tuple[Seen, ...]:
    """The stimuli of a trial as the page knows them."""
    by_id = {s.id: s for s in sheet.stimuli}
    return tuple(Seen(name, by_id[name].seed, by_id[name].version) for name in trial.stimuli)


def simulated(sheet: Sheet, number: int, quality: dict[str, float], careless: bool = False, noise: float = 1.0
              ) -> Answer:
    """The answer of a simulated viewer, who sees qualities through noise, or answers at random.

    Args:
        sheet: of the test.
        number: of the viewer; the list follows from it.
        quality: of the conditions by name, on a scale whose unit is the noise of a judgement.
        careless: whether all answers are random, those to attention checks too.
        noise: standard deviation of a judgement.
    """
    rng = np.random.default_rng([number, 9])
    what = {s.id: sheet.conditions[s.condition].name for s in sheet.stimuli}
    own = {name: value + 0.3 * rng.normal() for name, value in quality.items()}
    rows, which = [], number % len(sheet.lists)
    for k in sheet.lists[which]:
        trial = sheet.trials[k]
        felt = [noise * rng.normal() + (0 if careless else own[what[name]]) for name in trial.stimuli]
        attends = trial.expect is not None and not careless
        rows.append(Row(k, seen(sheet, trial), **_given(sheet, trial, felt, attends, rng)))
    return Answer(1, sheet.id, f"{number:032x}", which, 1000.0, 2000.0, Device(1200, 800), tuple(rows))


def _given(sheet: Sheet, trial: Trial, felt: list[float], attends: bool, rng: np.random.Generator) -> dict[str, Any]:
    kind = sheet.design["kind"]
    if kind in ("dscqs", "single"):
        scores = tuple(float(np.clip(50 + 12 * f, 0, 100)) for f in felt)
        at = {"least": 0.0, "most": 100.0}.get(str(trial.expect), 0.0)
        return {"scores": tuple(at for _ in felt) if attends else scores}
    if kind == "intelligibility":
        said = sheet.words[{s.id: s.sentence for s in sheet.stimuli}[trial.stimuli[0]]]
        right = trial.expect if attends else said if felt[0] > 0 else None
        return {"word": right or (str(rng.choice(trial.choices)) if trial.choices else "nothing")}
    if attends:
        return {"choice": trial.expect}
    if kind == "turing":
        return {"choice": "real" if felt[0] > 0 else "synthetic"}
    return {"choice": "left" if felt[0] > felt[1] else "right"}


def plain(answer: Answer) -> dict[str, Any]:
    """An answer as the page writes it."""
    return asdict(answer)

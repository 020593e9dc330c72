"""Writes what was spoken: the video, and beside it trajectory, times, sound, report and plot."""

import json
from collections.abc import Callable, Iterator, Mapping
from itertools import chain
from pathlib import Path
from textwrap import shorten
from types import MappingProxyType
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.face.kinds import face_kind
from dnnvss.formats import write_alignment
from dnnvss.media import SPEECH_RATE, write_video, write_wav
from dnnvss.shortages import shortage_of
from dnnvss.synthesis.speak import Spoken
from dnnvss.timing import Tier

SOUND = ".wav"
PLOTTED = 5
"""Coefficients in the plot."""
_TITLE = 200
"""Letters of the text above the plot."""


def beside(out: Path) -> list[Path]:
    """What is written beside every video: trajectory, alignment, plot and report."""
    return [out.with_suffix(suffix) for suffix in (".npz", ".TextGrid", ".png", ".json")]


def write_spoken(spoken: Spoken, out: Path, about: Mapping[str, Any] = MappingProxyType({}), keep: Path | None = None,
                 progress: Callable[[Iterator[np.ndarray]], Iterator[np.ndarray]] = iter) -> list[Path]:
    """Write the video and all that belongs to it; return the paths, the video first.

    All of them come to be at the end, so that a video that cannot be finished leaves the older files as they were, and
    two programs that write to one name end with the files of one. Nothing that goes wrong with what lies beside the
    video costs the rest; the older file of that name is then gone too.

    Args:
        spoken: what is written.
        out: the video.
        about: what only the caller knows and the report is to say.
        keep: a sound that is left as it is where the name is the same, because it is what was read.
        progress: what the pictures pass through as they are drawn.

    Raises:
        DnnvssError: the video cannot be written; or something beside it, after all else was.
    """
    trajectory, textgrid, plot, page = beside(out)
    sound, times, wav = spoken.plan.sound, spoken.plan.alignment, out.with_suffix(SOUND)
    steps: dict[Path, Callable[[], Any]] = {
        trajectory: lambda: write_trajectory(trajectory, spoken), textgrid: lambda: write_alignment(textgrid, times),
        page: lambda: files.write_json(page, json.loads(json.dumps(report(spoken, **about), default=str)))}
    if sound and (keep is None or wav.resolve() != keep.resolve()):
        steps[wav] = lambda: write_wav(wav, sound.samples, sound.rate)
    steps[plot] = lambda: draw(plot, spoken)  # last: it loads matplotlib
    with files.together(page) as group:
        write_video(out, progress(spoken.frames()), spoken.stage.clock.rate, sound.samples if sound else None,
                    sound.rate if sound else SPEECH_RATE, pixel=spoken.stage.pixel)
        failed = {path: error for path, step in steps.items() if (error := _tried(path, step))}
        for path in failed:
            group.leave_out(path)
    failures = list(failed.values())
    if failures:
        first = failures[0]
        remedy = f"{first.remedy or 'Try again'}; the video {out} is whole"
        raise DnnvssError(first.problem, file=first.file, remedy=remedy) from first
    return [out, *(path for path in (*beside(out), wav) if path in steps)]


def _tried(path: Path, step: Callable[[], Any]) -> DnnvssError | None:
    """What kept a file from being written, None where nothing did."""
    try:
        step()
    except DnnvssError as error:
        return error
    except Exception as error:  # of a library that draws or encodes: the video is worth more than its kind
        if (short := shortage_of(error, path)) is not None:
            return short
        return DnnvssError(f"could not be written ({type(error).__name__}: {error})", file=path,
                           remedy="Report it with this message")
    return None


def write_trajectory(path: Path, spoken: Spoken) -> Path:
    """Write parameters, their names, points and rate as ``.npz`` and return the path."""
    parts = spoken.points()
    first = next(parts)
    points = files.Rows((len(spoken.trajectory), *first.shape[1:]), np.float32, chain([first], parts))
    return files.write_arrays(path, parameters=np.asarray(spoken.trajectory, np.float32), rate=float(spoken.clock.rate),
                              columns=np.array(spoken.run.face.names), points=points)


def draw(path: Path, spoken: Spoken) -> Path:
    """Write a plot of the leading coefficients with the phones and return the path; of a long text its first page."""
    from dnnvss.render.plots import PAGE, plot_trajectories

    x, tier, title = spoken.trajectory, spoken.plan.tier, shorten(spoken.plan.text, _TITLE, placeholder=" ...")
    if len(tier) > PAGE:
        title, tier = f"of {tier.end / 60:.0f} minutes: {title}", Tier(tier.name, tier.segments[:PAGE])
        title, x = f"the first {tier.end:.0f} seconds {title}", x[: spoken.clock.edge(tier.end)]
    series = {f"coefficient {d + 1}": x[:, d] for d in range(min(PLOTTED, x.shape[1]))}
    return plot_trajectories(path, series, spoken.clock.rate, tier, title)


def report(spoken: Spoken, **about: Any) -> dict[str, Any]:
    """What the report beside a video says, in plain containers.

    Args:
        spoken: what it is about.
        about: what only the caller knows, such as the style by its settings.
    """
    plan, run = spoken.plan, spoken.run
    lacks = face_kind(run.face.kind).lacks
    optional = {"pronunciation": list(plan.pronunciation), "alignment_scores": list(plan.scores),
                "engine": plan.engine, "visemes": spoken.visemes}
    risks = {"frames": len(spoken.movement), "rate": str(spoken.clock.rate),
             **({} if spoken.unfamiliar is None else {"unseen_triphones": round(spoken.unfamiliar, 3)}),
             "spans": [span.to_json() for span in spoken.risks]}
    return {"run": str(run.folder), "text": plan.text, **{k: v for k, v in optional.items() if v},
            "replaced_phones": dict(spoken.stand_ins), "risks": risks, **about, **_life(spoken),
            "model": dict(spoken.report), "credit": run.voice.credit, **({"face": lacks} if lacks else {}),
            **spoken.stage.notes}


def _life(spoken: Spoken) -> dict[str, Any]:
    """How far eyes and head live, by which seed, and when the eyes blink; None where no landmarks tell."""
    life = spoken.run.life
    if spoken.moves is None or life is None:
        return {}
    style, rate = spoken.request.style, float(spoken.stage.clock.rate)
    begun = [round(float(frame) / rate, 3) for frame in spoken.moves.blinks]
    blinks = begun if life.tracks.recorded else None
    return {"life": {"share": style.life, "seed": style.seed, "blinks": blinks}}

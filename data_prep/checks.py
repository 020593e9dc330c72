"""The landmarks of all recordings: found where they are not given, checked, and written without what is not a face."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from data_prep.landmarks import read_raw, write_clean
from data_prep.points import FOUND, VERSION, find_points
from data_prep.recipe import Preparation, Results
from data_prep.recordings import MEDIA
from data_prep.stages import FOLDER
from data_prep.upright import askew, eyes_apart
from dnnvss import files
from dnnvss.corpus import checkup
from dnnvss.errors import DnnvssError
from dnnvss.face.landmarker import engine, mesh_groups
from dnnvss.formats import LAYOUT_68
from dnnvss.phones import SILENCES
from dnnvss.timing import Alignment, FrameClock

BROKEN, LOST, OUTSIDE = "broken pictures", "landmarks not found", "landmarks outside the picture"
GHOSTS, JUMPS = "landmarks that are not the face", "the picture jumps"
"""What may be wrong with a frame."""

EYES = ("right_eye", "left_eye")
"""Groups of landmarks that run round an eye."""

READ = 1
"""Version of how landmarks are read."""

_SEVERAL, _RESCALED, _AGREE = 3, np.log(1.4), np.log(1.15)
"""Utterances from which one can be told from the others; logarithms of the scale from which it is another, and of how
far height and place of a face may differ in it."""

DAMAGED = 5
"""Frames of landmarks off the face from which a clip whose picture jumps is taken to be damaged."""


def found(run: Preparation, made: Results) -> None:
    """Find the landmarks of the videos that bring none."""
    recipe, shop = run.recipe, run.shop
    if recipe.task is None:
        return
    tasks = {s.id: {"video": s.video, "sound": files.inside(shop.out, made[s.id]["sound"]), "rate": made[s.id]["rate"],
                    "task": recipe.task} for s in run.alive() if s.video is not None and not s.landmarks}
    for name, found in run.take(shop.run(FOUND, find_points, tasks, [VERSION, engine()])).items():
        run.outcomes[name].notes.extend(found["notes"])
    run.found.append(f"the landmarks of {len(tasks)} recordings were found in their pictures")
    for k, source in enumerate(run.sources):
        if source.id in tasks:
            run.sources[k] = replace(source, landmarks=(shop.out / FOLDER / FOUND / f"{source.id}.npz",))


def examined(run: Preparation, made: Results, size: tuple[int, int]) -> dict[str, np.ndarray]:
    """The frames (F,) of each utterance that show no face of the talker; the report says why.

    Where there is no video, that is what the landmarks tell alone.
    """
    _counted(run, made, size)
    names = [s.id for s in run.alive()]
    if not names:
        run.nothing_left()
    clips = {n: run.shop.arrays("media", n)["thumbnails"][run.shop.arrays("video", n)["index"]]
             for n in names if made[n]["video"]}
    marks = {n: run.shop.arrays("landmarks", n) for n in names}
    info, limits = run.recipe.info, run.recipe.limits
    count = marks[names[0]]["points"].shape[1]
    run.found.append(f"{count} curves of a rig" if info.dimensions == 1 else
                     f"{count} landmarks a frame, {info.dimensions} coordinates in {info.unit}")
    lids = [row for eye in EYES for row in range(*info.landmark_groups.get(eye, (0, 0)))]
    doubts = _doubted(marks, clips, size if info.dimensions == 2 else (0, 0), limits, lids)
    for name, times in (_rescaled(marks) if info.dimensions == 2 else {}).items():
        run.drop(name, f"its landmarks are {times:.2f} times as large, and as far from the picture's corner, as those "
                       "of the others: track this very video, or bring its points to their scale")
    for name in names:
        _tell(run, name, {what: masks[name] for what, masks in doubts.items()})
    for name, distance in (checkup.off_colour(clips, limits) if clips else {}).items():
        run.outcomes[name].notes.append(f"off colour throughout ({distance:.0f} robust sd from the corpus)")
    return {n: doubts[BROKEN][n] | doubts[OUTSIDE][n] | doubts[GHOSTS][n] for n in names}


def _counted(run: Preparation, made: Results, size: tuple[int, int]) -> None:
    """Read the landmarks of all recordings, and drop those with another number of points."""
    dimensions = run.recipe.info.dimensions
    stages = run.shop.out / FOLDER
    tasks = {s.id: {"landmarks": s.landmarks, "scale": run.recipe.scale, "frames": made[s.id]["source"]["frames"],
                    "size": made[s.id]["source"]["size"] if made[s.id]["video"] else list(size),
                    "dimensions": dimensions,
                    **({"shown": stages / "video" / f"{s.id}.npz", "place": made[s.id]["place"]}
                       if made[s.id]["video"] else {})} for s in run.alive()}
    if run.recipe.rows is not None:
        tasks = {i: {**task, "rows": run.recipe.rows} for i, task in tasks.items()}
    counted = run.take(run.shop.run("landmarks", read_raw, tasks, [MEDIA, READ]))
    if shares := sum("shares" in c for c in counted.values()):
        run.found.append(f"the landmarks of {shares} recordings are shares of the picture: taken times its size")
    usual = Counter(c["points"] for c in counted.values()).most_common(1)
    for name, c in counted.items():
        if c["rows"] != tasks[name]["frames"]:
            run.outcomes[name].notes.append(f"has {c['rows']} rows of landmarks for {tasks[name]['frames']} frames")
        if c.get("held"):
            run.outcomes[name].notes.append(f"{c['held']} frames repeat the landmarks of an earlier one: not taken")
        if c["faces"] > 1:
            run.outcomes[name].notes.append(f"{c['faces']} faces were tracked; the largest is taken")
        if c["points"] != usual[0][0]:
            run.drop(name, f"has {c['points']} landmarks a frame, most of the corpus has {usual[0][0]}")
    if usual:
        _check_groups(run.recipe.info.landmark_groups, usual[0][0])
    for source in run.alive() if dimensions == 2 else []:
        marks = run.shop.arrays("landmarks", source.id)
        if why := askew(marks["points"], marks["valid"], run.recipe.info.landmark_groups):
            run.drop(source.id, why)
    if dimensions == 2:
        _mirrored(run)


def _mirrored(run: Preparation) -> None:
    """Drop recordings whose landmarks have the eyes the other way round than most, or than their markup has them."""
    groups = run.recipe.info.landmark_groups
    apart = {s.id: eyes_apart(marks["points"], marks["valid"], groups) for s in run.alive()
             for marks in [run.shop.arrays("landmarks", s.id)]}
    known = groups in (LAYOUT_68, mesh_groups())
    usual = 1.0 if known or sum(map(np.sign, apart.values())) >= 0 else -1.0
    for name, distance in apart.items():
        if distance * usual < 0:
            run.drop(name, "its landmarks are mirrored: the right eye stands where the left one should. Track this "
                     "very video, or write width - x for x")


def _doubted(marks: Mapping[str, Mapping[str, np.ndarray]], clips: Mapping[str, np.ndarray], size: tuple[int, int],
             limits: checkup.CheckupLimits, lids: Sequence[int]) -> dict[str, dict[str, np.ndarray]]:
    """Kind of doubt to the frames (F,) of each utterance that it is about.

    Args:
        marks: ``points`` and ``valid`` of each utterance.
        clips: thumbnails of those that have pictures.
        size: of the pictures; zeros where points are not to be compared with it.
        limits: what counts as an outlier.
        lids: rows of the points round the eyes.
    """
    whole = {n: np.zeros(len(m["valid"]), bool) for n, m in marks.items()}
    broken = whole | (checkup.broken_pictures(clips, limits) if clips else {})
    jumps = whole | ({n: m & ~broken[n] for n, m in checkup.jumps(clips, limits).items()} if clips else {})
    outside = whole | ({n: m["valid"] & checkup.outside(m["points"], size, limits) for n, m in marks.items()}
                       if min(size) > 0 else {})
    valid = {n: m["valid"] & ~broken[n] & ~outside[n] for n, m in marks.items()}
    points = {n: m["points"] for n, m in marks.items()}
    curves = next(iter(points.values())).shape[2] == 1  # which no face constrains
    ghosts = whole if curves else _ghosts(points, valid, limits, lids)
    return {BROKEN: broken, LOST: {n: ~m["valid"] for n, m in marks.items()}, OUTSIDE: outside, GHOSTS: ghosts,
            JUMPS: jumps}


def _ghosts(points: dict[str, np.ndarray], valid: Mapping[str, np.ndarray], limits: checkup.CheckupLimits,
            lids: Sequence[int]) -> dict[str, np.ndarray]:
    """The frames (F,) of each utterance whose points are not the face, with and without those round the eyes.

    In a corpus of few blinks a lid that falls is as far from what is usual as a point that left the face.
    """
    found = checkup.ghosts(points, valid, limits)
    if not lids or not any(mask.any() for mask in found.values()):
        return found
    count = next(iter(points.values())).shape[1]
    others = checkup.ghosts(points, valid, limits, np.setdiff1d(np.arange(count), lids).tolist())
    return {n: mask & others[n] for n, mask in found.items()}


def _rescaled(marks: Mapping[str, Mapping[str, np.ndarray]]) -> dict[str, float]:
    """How many times as large the points of an utterance are as is usual, where they are in another scale.

    A face that is nearer or smaller stays where it is in the picture; points in another scale come nearer to its corner
    or go away from it by as much as they are smaller or larger.

    Args:
        marks: ``points`` (F, P, 2) and ``valid`` (F,) of each utterance.
    """
    seen = {n: m["points"][m["valid"]] for n, m in marks.items() if m["valid"].any()}
    measured = {n: np.array([np.median(np.ptp(p, axis=1)[:, 1]), *np.median(p.mean(axis=1), axis=0)])
                for n, p in seen.items()}
    if len(measured) < _SEVERAL:
        return {}
    usual = np.median(list(measured.values()), axis=0)
    if not (usual > 0).all():
        return {}
    times = {n: own / usual for n, own in measured.items() if (own > 0).all()}
    return {n: float(t[0]) for n, t in times.items()
            if abs(np.log(t[0])) > _RESCALED and (np.abs(np.log(t[1:] / t[0])) < _AGREE).all()}


def _tell(run: Preparation, name: str, found: Mapping[str, np.ndarray]) -> None:
    """Say in the report which frames of an utterance are in doubt; drop it where its pictures are damaged for long."""
    for what in (BROKEN, LOST, OUTSIDE, GHOSTS):
        if found[what].any():
            run.outcomes[name].repair(f"{what} in {found[what].sum()} frames ({_ranges(found[what])})")
    if found[JUMPS].any():
        run.outcomes[name].notes.append(f"{JUMPS} at frame {_ranges(found[JUMPS])}; damaged before?")
        if found[GHOSTS].sum() >= DAMAGED:
            run.drop(name, "pictures damaged for long: they jump, and the landmarks leave the face")


def _check_groups(groups: Mapping[str, tuple[int, int]], points: int) -> None:
    """Refuse groups of landmarks that go beyond the points of a frame."""
    for name, (first, end) in groups.items():
        if end > points:
            raise DnnvssError(f"the group of landmarks {name} runs from {first} to {end}, and a frame has {points}",
                              remedy="Describe the groups in landmarks.json as the landmarks have them")


def _ranges(mask: np.ndarray) -> str:
    """Return the runs of True as text, such as ``0-11, 36``."""
    index = np.flatnonzero(mask)
    runs = np.split(index, np.flatnonzero(np.diff(index) > 1) + 1)
    return ", ".join(f"{r[0]}-{r[-1]}" if len(r) > 1 else f"{r[0]}" for r in runs)


def cleaned(run: Preparation, made: Results, timed: Results, bad: Mapping[str, np.ndarray]) -> Results:
    """Write the landmarks that are left; drop utterances with too few of them over speech."""
    tasks = {}
    for s in run.alive():
        marks = run.shop.out / FOLDER / "landmarks" / f"{s.id}.npz"
        good = run.shop.arrays("landmarks", s.id)["valid"] & ~bad[s.id]
        phones = Alignment.from_json(timed[s.id]["alignment"])["phones"]
        spoken = [p for p in phones if p.label not in SILENCES]
        if not spoken:
            run.drop(s.id, "its alignment holds no speech")
            continue
        clock = FrameClock(made[s.id]["rate"])
        speech = good[clock.edge(spoken[0].start): clock.edge(spoken[-1].end)]
        if not good.any() or speech.mean() < run.recipe.speech_valid:
            run.drop(s.id, f"only {speech.sum()} of the {len(speech)} frames of speech have landmarks to be trusted")
        else:
            tasks[s.id] = {"marks": marks, "bad": "".join("10"[int(g)] for g in good)}
    return run.take(run.shop.run("clean landmarks", write_clean, tasks))

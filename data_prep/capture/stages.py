"""The repair of a session of markers, stage by stage: what is common to its takes is learnt between them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from data_prep.capture.head import jig_of
from data_prep.capture.learnt import Usual, learn_usual
from data_prep.capture.repair import settled, usual_places, whole
from data_prep.stages import FOLDER, Workshop
from dnnvss import files
from dnnvss.archives import Held, read_arrays, read_declared
from dnnvss.corpus.similarity import fit_similarity
from dnnvss.errors import DnnvssError
from dnnvss.formats import write_npz
from dnnvss.formats.openface import Landmarks

VERSION = 1
"""Of what the stages leave behind."""
_SETTLED, _WHOLE = "settled", "repaired"
_SAMPLE, _SHARE = 60, 150
"""Frames of a take from which the jig and the usual places, and the common movement are learnt."""
_NEVER = 0.5
"""Share of a take in which a marker may be missing."""
_REMEDY = "Delete .stages and prepare again"
REPAIRS = "repairs"
"""The folder of the prepared corpus with each repaired stretch of each take."""


@dataclass(frozen=True)
class MarkerGroups:
    """Which markers are which.

    Args:
        face, jig: their columns in a take.
        rows: group to the half-open range of its rows in the corpus, where the jig comes last.
        order: names of the markers of the face, as in the corpus.
    """

    face: tuple[int, ...]
    jig: tuple[int, ...]
    rows: dict[str, tuple[int, int]]
    order: tuple[str, ...]


@dataclass(frozen=True)
class Done:
    """What became of the takes: the files of the repaired ones, notes, and why others cannot be used."""

    marks: dict[str, Path]
    notes: dict[str, list[str]]
    problems: dict[str, str]


def groups_of(
    names: Sequence[str], jig: Sequence[str] | str, groups: Mapping[str, Sequence[str]] | None
) -> MarkerGroups:
    """The groups of named markers.

    Args:
        names: of the markers of a take.
        jig: names of those on the jig, or what they begin with.
        groups: group to its markers in order; the names without the digits at their end where None.

    Raises:
        DnnvssError: names that no marker has, less than three on the jig, or no group ``lips`` of four and more.
    """
    on_jig = [n for n in names if n.lower().startswith(jig.lower())] if isinstance(jig, str) else list(jig)
    wanted = {group: list(own) for group, own in groups.items()} if groups else _by_stem(names, on_jig)
    _check_groups(names, on_jig, wanted)
    order = [n for own in wanted.values() for n in own]
    ends = np.cumsum([0, *map(len, wanted.values()), len(on_jig)]).tolist()
    rows = {group: (a, b) for group, a, b in zip([*wanted, "jig"], ends[:-1], ends[1:], strict=True)}
    return MarkerGroups(
        tuple(names.index(n) for n in order), tuple(names.index(n) for n in on_jig), rows, tuple(order))


def _by_stem(names: Sequence[str], on_jig: Sequence[str]) -> dict[str, list[str]]:
    """The markers that are not on the jig, by their names without the digits at the end."""
    found: dict[str, list[str]] = {}
    for name in names:
        if name not in on_jig:
            found.setdefault(name.rstrip("0123456789").rstrip("_-. ") or name, []).append(name)
    return found


def _check_groups(names: Sequence[str], on_jig: Sequence[str], groups: Mapping[str, Sequence[str]]) -> None:
    """Refuse groups of markers that there are not, too few of them, or one marker twice."""
    order = [n for own in groups.values() for n in own]
    if unknown := [n for n in (*on_jig, *order) if n not in names]:
        raise DnnvssError(f"no marker is called {unknown[0]!r}",
                          remedy=f"There are {', '.join(names[:12])}{', ...' if len(names) > 12 else ''}")
    if len(on_jig) < 3:
        raise DnnvssError(f"{len(on_jig)} markers are known to sit on a jig, and head motion needs 3",
                          remedy="Name markers that do not move on the head: corpus.importer.jig=[NAME, NAME, NAME]")
    if len(groups.get("lips", ())) < 4:
        raise DnnvssError(f"the group lips has {len(groups.get('lips', ()))} markers, and a mouth needs 4",
                          remedy="Give groups: corpus.importer.groups={lips: [NAME, ...], jaw: [...]}")
    if len(set(order)) < len(order):
        raise DnnvssError("a marker is in two groups", remedy="Name each marker once")


def repaired(
    shop: Workshop,
    takes: Mapping[str, Path],
    groups: MarkerGroups,
    rate: float,
) -> Done:
    """The takes of a session, repaired.

    Args:
        shop: where to work.
        takes: id to what was read.
        groups: of the markers.
        rate: frames a second of all takes.

    Raises:
        DnnvssError: the jig is never seen whole, or a marker is never seen.
    """
    common = _what_is_common(shop.out / FOLDER, takes.values(), groups)
    names = list(groups.order)
    columns = {"face": list(groups.face), "jig": list(groups.jig)}
    shared = {"common": common, "rate": rate, "names": names}
    first = shop.run(
        _SETTLED, settle, {i: {"path": path, **columns, **shared} for i, path in takes.items()}, VERSION
    )
    settled_ones = {i: shop.out / FOLDER / _SETTLED / f"{i}.npz" for i in takes if "dropped" not in first[i]}
    second = {}
    if settled_ones:
        usual = _what_is_usual(shop.out / FOLDER, settled_ones.values(), len(groups.face))
        tasks = {i: {"path": path, "usual": usual, **shared} for i, path in settled_ones.items()}
        second = shop.run(_WHOLE, make_whole, tasks, VERSION)
    told = {i: {**first[i], **own} for i, own in second.items() if "dropped" not in own}
    for i, own in told.items():
        files.write_json(shop.out / REPAIRS / f"{i}.json", own)
    return Done(
        {i: shop.out / FOLDER / _WHOLE / f"{i}.npz" for i in told},
        {i: [summed(own)] for i, own in told.items()},
        {i: str(r["dropped"]) for i, r in (first | second).items() if "dropped" in r},
    )


def _what_is_common(home: Path, takes: Iterable[Path], groups: MarkerGroups) -> Path:
    """The file with the jig, and with the usual place of each marker of the face beside it.

    Raises:
        DnnvssError: the jig is never seen whole, or a marker is never seen.
    """
    samples = [_sampled(path, _SAMPLE) for path in takes]
    jig = jig_of([s[:, list(groups.jig)] for s in samples])
    places = usual_places(_stilled(samples, groups, jig))
    if never := [
        n for n, place in zip(groups.order, places, strict=True) if abs(place).max() > 1e5
    ]:
        raise DnnvssError(
            f"the marker {never[0]!r} is missing in all takes",
            remedy="Leave it out of corpus.importer.groups, or label it in the takes",
        )
    return _kept(home / "session.npz", jig=jig, rest=places)


def _what_is_usual(home: Path, takes: Iterable[Path], markers: int) -> Path:
    """The file with how the markers of all takes move together."""
    usual = learn_usual([_sampled(path, _SHARE).reshape(-1, 3 * markers) for path in takes])
    return _kept(home / "usual.npz", mean=usual.mean, modes=usual.modes, own=usual.own)


def settle(
    name: str,
    out: Path,
    path: Path,
    common: Path,
    face: list[int],
    jig: list[int],
    rate: float,
    names: list[str],
) -> dict[str, Any]:
    """What was repaired of a take, after writing it without head motion and under right names.

    Raises:
        DnnvssError: its jig is hardly seen.
    """
    points = read_arrays(path, _REMEDY)["points"].astype(float)
    held = read_declared(common, {"jig": Held(("J", 3)), "rest": Held(("M", 3))}, _REMEDY)
    try:
        done = settled(
            points[:, face], points[:, jig], held["jig"], held["rest"], rate, tuple(names)
        )
    except DnnvssError as error:
        raise DnnvssError(error.problem, utterance=name, remedy=error.remedy) from error
    files.write_arrays(out / FOLDER / _SETTLED / f"{name}.npz", points=done.points)
    return done.told


def make_whole(
    name: str, out: Path, path: Path, usual: Path, common: Path, rate: float, names: list[str]
) -> dict[str, Any]:
    """What was filled of a take, after writing it whole, the jig behind its markers.

    Raises:
        DnnvssError: half of its markers are missing in most frames.
    """
    points = read_arrays(path, _REMEDY)["points"]
    held = read_declared(
        usual, {"mean": Held(("C",)), "modes": Held(("K", "C")), "own": Held(("C",))}, _REMEDY
    )
    seen = np.isfinite(points).all(axis=2)
    valid = seen.mean(axis=1) >= 1 - _NEVER
    if valid.mean() < 1 - _NEVER:
        raise DnnvssError(
            f"half of the markers are missing in {(~valid).sum()} of {len(valid)} frames",
            utterance=name,
            remedy="Leave the take out",
        )
    done = whole(points, Usual(held["mean"], held["modes"], held["own"]), rate, tuple(names))
    jig = read_declared(common, {"jig": Held(("J", 3)), "rest": Held(("M", 3))}, _REMEDY)["jig"]
    every = np.concatenate(
        [done.points, np.broadcast_to(jig, (len(done.points), *jig.shape))], axis=1
    )
    write_npz(out / FOLDER / _WHOLE / f"{name}.npz", Landmarks(every.astype(np.float32), valid))
    return {**done.told, "absent": [n for n, s in zip(names, seen.T, strict=True) if not s.any()]}


def summed(told: Mapping[str, Any]) -> str:
    """A take's repairs in a sentence."""
    pairs = {tuple(sorted(pair[:2])) for pair in told["swaps"]}
    longest = max((end - first for _, first, end in told["gaps"]), default=0)
    parts = [
        f"head motion of {told['head_degrees']:g} degrees and {told['head_mm']:g} mm taken out",
        f"{len(told['gaps'])} gaps filled ({told['missing']:.1%}, the longest {longest} frames)",
    ]
    if pairs:
        parts.append(
            "names of " + ", ".join(f"{a} and {b}" for a, b in sorted(pairs)) + " set right"
        )
    if told["flickers"]:
        parts.append(f"{len(told['flickers'])} samples thrown out")
    if told["absent"]:
        parts.append(
            f"{', '.join(told['absent'])} missing throughout: what the others tell of them stands there"
        )
    return "; ".join(parts) + f" ({REPAIRS}/ holds each stretch)"


def _sampled(path: Path, count: int) -> np.ndarray:
    points = read_arrays(path, _REMEDY)["points"].astype(float)
    return points[:: max(1, -(-len(points) // count))]


def _stilled(samples: Iterable[np.ndarray], groups: MarkerGroups, jig: np.ndarray) -> np.ndarray:
    """Frames (n, M, 3) of the face in the frame of the jig, where all of it is seen."""
    found = []
    for sample in samples:
        own = sample[:, list(groups.jig)]
        seen = np.isfinite(own).all(axis=(1, 2))
        if seen.any():
            pose = fit_similarity(own[seen], jig, rigid=True)
            found.append(pose.back(sample[seen][:, list(groups.face)], np.zeros(3)))
    return np.concatenate(found)


def _kept(path: Path, **arrays: np.ndarray) -> Path:
    """A file with these arrays; left as it is where it holds them, so that what depends on it stays."""
    if path.is_file():
        old = read_arrays(path, _REMEDY)
        if old.keys() == arrays.keys() and all(
            np.array_equal(old[n], a) for n, a in arrays.items()
        ):
            return path
    return files.write_arrays(path, **arrays)

"""Sound and picture in step: how late each clip's sound is beside its picture, told by the clip itself.

Recordings that were cut or transcoded clip by clip can differ by some frames in where the sound begins. A regression
learns to hear the lips (:mod:`data_prep.heard_lips`), cross-fitted, so that no clip is judged by one that has seen it.
The lag at which heard and seen lips agree best is how late the sound is. Words, phones and models play no part in it.
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from data_prep.heard_lips import EVERY, MANY, MODES, SyncClip, crossfitted
from data_prep.media import laid
from data_prep.stages import FOLDER, Workshop, fingerprint
from dnnvss import files, robust
from dnnvss.errors import DnnvssError
from dnnvss.face.pose import fit_pose, mean_shape, to_reference
from dnnvss.media import SPEECH_RATE, read_audio, write_wav
from dnnvss.progress import counted
from dnnvss.records import read_record
from dnnvss.settings import setting
from dnnvss.speech.align_features import HOP, cepstra

REACH = 0.16
"""Seconds; sound that is further off is not looked for."""

FEWEST = 6
"""Clips below which no share of a deviation is told."""

_LAGS = np.arange(-REACH, REACH + 1e-9, HOP)
_APART = 0.08
"""Seconds by which the two halves of a clip may differ; beyond, neither is believed."""
_VERSION = 2


@dataclass(frozen=True)
class Sync:
    """How far sound and picture of a corpus are apart.

    Args:
        late: utterance to the seconds by which its sound is late beside its picture and the usual clip's; an estimate
            shrunk by how much the halves of clips disagree.
        unknown: utterances whose sound and lips do not tell; their ``late`` is 0.
        spread, error: standard deviation in seconds of the true shifts over the clips, and of the estimates' error.
    """

    late: Mapping[str, float] = setting(least=-2 * REACH, most=2 * REACH)
    unknown: tuple[str, ...] = setting()
    spread: float = setting()
    error: float = setting()


def kept_sync(path: Path) -> Sync:
    """What :func:`find_sync` kept in a file.

    Raises:
        DnnvssError: it is absent or damaged.
    """
    return read_record(Sync, path, "Prepare the corpus again")


def find_sync(shop: Workshop, sounds: Mapping[str, str], seen: Mapping[str, tuple[np.ndarray, np.ndarray]],
              groups: Mapping[str, tuple[int, int]], rate: float) -> Sync:
    """Return how late each clip's sound is; kept from an earlier run where nothing changed.

    Args:
        shop: where to work.
        sounds: utterance to its sound, relative to the prepared corpus.
        seen: utterance to its landmarks (F, P, 2) and which frames (F,) to trust.
        groups: landmark group to its rows; lips are those of the groups named ``lips...``, and head pose is measured on
            the groups named after eyes and nose.
        rate: frames a second of the video.

    Raises:
        DnnvssError: no group of lips, eyes or nose.
    """
    shapes = [(n, hashlib.sha256(p.tobytes()).hexdigest(), v.tolist()) for n, (p, v) in sorted(seen.items())]
    key = fingerprint(_VERSION, [(n, shop.out / s) for n, s in sorted(sounds.items())], shapes, groups, rate)
    path = shop.out / FOLDER / "sync" / f"{key}.json"
    with suppress(DnnvssError):  # absent or damaged: it is measured anew
        if set((kept := kept_sync(path)).late) == set(seen):
            return kept
    clips = read_clips(shop, sounds, seen, groups, rate)
    halves = lags(clips, crossfitted(clips))
    found = shrunk(list(clips), *halves)
    files.write_json(path, found.__dict__)
    return found


def shrunk(names: Sequence[str], whole: np.ndarray, first: np.ndarray, second: np.ndarray) -> Sync:
    """Return what the lags (N,) of whole clips and of their halves tell, in seconds; positive where sound is late.

    Halves err independently, so half the variance of their difference is one half's error, and half of that the whole
    clip's. An estimate is multiplied by the share of the variance that is not error; medians stand for deviations, so
    that a few wild clips do not count. Of fewer than :data:`MANY` clips medians say little: deviations are taken, and
    nothing is moved unless the spread is larger than the error.
    """
    few = len(whole) < MANY
    told = (np.abs(first - second) < _APART) & (np.abs(whole) < REACH - HOP)
    middle = float(np.median(whole[told])) if told.any() else 0.0
    error = _deviation((first - second)[told], few) / 2
    total = _deviation(whole[told], few)
    spread = float(np.sqrt(max(total**2 - error**2, 0.0)))
    share = 0.0 if few and spread <= error else spread**2 / max(total**2, 1e-12)
    late = np.where(told, share * (whole - middle), 0.0)
    return Sync({n: round(float(v), 4) for n, v in zip(names, late, strict=True)},
                tuple(n for n, ok in zip(names, told, strict=True) if not ok), round(spread, 5), round(error, 5))


def _deviation(x: np.ndarray, few: bool) -> float:
    if not len(x):
        return 0.0
    return float(x.std() if few else robust.deviation(x))


def _rows(groups: Mapping[str, tuple[int, int]], *names: str) -> np.ndarray:
    rows = [np.arange(a, b) for group, (a, b) in groups.items() if any(n in group for n in names)]
    if not rows:
        raise DnnvssError(f"no group of landmarks is named after {' or '.join(names)}: {sorted(groups)}",
                          remedy="Name them in landmarks.json, or switch the search off: corpus.importer.sync=false")
    return np.concatenate(rows)


def read_clips(shop: Workshop, sounds: Mapping[str, str], seen: Mapping[str, tuple[np.ndarray, np.ndarray]],
               groups: Mapping[str, tuple[int, int]], rate: float) -> dict[str, SyncClip]:
    """Return each utterance heard and seen; the arguments are those of :func:`find_sync`."""
    lips, still = _rows(groups, "lip", "mouth"), _rows(groups, "eye", "nose")
    face = mean_shape(np.concatenate([points[valid][::10] for points, valid in seen.values()]).astype(float))
    shapes = {}
    for name, (points, _) in seen.items():
        pose = fit_pose(points[:, still].astype(float), face[still])
        shape = to_reference(points[:, lips].astype(float), pose, face[still].mean(axis=0)).reshape(len(points), -1)
        shapes[name] = shape - shape.mean(axis=0)
    _, size, modes = np.linalg.svd(np.concatenate([s[::3] for s in shapes.values()]), full_matrices=False)
    rows = sum(len(s[::3]) for s in shapes.values())
    basis = (modes[:MODES] / (size[:MODES, None] / np.sqrt(rows) + 1e-9)).T
    clips = {}
    for name in counted(sounds, "cepstra", unit="clips"):
        sound = cepstra(read_audio(files.inside(shop.out, sounds[name])))
        clips[name] = SyncClip(sound, _at(shapes[name] @ basis, rate), _spoken(sound))
    return clips


def _at(values: np.ndarray, rate: float) -> Callable[[np.ndarray], np.ndarray]:
    """Return seconds to values (n, K) of frames (F, K), held at the ends."""
    from scipy.interpolate import CubicSpline  # slow to import, and needed by this alone

    times = (np.arange(len(values)) + 0.5) / rate
    if len(values) < 2:
        return lambda t: np.repeat(values, len(t), axis=0)
    spline = CubicSpline(times, values)
    return lambda t: np.asarray(spline(np.clip(t, times[0], times[-1])))


def _spoken(sound: np.ndarray) -> np.ndarray:
    loud = sound[::EVERY, 0]
    at = np.flatnonzero(loud > np.percentile(loud, 60))
    if not len(at):
        return np.ones(len(loud), bool)
    mask = np.zeros(len(loud), bool)
    mask[max(0, at[0] - 20) : at[-1] + 20] = True
    return mask


def lags(clips: Mapping[str, SyncClip], heard: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return by how many seconds sound is late in whole clips, first halves and second halves, each (N,)."""
    found = []
    for name, clip in clips.items():
        seen = np.stack([clip.lips(clip.times - lag) for lag in _LAGS])
        frames = np.flatnonzero(clip.spoken)
        middle = len(frames) // 2
        found.append([_best(heard[name][part], seen[:, part]) for part in (frames, frames[:middle], frames[middle:])])
    whole, first, second = np.array(found).T
    return whole, first, second


def _best(heard: np.ndarray, seen: np.ndarray) -> float:
    """Return the lag in seconds at which what was heard (M, K) agrees best with what was seen at each lag (L, M, K)."""
    if len(heard) < 2:
        return 0.0
    h, s = heard - heard.mean(axis=0), seen - seen.mean(axis=1, keepdims=True)
    agreement = (h * s).sum(axis=(1, 2)) / np.sqrt((h**2).sum() * (s**2).sum(axis=(1, 2)) + 1e-12)
    k = int(agreement.argmax())
    best = float(_LAGS[k])
    if 0 < k < len(_LAGS) - 1:
        before, at, after = agreement[k - 1 : k + 2]
        best += HOP * 0.5 * float(before - after) / min(float(before - 2 * at + after), -1e-12)
    return best


def in_step(name: str, out: Path, sound: Path, late: float, seconds: float | None = None) -> dict[str, Any]:
    """Return the path of an utterance's sound in ``out/audio``, moved ``late`` seconds towards its start.

    Args:
        name: the utterance id.
        out: the prepared corpus.
        sound: the sound as the file has it.
        late: seconds by which it is late.
        seconds: how long it is to be; as long as it is where None.
    """
    samples = read_audio(sound, SPEECH_RATE)
    count = len(samples) if seconds is None else round(seconds * SPEECH_RATE)
    path = write_wav(out / "audio" / f"{name}.wav", laid(samples, late, count), SPEECH_RATE)
    return {"audio": str(path.relative_to(out))}

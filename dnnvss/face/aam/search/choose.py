"""Which frames to label by hand: spread over what the mouth looks like, found without any landmark.

The mouth is where the picture moves. Its pixels, as a few principal components, say how much two frames differ; frames
that are farthest from each other are clustered, and the frame nearest to the middle of each cluster is chosen. Frames
in mid-blur and broken pictures are left out first.

**Source**: Theobald et al. 2003, section 2 and Cosker et al. 2004, section 3 label some thirty pictures that hold the
typical mouth shapes; how to pick them is ours (measured in ``docs/search.md``).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import joblib
import numpy as np

from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.face.pca import components
from dnnvss.media.reading import video_frames, video_info
from dnnvss.robust import robust_limit

_WIDTH = 120
"""Width in pixels of the sketch of a frame in which movement is looked for."""
_BLUR = 4.0
"""Standard deviation in sketch pixels of the blur that makes one hill of a moving mouth."""
_MOUTH = (28, 24)
"""Width and height to which the mouth's box is scaled before it is compared."""
_VARIANCE = 0.95
_OUTLIER = 6.0
"""Robust standard deviations beyond which a frame is taken for broken."""
_SHARP = 0.6
"""A frame whose mouth has less than this share of its video's median sharpness is taken for blurred."""
_SPREAD = 8
"""Far-apart frames gathered for each frame that is chosen."""


@dataclass(frozen=True)
class ChosenFrame:
    """A frame to label: its video, and its number from 0."""

    video: Path
    frame: int


@dataclass(frozen=True)
class _Sketch:
    """A video's frames (F, H, W_) grey at a small width, and the sharpness (F,) of their moving part."""

    frames: np.ndarray
    sharpness: np.ndarray
    centre: tuple[int, int]
    reach: int


def choose_frames(videos: Sequence[Path], count: int, seed: int = 0, most_videos: int = 120) -> list[ChosenFrame]:
    """Return the ``count`` frames to label, sorted by video and frame; the same seed gives the same frames.

    Args:
        videos: files of one talker, of any sizes.
        count: how many frames.
        seed: of the choice among many videos and of the clusters.
        most_videos: no more videos than this are looked through.

    Raises:
        DnnvssError: no video, none that can be used (one that cannot is named and left out), or fewer usable frames
            than are asked for.
    """
    if count < 1:
        raise DnnvssError(f"{count} frames are to be chosen", remedy="Ask for about 30")
    if not videos:
        raise DnnvssError("no video to choose frames from", remedy="Give a folder of videos")
    random = np.random.default_rng(seed)
    drawn = sorted(random.permutation(len(videos))[:most_videos])
    found = joblib.Parallel()(joblib.delayed(_sketch_or_error)(videos[i]) for i in drawn)
    errors = [e for e in found if isinstance(e, DnnvssError)]
    if len(errors) == len(found):
        raise errors[0]
    for error in errors:
        print(f"left out: {error}")
    looked = [i for i, s in zip(drawn, found, strict=True) if isinstance(s, _Sketch)]
    sketches = [s for s in found if isinstance(s, _Sketch)]
    owner = np.concatenate([np.full(len(s.frames), i) for i, s in zip(looked, sketches, strict=True)])
    frame = np.concatenate([np.arange(len(s.frames)) for s in sketches])
    features, usable = _compare(sketches)
    if usable.sum() < count:
        raise DnnvssError(f"{int(usable.sum())} frames are usable and {count} are to be chosen",
                          remedy="Give more video, or ask for fewer frames")
    rows = np.flatnonzero(usable)
    chosen = rows[spread_out(features[rows], count, seed)]
    return sorted((ChosenFrame(Path(videos[owner[i]]), int(frame[i])) for i in chosen),
                  key=lambda c: (str(c.video), c.frame))


def spread_out(features: np.ndarray, count: int, seed: int = 0) -> np.ndarray:
    """Return ``count`` rows (count,) of features (F, K) that stand for all of them, each kind about equally.

    Rows farthest from each other are gathered first, so that what is frequent (a closed mouth at rest) has no more
    weight than what is rare; their k-means clusters are each represented by the nearest row.
    """
    from sklearn.cluster import KMeans  # slow to import, and tracking needs none of it

    gathered = farthest(features, min(len(features), _SPREAD * count))
    if len(gathered) <= count:
        return np.sort(gathered)
    fitted = KMeans(count, n_init=4, random_state=seed).fit(features[gathered])
    distance = fitted.transform(features[gathered])
    chosen: list[int] = []
    for k in range(count):
        free = next(int(i) for i in np.argsort(distance[:, k], kind="stable") if int(gathered[i]) not in chosen)
        chosen.append(int(gathered[free]))
    return np.sort(chosen)


def farthest(features: np.ndarray, count: int) -> np.ndarray:
    """Return rows (count,), from the one nearest to the mean on, each the farthest from all before it."""
    first = int(((features - features.mean(axis=0)) ** 2).sum(axis=1).argmin())
    rows, gap = [first], ((features - features[first]) ** 2).sum(axis=1)
    while len(rows) < count:
        rows.append(int(gap.argmax()))
        gap = np.minimum(gap, ((features - features[rows[-1]]) ** 2).sum(axis=1))
    return np.array(rows)


def _sketch_or_error(path: Path) -> _Sketch | DnnvssError:
    try:
        return _sketch(path)
    except ShortageError:
        raise  # it says nothing about the video
    except DnnvssError as error:
        return error


def _sketch(path: Path) -> _Sketch:
    width, height = video_info(path).size
    small = (_WIDTH, max(round(_WIDTH * height / width), 8))
    frames = np.stack(list(video_frames(path, small, grey=True)))
    if len(frames) < 3:
        raise DnnvssError(f"holds {len(frames)} frames", file=path, remedy="Give videos of a second or more")
    moved = np.abs(np.diff(frames.astype(np.int16), axis=0)).astype(np.float32)
    energy = cv2.GaussianBlur(np.median(moved, axis=0) + 0.1 * moved.mean(axis=0), (0, 0), _BLUR)
    energy -= np.median(energy)
    y, x = np.unravel_index(int(energy.argmax()), energy.shape)
    if energy[y, x] <= 0:
        raise DnnvssError("nothing moves in it", file=path, remedy="Leave the video out")
    reach = int(np.sqrt((energy > 0.25 * energy[y, x]).sum() / np.pi) + 1)
    sharp = [float(cv2.Laplacian(_box(f, (int(x), int(y)), reach), cv2.CV_32F).var()) for f in frames]
    return _Sketch(frames, np.array(sharp), (int(x), int(y)), reach)


def _box(frame: np.ndarray, centre: tuple[int, int], reach: int) -> np.ndarray:
    """Return the square of ``reach`` pixels about a point, the border repeated beyond the frame."""
    padded = cv2.copyMakeBorder(frame, reach, reach, reach, reach, cv2.BORDER_REPLICATE)
    x, y = centre
    return padded[y:y + 2 * reach + 1, x:x + 2 * reach + 1]


def _compare(sketches: Sequence[_Sketch]) -> tuple[np.ndarray, np.ndarray]:
    """Return features (F, K) of the mouths of all frames, and which frames (F,) are usable."""
    reach = round(float(np.median([s.reach for s in sketches])))
    mouths = [np.stack([cv2.resize(_box(f, s.centre, reach), _MOUTH, interpolation=cv2.INTER_AREA)
                        for f in s.frames]).reshape(len(s.frames), -1).astype(np.float32) for s in sketches]
    rows = np.concatenate(mouths)
    rows = (rows - rows.mean(axis=1, keepdims=True)) / (rows.std(axis=1, keepdims=True) + 1.0)
    usable = np.concatenate([_unbroken(s) for s in sketches])
    centred = rows - rows[usable].mean(axis=0)
    found = components(centred[usable], _VARIANCE)
    features = centred @ found.modes.T
    left = np.linalg.norm(centred - features @ found.modes, axis=1)
    usable &= left <= robust_limit(left[usable], _OUTLIER)
    size = np.sqrt(((features / found.deviations) ** 2).mean(axis=1))
    return features, usable & (size <= robust_limit(size[usable], _OUTLIER))


def _unbroken(sketch: _Sketch) -> np.ndarray:
    """Return which frames (F,) are sharp and neither side of a jump: a cut, or the end of a broken group of pictures.

    What comes before a jump in the first second of a video is left out as a whole: broken pictures stand there.
    """
    moved = np.abs(np.diff(sketch.frames.astype(np.int16), axis=0)).mean(axis=(1, 2))
    jumps = np.flatnonzero(moved > robust_limit(moved, 2 * _OUTLIER, 1.0))
    keep = sketch.sharpness >= _SHARP * np.median(sketch.sharpness)
    for jump in jumps:
        keep[max(jump - 1, 0):jump + 3] = False
        if jump < 25:
            keep[:jump + 1] = False
    return keep

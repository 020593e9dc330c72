"""How well thirty labelled frames find the points of all others, beside menpofit on the same frames and starts.

    OMP_NUM_THREADS=1 python benchmarks/aam_search.py --raw GRID [--split test] [--peer /tmp/menpo/bin/python]

The frames to label are chosen by the package from training clips; their points are the corpus's own landmarks, taken as
hand labels (34 points of lips, jaw and nostrils). Every frame of the split's clips is then tracked from nothing. Prints
the mean distance of the twenty lip points from the corpus's landmarks (which jitter by 0.13 pixel a coordinate
themselves), frames by flag, fits a second of processor time, success from starts 8 pixels off, and how near the search
comes to points that are known exactly. ``--peer`` is a Python with menpofit 0.7.1 (numpy below 2, scipy below 1.14).
"""

import argparse
import json
import os
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from dnnvss import files
from dnnvss.face.aam import PointSet, Warp
from dnnvss.face.aam.search import track
from dnnvss.face.aam.search.choose import choose_frames
from dnnvss.face.aam.search.find import detect, search
from dnnvss.face.aam.search.fit import fit_search
from dnnvss.face.aam.search.model import SearchModel, SearchSettings
from dnnvss.media import read_video

LIPS = slice(0, 20)
OFF, NEAR = 8.0, 1.0
SMOOTH = 2.0
TRIALS = 200
VARIANTS = {
    "default": SearchSettings(), "project-out at both scales": SearchSettings(project_out=True),
    "rgb": SearchSettings(colour="rgb"),
    "scales .7": SearchSettings(scales=(0.7,)), "scales .35 .7": SearchSettings(scales=(0.35, 0.7)),
    "scales .25 .5 1": SearchSettings(scales=(0.25, 0.5, 1.0)), "shape .98": SearchSettings(shape_variance=0.98),
    "appearance .90": SearchSettings(appearance_variance=0.9),
    "appearance .98": SearchSettings(appearance_variance=0.98),
    "prior 10": SearchSettings(shape_prior=10), "prior 160": SearchSettings(shape_prior=160),
}
PEER = Path(__file__).with_name("aam_search_peer.py")


@dataclass(frozen=True)
class Talk:
    """A clip: pictures (F, H, W_, 3), landmarks (F, 34, 2) and which of them are valid (F,)."""

    id: str
    images: np.ndarray
    points: np.ndarray
    valid: np.ndarray


def landmarks(raw: Path, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the 34 modelled points (F, 34, 2) of a clip in pixels, and valid (F,)."""
    marks = json.loads((raw / "landmarks.json").read_text())
    with np.load(raw / "landmarks" / f"{name}.npz") as file:
        return file["points"][:, PointSet().layout(marks["groups"]).rows] / marks["scale"], file["valid"]


def labels(raw: Path, count: int, seed: int) -> tuple[list[np.ndarray], np.ndarray]:
    """Return the chosen training pictures and their points (count, 34, 2)."""
    ids = (raw / "splits" / "train.txt").read_text().split()
    chosen = choose_frames([raw / "video" / f"{i}.mp4" for i in ids], count, seed)
    images = [read_video(c.video)[c.frame] for c in chosen]
    return images, np.stack([landmarks(raw, c.video.stem)[0][c.frame] for c in chosen])


def lip_error(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Return the mean distance (...,) of the lip points (..., 34, 2) in pixels."""
    return np.linalg.norm(found - true, axis=-1)[..., LIPS].mean(axis=-1)


def tracked(model: SearchModel, talks: list[Talk]) -> None:
    """Print what tracking from nothing gives."""
    errors, flags, silent, judged = dict[str, float](), dict[str, int](), 0, 0
    for talk in talks:
        found = track(model, list(talk.images))
        error = lip_error(found.points, talk.points)
        both = found.valid & talk.valid
        errors[talk.id] = float(error[both].mean())
        silent += int((error[both] > 3).sum())
        flags = {k: flags.get(k, 0) + v for k, v in found.counts().items()}
        judged += int(both.sum())
    worst = sorted(errors, key=lambda i: -errors[i])[:3]
    print(f"tracking from nothing: lips {np.mean(list(errors.values())):.3f} pixel, mean of {len(talks)} clips; worst "
          + ", ".join(f"{i} {errors[i]:.2f}" for i in worst))
    print("frames: " + ", ".join(f"{v} {k}" for k, v in flags.items())
          + f"; of {judged} that the corpus has too, more than 3 pixels from its landmarks: {silent}")


def followed(model: SearchModel, talks: list[Talk]) -> tuple[float, float, float]:
    """Return the mean lip error, fits a second of processor time, and the worst clip's error, each frame from the last.

    The first frame of a clip starts from its own landmarks.
    """
    errors, seconds, count = [], 0.0, 0
    for talk in talks:
        last = talk.points[first(talk)]
        found = []
        start = time.process_time()
        for image in talk.images[first(talk):]:
            last = search(model, image, last).points
            found.append(last)
        seconds += time.process_time() - start
        count += len(found)
        valid = talk.valid[first(talk):]
        errors.append(lip_error(np.stack(found), talk.points[first(talk):])[valid].mean())
    return float(np.mean(errors)), count / seconds, float(np.max(errors))


def first(talk: Talk) -> int:
    """Return the frame from which a clip is followed: past the broken pictures that some begin with."""
    return 13 if len(talk.valid) > 13 and talk.valid[13] else int(np.flatnonzero(talk.valid)[0])


def starts(talks: list[Talk], mean: np.ndarray) -> list[tuple[int, int, np.ndarray]]:
    """Return clip, frame and start (34, 2): the mean shape in the true place, ``OFF`` pixels off in some direction."""
    random = np.random.default_rng(0)
    several = []
    for number, talk in enumerate(talks):
        for frame in range(15, len(talk.images), 15):
            turn = random.uniform(0, 2 * np.pi)
            place = talk.points[frame].mean(axis=0) + OFF * np.array([np.cos(turn), np.sin(turn)])
            if talk.valid[frame]:
                several.append((number, frame, mean + place))
    return several


def recovery(images: list[np.ndarray], points: np.ndarray, variance: float) -> np.ndarray:
    """Return the mean distance (TRIALS,) in pixels between true and found points of pictures made by the model.

    Each picture is a random mixture of the model's textures of two labelled frames on a mixture of their shapes, in the
    middle of a picture. The start is off by a tenth: moved by a tenth of the face's size in a random direction, a tenth
    larger or smaller, its shape parameters by a tenth of three standard deviations either way. The model is one of
    pictures blurred by ``SMOOTH`` pixels: what a pixel cannot show, drawing would lose, and the drawn picture would no
    longer be the model's.

    Args:
        images, points: the labelled frames.
        variance: share of the shapes' variance that the model explains.
    """
    random = np.random.default_rng(1)
    images = [cv2.GaussianBlur(image, (0, 0), SMOOTH) for image in images]
    model = fit_search(images, points, SearchSettings(shape_variance=variance, tolerance=0.02, iterations=30))
    shapes = np.stack([model.shapes.project(p.T.astype(np.float32))[1] for p in points])
    codes = np.stack([code(model, i, p) for i, p in zip(images, points, strict=True)])
    distances = []
    for _ in range(TRIALS):
        (one, other), share = random.choice(len(images), 2, replace=False), random.uniform()
        own = share * shapes[one] + (1 - share) * shapes[other]
        place = points[one].mean(axis=0)
        true = model.shapes.mean + np.tensordot(own, model.shapes.modes, axes=1) + place
        picture = drawn(model, images[one].shape[:2], true, share * codes[one] + (1 - share) * codes[other])
        off = own + 0.3 * model.shapes.deviations * random.choice([-1, 1], len(own))
        turn = random.uniform(0, 2 * np.pi)
        start = (model.shapes.mean + np.tensordot(off, model.shapes.modes, axes=1)) * random.choice([0.9, 1.1])
        start = start + place + 0.1 * model.size * np.array([np.cos(turn), np.sin(turn)])
        found = search(model, picture, start, wide=True)
        distances.append(np.linalg.norm(found.points - true, axis=1).mean())
    return np.array(distances)


def code(model: SearchModel, image: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the coefficients (m,) of a grey picture's texture at the finest level under points (P, 2)."""
    level = model.levels[-1]
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY).astype(np.float32)
    return level.explain(level.sample(grey, points.T.astype(np.float32)))[0]


def drawn(model: SearchModel, size: tuple[int, int], points: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """Return a picture of some height and width with a texture of the model drawn under points (P, 2)."""
    level = model.levels[-1]
    texture = (coefficients.astype(np.float32) @ level.appearance)[:, None]
    canvas = filled(level.warp.picture(texture, np.nan))
    there = Warp(points, model.shapes.triangles)
    own = np.full((there.size[0] * there.size[1], 3), np.nan, np.float32)
    own[there.pixels] = there.sample(canvas, (model.shapes.mean - level.warp.origin) * level.scale)
    result = np.full((*size, 3), np.nan, np.float32)
    x, y = there.origin.astype(int)
    result[y:y + there.size[0], x:x + there.size[1]] = own.reshape(*there.size, 3)
    return np.clip(filled(result), 0, 255).round().astype(np.uint8)


def filled(canvas: np.ndarray) -> np.ndarray:
    """Return a picture (H, W_, C) whose unknown pixels are those of their nearest neighbour that is known."""
    unknown = np.isnan(canvas[..., 0]).astype(np.uint8)
    _, nearest = cv2.distanceTransformWithLabels(unknown, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    colours = np.zeros((nearest.max() + 1, canvas.shape[2]), np.float32)
    colours[nearest[unknown == 0]] = canvas[unknown == 0]
    return colours[nearest]


def peer(python: Path, images: list[np.ndarray], points: np.ndarray, talks: list[Talk],
         several: list[tuple[int, int, np.ndarray]]) -> None:
    """Run menpofit on the same frames and starts in its own environment; it prints its rows."""
    with tempfile.TemporaryDirectory() as folder:
        arrays = {"labels": points, "count": np.array(len(talks)), "off": np.array([NEAR])}
        arrays |= {f"label{i}": image for i, image in enumerate(images)}
        for i, talk in enumerate(talks):
            arrays |= {f"images{i}": talk.images[first(talk):], f"points{i}": talk.points[first(talk):],
                       f"valid{i}": talk.valid[first(talk):]}
        arrays["clips"], arrays["frames"] = (np.array([s[k] for s in several]) for k in (0, 1))
        arrays["frames"] = arrays["frames"] - np.array([first(talks[s[0]]) for s in several])
        arrays["starts"] = np.stack([s[2] for s in several])
        files.write_arrays(Path(folder) / "work.npz", **arrays)
        subprocess.run([str(python), str(PEER), str(Path(folder) / "work.npz")], check=True,
                       env={**os.environ, "PYTHONWARNINGS": "ignore"})


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--raw", type=Path, required=True, help="folder of the GRID data")
    parser.add_argument("--split", default="test", help="test, val or train")
    parser.add_argument("--clips", type=int, default=50, help="clips of the split")
    parser.add_argument("--labels", type=int, default=30, help="labelled frames")
    parser.add_argument("--seed", type=int, default=0, help="of the choice of frames")
    parser.add_argument("--peer", type=Path, help="a Python with menpofit 0.7.1; left out where not given")
    parser.add_argument("--vary", action="store_true", help="compare settings instead")
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    images, points = labels(arguments.raw, arguments.labels, arguments.seed)
    ids = (arguments.raw / "splits" / f"{arguments.split}.txt").read_text().split()[:arguments.clips]
    talks = [Talk(i, read_video(arguments.raw / "video" / f"{i}.mp4"), *landmarks(arguments.raw, i)) for i in ids]
    begun = time.process_time()
    model = fit_search(images, points)
    print(f"{len(points)} labelled frames, {points.shape[1]} points, {len(model.shapes.modes)} shape modes, "
          f"{[len(level.appearance) for level in model.levels]} appearance, {time.process_time() - begun:.1f} s to fit")
    if arguments.vary:
        for name, settings in VARIANTS.items():
            error, rate, _ = followed(fit_search(images, points, settings), talks)
            print(f"{name}: lips {error:.3f}, {rate:.0f} fits a second", flush=True)
        return
    tracked(model, talks)
    several = starts(talks, model.shapes.mean)
    for name, settings in {"default": SearchSettings(), "rgb": SearchSettings(colour="rgb"),
                           "project-out at both scales": SearchSettings(project_out=True)}.items():
        own = model if name == "default" else fit_search(images, points, settings)
        error, rate, worst = followed(own, talks)
        good = [lip_error(search(own, talks[c].images[f], s, wide=w).points, talks[c].points[f]) < NEAR
                for w in (False, True) for c, f, s in several]
        half = len(several)
        print(f"ours, {name}: lips {error:.3f} (worst clip {worst:.2f}), {rate:.0f} fits a second; from {OFF:.0f} "
              f"pixels off {100 * np.mean(good[:half]):.0f} % of {half}, with the mean picture first "
              f"{100 * np.mean(good[half:]):.0f} %", flush=True)
    faces = [lip_error(detect(model, talks[c].images[f])[0].points, talks[c].points[f]) < NEAR for c, f, _ in several]
    print(f"detection in the whole picture: {100 * np.mean(faces):.0f} % of {len(faces)}")
    for variance in (0.95, SearchSettings.shape_variance):
        distances = recovery(images, points, variance)
        print(f"synthetic recovery from a tenth off, {100 * variance:.1f} % of shape variance: "
              f"{100 * np.mean(distances < 0.1):.1f} % of {TRIALS} under 0.1 pixel, median {np.median(distances):.3f}, "
              f"worst {distances.max():.3f}", flush=True)
    if arguments.peer:
        peer(arguments.peer, images, points, talks, several)


if __name__ == "__main__":
    main()

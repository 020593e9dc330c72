"""menpofit 0.7.1 on the frames and starts that ``benchmarks/aam_search.py`` hands over; runs in its own environment."""

import sys
import time

import numpy as np
from menpo.image import Image
from menpo.shape import PointCloud
from menpofit.aam import (
    HolisticAAM,
    LucasKanadeAAMFitter,
    ProjectOutInverseCompositional,
    SimultaneousInverseCompositional,
)

LIPS = slice(0, 20)
MARGIN = 30
SYSTEMS = {
    "simultaneous, one scale": (SimultaneousInverseCompositional, (1.0,), [20]),
    "simultaneous, two scales": (SimultaneousInverseCompositional, (0.5, 1.0), [10, 10]),
    "project-out, one scale": (ProjectOutInverseCompositional, (1.0,), [20]),
}


def picture(rgb: np.ndarray, points: np.ndarray) -> tuple[Image, np.ndarray]:
    """Return the grey picture round points (P, 2), 0 to 1, and the corner (2,) that it is cut at."""
    low = np.maximum(np.floor(points.min(axis=0)).astype(int) - MARGIN, 0)
    high = np.ceil(points.max(axis=0)).astype(int) + MARGIN
    part = rgb[low[1]:high[1], low[0]:high[0]] @ np.array([0.299, 0.587, 0.114])
    return Image(part / 255), low


def cloud(points: np.ndarray) -> PointCloud:
    """Return points (x, y) whose origin is a pixel's corner as menpo's (y, x), whose origin is its centre."""
    return PointCloud(points[:, ::-1] - 0.5)


def fit(fitter: LucasKanadeAAMFitter, image: Image, start: np.ndarray, iterations: list[int]) -> np.ndarray:
    """Return the points (P, 2) that a fit ends with."""
    return fitter.fit_from_shape(image, cloud(start), max_iters=iterations).final_shape.points[:, ::-1] + 0.5


def model(work: dict, scales: tuple[float, ...]) -> HolisticAAM:
    """Return the peer's model of the labelled frames."""
    images = []
    for i, points in enumerate(work["labels"]):
        image, low = picture(work[f"label{i}"], points)
        image.landmarks["points"] = cloud(points - low)
        images.append(image)
    return HolisticAAM(images, group="points", diagonal=None, scales=scales, max_shape_components=0.995,
                       max_appearance_components=0.95, verbose=False)


def main() -> None:
    """Print a row for each system."""
    work = dict(np.load(sys.argv[1]))
    near = float(work["off"][0])
    for name, (algorithm, scales, iterations) in SYSTEMS.items():
        fitter = LucasKanadeAAMFitter(model(work, scales), lk_algorithm_cls=algorithm, n_shape=0.995,
                                      n_appearance=0.95)
        errors, seconds, count = [], 0.0, 0
        for clip in range(int(work["count"])):
            images, points, valid = (work[f"{part}{clip}"] for part in ("images", "points", "valid"))
            last, own = points[0], []
            for frame, rgb in enumerate(images):
                image, low = picture(rgb, points[frame])
                begun = time.process_time()
                last = fit(fitter, image, last - low, iterations) + low
                seconds += time.process_time() - begun
                own.append(np.linalg.norm(last - points[frame], axis=1)[LIPS].mean())
                count += 1
            errors.append(np.mean(np.array(own)[valid]))
        good = []
        for clip, frame, start in zip(work["clips"], work["frames"], work["starts"], strict=True):
            true = work[f"points{clip}"][frame]
            image, low = picture(work[f"images{clip}"][frame], true)
            found = fit(fitter, image, start - low, iterations) + low
            good.append(np.linalg.norm(found - true, axis=1)[LIPS].mean() < near)
        lost = int((np.array(errors) > 3).sum())
        print(f"menpofit, {name}: lips {np.mean(errors):.3f} (worst clip {np.max(errors):.2f}, median clip "
              f"{np.median(errors):.3f}, {lost} lost), {count / seconds:.0f} fits a second; from 8 pixels off "
              f"{100 * np.mean(good):.0f} %", flush=True)


if __name__ == "__main__":
    main()

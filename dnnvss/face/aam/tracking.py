"""The points of every frame of a folder of videos, from about thirty labelled ones.

Beside each ``ID.mp4`` is written ``ID.npz`` with ``points`` (F, P, 2), ``valid`` (F,), ``error`` (F,) and ``flag``
(F,), and ``landmarks.json`` with the groups: what an importer of folders reads.
``tracking/`` holds the search models and the
report.
"""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import joblib
import numpy as np

from dnnvss import files
from dnnvss.archives import Held, read_arrays, read_declared
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.face.aam.labelling.sheet import Sheet
from dnnvss.face.aam.search import track
from dnnvss.face.aam.search.bootstrap import Frames, Labelled, gather, retrain
from dnnvss.face.aam.search.fit import fit_search
from dnnvss.face.aam.search.model import SearchModel, SearchSettings
from dnnvss.face.aam.search.track import FLAGS, Track
from dnnvss.media import video_frames
from dnnvss.media.folders import find_videos
from dnnvss.processes import parallel
from dnnvss.progress import counted

_MEMORY = 2**29
"""Bytes of pictures that a worker holds; longer videos are tracked in pieces."""
_LEARN_FROM = 40
"""Videos whose confident frames the model is trained on again."""


@dataclass(frozen=True)
class Job:
    """What is tracked: the videos below a folder, where points are written, and by how many processes."""

    root: Path
    videos: tuple[Path, ...]
    out: Path
    jobs: int

    def name(self, video: Path) -> str:
        """Return a video's id: its path below the folder, without suffix."""
        return video.relative_to(self.root).with_suffix("").as_posix()

    def target(self, video: Path) -> Path:
        """Return where a video's points are written."""
        return self.out / f"{self.name(video)}.npz"

    def kept(self, name: str) -> Path:
        """Return where something about the tracking is written."""
        return self.out / "tracking" / name


def track_folder(labels: Path, videos: Path, out: Path | None = None, *, own: int = 0, jobs: int = -1,
                 settings: SearchSettings | None = None) -> Path:
    """Write the points of every video and a report, and return the report's path.

    Args:
        labels: folder of finished labels.
        videos: folder of videos, or one video.
        out: where to write; beside the videos where None.
        own: train again on this many frames that the model found itself, and track all once more; 0 for not.
        jobs: processes; -1 for all cores.
        settings: of the search model; the defaults where None.

    Raises:
        DnnvssError: labels are missing or wrong, no video can be read (one that cannot is named and left out), two
            videos differ by their suffix alone, or points that this command did not write are in the way.
    """
    root = videos if videos.is_dir() else videos.parent
    job = Job(root, tuple(find_videos(videos)), out or root, jobs)
    sheet = Sheet.open(labels)
    _refuse_twins(job)
    _keep_foreign(job)
    points = sheet.finished()
    labelled = Labelled([sheet.picture(label) for label in sheet.labels], points)
    model = fit_search(labelled.images, labelled.points, settings)
    path = model.save(job.kept("search.npz"))
    again, source = job.kept("search_own.npz"), f"{own} of {_key(path)}"
    learnt = own > 0 and _learnt(again, source)
    if not learnt:
        _track_all(job, path, "tracking")
    if own and not learnt:
        several = np.random.default_rng(0).permutation(len(job.videos))[:_LEARN_FROM]
        found = gather(model, _tracked(job, [job.videos[i] for i in sorted(several)]), own)
        retrain(model, labelled, found).save(again, source=np.array(source))
    if own:
        path = again
        _track_all(job, path, "tracking again")
    marks = {"groups": {g: list(r) for g, r in sheet.groups.items()}, "scale": 1}
    files.write_json(job.out / "landmarks.json", marks)
    return _report(job, path)


def track_video(model: SearchModel, video: Path) -> Track:
    """Return the track of a video file, however long; it is read in pieces that fit into memory."""
    tracks: list[Track] = []
    for frames in _pieces(video):
        last = tracks[-1] if tracks else None
        known = last is not None and bool(last.valid[-1])
        tracks.append(track(model, frames, last.points[-1].astype(np.float64) if last is not None and known else None))
    return Track(*(np.concatenate([getattr(t, part) for t in tracks]) for part in ("points", "error", "flag")))


def _pieces(video: Path) -> Iterator[list[np.ndarray]]:
    piece: list[np.ndarray] = []
    for frame in video_frames(video):
        piece.append(frame)
        if len(piece) * frame.nbytes >= _MEMORY:
            yield piece
            piece = []
    if piece:
        yield piece


def _keep_foreign(job: Job) -> None:
    """Refuse to write over landmarks that another program made."""
    for video in job.videos:
        if (path := job.target(video)).is_file() and "flag" not in read_arrays(path):
            raise DnnvssError("holds landmarks that this command did not write", file=path,
                              remedy="Move it away, or write elsewhere with --out")


def _refuse_twins(job: Job) -> None:
    """Refuse two videos whose points would have one name."""
    names: dict[str, Path] = {}
    for video in job.videos:
        if (other := names.setdefault(job.name(video), video)) != video:
            raise DnnvssError(f"has the name of {other}, and the points of both would be {job.target(video)}",
                              file=video, remedy="Rename one of them, or move it away")


def _key(path: Path) -> str:
    """Return a short hash of what a file holds."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:16]


def _learnt(path: Path, source: str) -> bool:
    """Whether the model in a file was learnt from as many of its own frames, by the same first model."""
    remedy = "Delete it and run the command again"
    return path.is_file() and str(read_arrays(path, remedy).get("source")) == source


def _track_all(job: Job, path: Path, title: str) -> None:
    """Track every video, as it now is, that the model in a file has not tracked yet."""
    key = _key(path)
    left = [v for v in job.videos if not _done(job.target(v), key, v)]
    calls = [joblib.delayed(_track_one)(path, key, v, job.target(v)) for v in left]
    with (parallel(job.jobs),
          counted(desc=title, total=len(job.videos), initial=len(job.videos) - len(left), unit="videos") as bar):
        for error in joblib.Parallel(return_as="generator_unordered")(calls):
            bar.update(1)
            if error is not None:
                bar.write(f"left out: {error}")
    if not any(_done(job.target(v), key, v) for v in job.videos):
        raise DnnvssError("no video can be read (see above)", file=job.root, remedy="Convert them to MP4 (H.264)")


def _done(path: Path, key: str, video: Path) -> bool:
    if not path.is_file():
        return False
    arrays = read_arrays(path)
    return str(arrays.get("model")) == key and str(arrays.get("video")) == _key(video)


@lru_cache(maxsize=1)
def _opened(path: Path, key: str) -> SearchModel:  # the key keeps a worker from using an older model of the same path
    model = SearchModel.load(path)
    for level in model.levels:
        level.warm()
    return model


def _track_one(path: Path, key: str, video: Path, target: Path) -> DnnvssError | None:
    """Track one video; return what is wrong with it, if anything is: its older points are then gone too."""
    seen = _key(video)
    try:
        found = track_video(_opened(path, key), video)
    except ShortageError:
        raise  # it says nothing about the video
    except DnnvssError as error:
        files.remove(target)
        return error
    files.write_arrays(target, points=found.points, valid=found.valid, error=found.error, flag=found.flag,
                       model=np.array(key), video=np.array(seen))
    return None


def _read(path: Path) -> Track:
    arrays = read_declared(path, _ARRAYS, "Delete it and run the command again", more=True)
    if not set(arrays["flag"].tolist()) <= set(range(len(FLAGS))):
        raise DnnvssError(f"holds flags that are none of 0 to {len(FLAGS) - 1}", file=path,
                          remedy="Delete it and run the command again")
    return Track(arrays["points"], arrays["error"], arrays["flag"])


_ARRAYS = {"points": Held(("F", "P", 2), finite=False), "error": Held(("F",), finite=False), "flag": Held(("F",), "iu")}
"""What is kept of the track of a video."""


def _tracked(job: Job, videos: Sequence[Path]) -> list[tuple[Frames, Track]]:
    return [(partial(video_frames, video), _read(job.target(video))) for video in videos if job.target(video).is_file()]


def _report(job: Job, model: Path) -> Path:
    """Write ``report.json``: frames of each flag and the mean error of every video, those with most loss first."""
    limit = SearchModel.load(model).limits.error
    rows: list[dict[str, Any]] = []
    for video in job.videos:
        if not job.target(video).is_file():
            rows.append({"video": job.name(video), "frames": 0, "valid": 0, "error": None, **dict.fromkeys(FLAGS, 0)})
            continue
        found = _read(job.target(video))
        error = float(found.error[found.valid].mean()) if found.valid.any() else None
        rows.append({"video": job.name(video), "frames": len(found.flag), "valid": int(found.valid.sum()),
                     "error": error, **found.counts()})
    rows.sort(key=lambda r: (r["valid"] / max(r["frames"], 1), str(r["video"])))
    total = {name: sum(r[name] for r in rows) for name in ("frames", "valid", *FLAGS)}
    return files.write_json(job.kept("report.json"),
                            {"limit of the error": limit, "total": total, "videos": rows})


def summary(report: Path) -> str:
    """Return the report as a few lines: totals, and the videos with the most frames that are not valid."""
    value = files.read_json(report)
    total = value["total"]
    lines = [f"{total['valid']} of {total['frames']} frames of {len(value['videos'])} videos are tracked: "
             + ", ".join(f"{total[name]} {name}" for name in FLAGS)]
    lines += [f"  {row['video']}: cannot be read" for row in value["videos"] if not row["frames"]]
    for row in [r for r in value["videos"] if r["valid"] < r["frames"]][:5]:
        flags = ", ".join(f"{row[name]} {name}" for name in FLAGS[2:] if row[name])
        lines.append(f"  {row['video']}: {flags} of {row['frames']} frames")
    return "\n".join(lines)

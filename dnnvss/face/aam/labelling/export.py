"""Choosing the frames to label, and their starting guesses."""

import hashlib
from collections.abc import Sequence, Set
from dataclasses import replace
from pathlib import Path, PurePath

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.aam.labelling.guess import find_detector, moving_mouth, place
from dnnvss.face.aam.labelling.schemes import Scheme
from dnnvss.face.aam.labelling.sheet import NAME, Label, Sheet, new_sheet
from dnnvss.face.aam.search.choose import ChosenFrame, choose_frames
from dnnvss.formats.landmarks import write_pts
from dnnvss.media import video_frames
from dnnvss.media.folders import find_videos
from dnnvss.media.pictures import write_picture

_LOOKED_AT = 2**28
"""Bytes of a video's pictures, from its start, in which a moving mouth is looked for."""


def export(folder: Path, count: int, out: Path, scheme: Scheme, seed: int = 0) -> tuple[Sheet, dict[str, int]]:
    """Write pictures, guesses and ``labels.json`` of the frames to label; return the sheet and how guesses were placed.

    Labels that are there already are left as they are; frames are only added, to the sheet as it is on disk by then.

    Raises:
        DnnvssError: no video, too few frames, or a sheet of another scheme is there already.
    """
    root = folder if folder.is_dir() else folder.parent
    sheet = new_sheet(out, scheme, str(root.resolve()), ())
    if (out / NAME).is_file():
        there = Sheet.open(out)
        if there.groups != scheme.groups:
            raise DnnvssError(f"holds labels of the scheme {there.scheme!r}", file=out / NAME,
                              remedy="Choose another folder, or the same scheme")
        sheet = there
    placed: dict[str, int] = {}
    chosen = choose_frames(find_videos(folder), count, seed)
    for video in dict.fromkeys(choice.video for choice in chosen):
        sheet = _add(sheet, video, [c for c in chosen if c.video == video], scheme, root, placed)
    if (out / NAME).is_file():  # choosing takes a while, in which the page may have finished labels
        now = Sheet.open(out)
        labels = {label.image: label for label in (*sheet.labels, *now.labels)}
        sheet = replace(now, labels=tuple(labels[image] for image in sorted(labels)))
    return sheet.save(), placed


def _add(sheet: Sheet, video: Path, chosen: Sequence[ChosenFrame], scheme: Scheme, root: Path,
         placed: dict[str, int]) -> Sheet:
    """Return the sheet with the chosen frames of one video, whose pictures and guesses are written."""
    relative = video.relative_to(root)
    known = {label.frame for label in sheet.labels if label.video == relative.as_posix()}
    name = _name(sheet.labels, relative)
    stems = {c.frame: f"{name}_{c.frame:06d}" for c in chosen}
    new = [Label(relative.as_posix(), frame, f"{stem}.png", f"{stem}.pts") for frame, stem in stems.items()
           if frame not in known]
    if not new:
        return sheet
    images, mouth = _seen(video, {label.frame for label in new})
    detector = find_detector()
    for label in new:
        guess = place(scheme, images[label.frame], mouth, detector)
        placed[guess.how] = placed.get(guess.how, 0) + 1
        write_picture(sheet.folder / label.image, images[label.frame])
        write_pts(sheet.folder / label.points, guess.points)
    return replace(sheet, labels=tuple(sorted([*sheet.labels, *new], key=lambda each: each.image)))


def _seen(video: Path, wanted: Set[int]) -> tuple[dict[int, np.ndarray], tuple[float, float] | None]:
    """The wanted frames of a video by number, and where its mouth moves; the others are not held."""
    images: dict[int, np.ndarray] = {}
    grey: list[np.ndarray] = []
    for number, frame in enumerate(video_frames(video)):
        if number in wanted:
            images[number] = frame
        if len(grey) * frame.nbytes < _LOOKED_AT:
            grey.append(frame.mean(axis=-1).astype(np.uint8))
        elif len(images) == len(wanted):
            break
    return images, moving_mouth(np.stack(grey))


def _name(labels: Sequence[Label], video: PurePath) -> str:
    """What the pictures of a video are called, before the number of their frame: no other video of the sheet has it.

    It is the video's path with ``_`` for ``/``, and where another video has that already (``a/b.mp4``, ``a_b.mp4``), a
    hash of the path with it. Upper and lower case are one, as they are on some disks.
    """
    taken = {label.image.rpartition("_")[0].lower() for label in labels if label.video != video.as_posix()}
    plain = "_".join(video.with_suffix("").parts)
    if plain.lower() not in taken:
        return plain
    return f"{plain}-{hashlib.sha256(video.as_posix().encode()).hexdigest()[:8]}"

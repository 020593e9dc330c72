"""Videos in folders."""

from pathlib import Path

from dnnvss.errors import DnnvssError

VIDEOS = (".mp4", ".mov", ".mkv", ".avi", ".mpg", ".mpeg", ".webm", ".m4v", ".wmv", ".mts", ".m2ts", ".ts", ".3gp",
          ".flv", ".mxf", ".vob", ".dv", ".ogv", ".asf", ".qt", ".f4v", ".3g2", ".m2v", ".m2t", ".mpe", ".divx", ".mod",
          ".rm", ".rmvb", ".y4m", ".mj2", ".nut")
"""Kinds of video; where a name has several, the first."""
SOUNDS = (".wav", ".flac", ".mp3", ".m4a", ".aac", ".ogg", ".opus", ".aif", ".aiff", ".wma", ".caf", ".w64")
"""Kinds of sound beside a recording that has none; where a name has several, the first."""


def is_visible(path: Path) -> bool:
    """Whether a path is a file that its user put there: not a folder, nor what systems hide (``._clip.mp4``)."""
    return path.is_file() and not path.name.startswith(".")


def find_videos(folder: Path) -> list[Path]:
    """Return the video files of a folder and of those inside it that are not hidden, or the one file that was named.

    Raises:
        DnnvssError: there is none.
    """
    if folder.is_file():
        return [folder]
    if not folder.exists():
        raise DnnvssError("no such folder or file", file=folder, remedy="Give a folder of videos, or one video")
    videos = sorted(p for p in folder.rglob("*") if p.suffix.lower() in VIDEOS and is_visible(p)
                    and not any(part.startswith(".") for part in p.relative_to(folder).parts))
    if not videos:
        raise DnnvssError("holds no video", file=folder, remedy=f"Give a folder with files {', '.join(VIDEOS)}")
    return videos

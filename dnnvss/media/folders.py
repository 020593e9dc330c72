"""Videos in folders."""

from pathlib import Path

from dnnvss.errors import DnnvssError

SUFFIXES = (".mp4", ".mov", ".avi", ".mkv", ".mpg", ".mpeg", ".webm", ".m4v")


def find_videos(folder: Path) -> list[Path]:
    """Return the video files of a folder and of those inside it, or the one file that was named.

    Raises:
        DnnvssError: there is none.
    """
    if folder.is_file():
        return [folder]
    videos = sorted(p for p in folder.rglob("*") if p.suffix.lower() in SUFFIXES)
    if not videos:
        raise DnnvssError("holds no video", file=folder, remedy=f"Give a folder with files {', '.join(SUFFIXES)}")
    return videos

"""Recordings opened, and nothing else than recordings."""

from collections.abc import Mapping
from pathlib import Path

import av

_CONTAINERS = (
    "3g2", "3gp", "aac", "ac3", "aiff", "amr", "ape", "apng", "asf", "au", "avi", "caf", "dv", "eac3",
    "flac", "flv", "gif", "h264", "hevc", "ivf", "m4a", "m4v", "matroska", "mj2", "mjpeg", "mov", "mp3",
    "mp4", "mpc", "mpc8", "mpeg", "mpegts", "mpegvideo", "mxf", "nistsphere", "nut", "obu", "ogg", "rm",
    "sox", "tak", "tta", "voc", "w64", "wav", "webm", "wtv", "wv", "yuv4mpegpipe")
"""What is read: files that hold their own pictures and sound. Playlists (HLS, DASH, concat, SDP) name other files and
addresses, and come in files of any name."""


def opened(path: str | Path, options: Mapping[str, str] | None = None) -> av.container.InputContainer:
    """A recording, opened; it reads nothing but its own file.

    Args:
        path: the file.
        options: of FFmpeg, for the kind of container.

    Raises:
        FFmpegError: it is no recording, or a list of other files.
    """
    only = {"format_whitelist": ",".join(_CONTAINERS), "protocol_whitelist": "file"}
    return av.open(str(path), container_options={**(options or {}), **only})

"""Sound, video and pictures in and out. Knows nothing of corpora."""

from dnnvss.media.containers import opened
from dnnvss.media.reading import (
    SOUND_RATE,
    SPEECH_RATE,
    VideoInfo,
    read_audio,
    read_video,
    timed_audio,
    timed_cells,
    timed_frames,
    video_frames,
    video_info,
    write_wav,
)
from dnnvss.media.sound import LOUDEST, RATES, Sound
from dnnvss.media.writing import write_video

__all__ = ["LOUDEST", "RATES", "SOUND_RATE", "SPEECH_RATE", "Sound", "VideoInfo", "opened", "read_audio", "read_video",
           "timed_audio", "timed_cells", "timed_frames", "video_frames", "video_info", "write_video", "write_wav"]

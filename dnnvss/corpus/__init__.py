"""Utterance records, splits as files, media, and the built-in talker. Knows nothing of models."""

from dnnvss.corpus.media import VideoInfo, read_audio, read_video, video_frames, video_info, write_wav
from dnnvss.corpus.store import Corpus, CorpusInfo
from dnnvss.corpus.utterance import Utterance

__all__ = ["Corpus", "CorpusInfo", "Utterance", "VideoInfo", "read_audio", "read_video", "video_frames", "video_info",
           "write_wav"]

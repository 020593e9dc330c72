"""Utterance records, splits as files, media, and the built-in talker. Knows nothing of models."""

from dnnvss.corpus.media import VideoInfo, read_audio, read_video, video_frames, video_info, write_wav
from dnnvss.corpus.store import SPLITS, Corpus, CorpusInfo, check_apart, split_files
from dnnvss.corpus.utterance import Utterance

__all__ = ["SPLITS", "Corpus", "CorpusInfo", "Utterance", "VideoInfo", "check_apart", "read_audio", "read_video",
           "split_files", "video_frames", "video_info", "write_wav"]

"""Prepared corpora: records, splits, and the check-up of recordings. Knows nothing of models."""

from dnnvss.corpus.store import SPLITS, Corpus, CorpusInfo, check_apart, split_files
from dnnvss.corpus.utterance import Utterance

__all__ = ["SPLITS", "Corpus", "CorpusInfo", "Utterance", "check_apart", "split_files"]

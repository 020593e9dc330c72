"""Prepared corpora: records, splits, and the check-up of recordings. Knows nothing of models."""

from dnnvss.corpus.store import SPLITS, UNITS, Corpus, CorpusInfo, check_apart, split_files
from dnnvss.corpus.utterance import Utterance

__all__ = ["SPLITS", "UNITS", "Corpus", "CorpusInfo", "Utterance", "check_apart", "split_files"]

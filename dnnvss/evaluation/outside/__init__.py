"""Runs judged from outside: one tracker, which knows nothing of the model, over the talker's video and over ours."""

from dnnvss.evaluation.outside.judge import judge
from dnnvss.evaluation.outside.judged import ROWS, Judged
from dnnvss.evaluation.outside.lips import Lips, see
from dnnvss.evaluation.outside.scores import MEASURES, laid_over, scores

__all__ = ["MEASURES", "ROWS", "Judged", "Lips", "judge", "laid_over", "scores", "see"]

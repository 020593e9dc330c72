"""Systems that predict AAM parameters from labels, behind one base class. Knows nothing of files or rendering."""

from dnnvss.models.base import Example, Prediction, VisualModel
from dnnvss.models.codebook import Codebook
from dnnvss.models.feedforward import FeedForward
from dnnvss.models.hsmm import HiddenSemiMarkov
from dnnvss.models.means import PhoneMean, TrainingMean

__all__ = ["Codebook", "Example", "FeedForward", "HiddenSemiMarkov", "PhoneMean", "Prediction", "TrainingMean",
           "VisualModel"]

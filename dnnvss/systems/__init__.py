"""Systems that predict the parameters of a face, behind one base class. Knows nothing of files or rendering."""

from dnnvss.systems.base import READABLE, Example, Prediction, VisualModel
from dnnvss.systems.blend import BlendedNetworks
from dnnvss.systems.codebook import Codebook
from dnnvss.systems.feedforward import FeedForward
from dnnvss.systems.guided import GuidedCodebook
from dnnvss.systems.hsmm import HiddenSemiMarkov
from dnnvss.systems.means import PhoneMean, TrainingMean
from dnnvss.systems.network import NetworkModel

__all__ = ["READABLE", "BlendedNetworks", "Codebook", "Example", "FeedForward", "GuidedCodebook", "HiddenSemiMarkov",
           "NetworkModel", "PhoneMean", "Prediction", "TrainingMean", "VisualModel"]

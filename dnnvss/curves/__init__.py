"""The mathematics of trajectories: windows, parameter generation, constraints' equations, variance, splines, rates.

Knows nothing of faces and text.
"""

from dnnvss.curves.constraints import Constraints, constrain, hold
from dnnvss.curves.mlpg import mlpg
from dnnvss.curves.resample import resample
from dnnvss.curves.splines import smoothing_spline
from dnnvss.curves.stream import Stream
from dnnvss.curves.variance import GlobalVariance, articulate, dial, with_global_variance
from dnnvss.curves.windows import STATIC, STATIC_DELTA, STATIC_DELTA_DELTA2, Windows, derivatives

__all__ = ["STATIC", "STATIC_DELTA", "STATIC_DELTA_DELTA2", "Constraints", "GlobalVariance", "Stream", "Windows",
           "articulate", "constrain", "derivatives", "dial", "hold", "mlpg", "resample", "smoothing_spline",
           "with_global_variance"]

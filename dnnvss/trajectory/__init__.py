"""Delta windows, parameter generation, variance, constraints, resampling and splines. Knows nothing of text."""

from dnnvss.trajectory.mlpg import mlpg
from dnnvss.trajectory.resample import resample
from dnnvss.trajectory.windows import STATIC, STATIC_DELTA, STATIC_DELTA_DELTA2, Windows, derivatives

__all__ = ["STATIC", "STATIC_DELTA", "STATIC_DELTA_DELTA2", "Windows", "derivatives", "mlpg", "resample"]

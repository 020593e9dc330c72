"""Delta windows, parameter generation, variance, constraints, resampling and splines. Knows nothing of text.

Generation is a chain of functions on arrays, each of which may be left out; :func:`generate` runs it by settings::

    mean, variance = rest_in_silence(mean, variance, phones, clock, rest, deviation)   # a face at rest in silence
    x = mlpg(mean, variance, windows)                                                # the most likely trajectory
    x = articulate(x, setting, natural)                                              # the articulation dial
    x = constrain(x, variance, constraints, windows)                                 # closures, contacts, keys
"""

from dnnvss.trajectory.constraints import Constraints, constrain, hold
from dnnvss.trajectory.generation import Style, Talker, generate
from dnnvss.trajectory.keys import Key, coefficients, key_constraints, read_keys, sample_keys, write_keys
from dnnvss.trajectory.mlpg import mlpg
from dnnvss.trajectory.resample import resample
from dnnvss.trajectory.rules import PhoneRule, closure, level, phone_extremes, rest_in_silence, teeth_contact
from dnnvss.trajectory.splines import interpolate, overlap_average, smoothing_spline
from dnnvss.trajectory.stream import Stream
from dnnvss.trajectory.variance import GlobalVariance, articulate, dial, with_global_variance
from dnnvss.trajectory.windows import STATIC, STATIC_DELTA, STATIC_DELTA_DELTA2, Windows, derivatives

__all__ = ["STATIC", "STATIC_DELTA", "STATIC_DELTA_DELTA2", "Constraints", "GlobalVariance", "Key", "PhoneRule",
           "Stream", "Style", "Talker", "Windows", "articulate", "closure", "coefficients", "constrain", "derivatives",
           "dial", "generate", "hold", "interpolate", "key_constraints", "level", "mlpg", "overlap_average",
           "phone_extremes", "read_keys", "resample", "rest_in_silence", "sample_keys", "smoothing_spline",
           "teeth_contact", "with_global_variance", "write_keys"]

"""From a prediction to the movement that is shown: closures, contacts, rest, keys, what was measured of the talker.

Generation is a chain of functions on arrays, each of which may be left out; :func:`generate` runs it by settings::

    mean, variance = rest_in_silence(mean, variance, phones, clock, rest, deviation)   # a face at rest in silence
    x = mlpg(mean, variance, windows)                                                # the most likely trajectory
    x = articulate(x, setting, natural)                                              # the articulation dial
    x = constrain(x, variance, constraints, windows)                                 # closures, contacts, keys
"""

from dnnvss.style.generation import Style, generate
from dnnvss.style.keys import (
    Key,
    check_keys_file,
    coefficients,
    key_constraints,
    read_keys,
    sample_keys,
    write_keys,
)
from dnnvss.style.rules import PhoneRule, closure, level, phone_extremes, rest_in_silence, teeth_contact
from dnnvss.style.talker import Talker

__all__ = ["Key", "PhoneRule", "Style", "Talker", "check_keys_file", "closure", "coefficients", "generate",
           "key_constraints", "level", "phone_extremes", "read_keys", "rest_in_silence", "sample_keys", "teeth_contact",
           "write_keys"]

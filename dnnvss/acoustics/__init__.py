"""Acoustic features of a sound, on the clock of the trajectories. Knows nothing of phones, text or faces."""

from dnnvss.acoustics.analysis import RATE, Analysis, analyse
from dnnvss.acoustics.encoder import Encoder, encoder_outputs, places_of
from dnnvss.acoustics.encoder_stream import EncoderStream
from dnnvss.acoustics.formants import Formants
from dnnvss.acoustics.logmel import LogMel
from dnnvss.acoustics.loudness import Energy
from dnnvss.acoustics.mfcc import Mfcc
from dnnvss.acoustics.normalise import HOW, Moments, Running, normalised, talker_moments
from dnnvss.acoustics.pairs import Lsf
from dnnvss.acoustics.prediction import Lpc
from dnnvss.acoustics.stream import AcousticStream
from dnnvss.acoustics.voicing import Voicing

__all__ = ["HOW", "RATE", "AcousticStream", "Analysis", "Encoder", "EncoderStream", "Energy", "Formants", "LogMel",
           "Lpc", "Lsf", "Mfcc", "Moments", "Running", "Voicing", "analyse", "encoder_outputs", "normalised",
           "places_of", "talker_moments"]

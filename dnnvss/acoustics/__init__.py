"""Acoustic features of a sound, on the clock of the trajectories. Knows nothing of phones, text or faces."""

from dnnvss.acoustics.analysis import RATE, Analysis, analyse
from dnnvss.acoustics.formants import Formants
from dnnvss.acoustics.logmel import LogMel
from dnnvss.acoustics.loudness import Energy
from dnnvss.acoustics.mfcc import Mfcc
from dnnvss.acoustics.pairs import Lsf
from dnnvss.acoustics.prediction import Lpc
from dnnvss.acoustics.stream import AcousticStream
from dnnvss.acoustics.voicing import Voicing

__all__ = ["RATE", "AcousticStream", "Analysis", "Energy", "Formants", "LogMel", "Lpc", "Lsf", "Mfcc", "Voicing",
           "analyse"]

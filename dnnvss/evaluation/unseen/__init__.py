"""Words never heard: several random splits that hold back words and whole phones, and the mean over them."""

from dnnvss.evaluation.unseen.protocol import Leaving, Unheard, leave_words_out
from dnnvss.evaluation.unseen.words import HeldOut, held_out, without

__all__ = ["HeldOut", "Leaving", "Unheard", "held_out", "leave_words_out", "without"]

"""The 41 ARPAbet phones and what is known of their articulation. Knows nothing of time."""

from dnnvss.phones.articulation import ARTICULATION, BILABIALS, LABIODENTALS, Articulation
from dnnvss.phones.inventory import PHONES, SHORT_PAUSE, SILENCE, SILENCES, SPOKEN, VOWELS, phone_id, strip_stress
from dnnvss.phones.questions import ANSWERS, QUESTIONS, Question, nearest

__all__ = ["ANSWERS", "ARTICULATION", "BILABIALS", "LABIODENTALS", "PHONES", "QUESTIONS", "SHORT_PAUSE", "SILENCE",
           "SILENCES", "SPOKEN", "VOWELS", "Articulation", "Question", "nearest", "phone_id", "strip_stress"]

"""The 41 ARPAbet phones and what is known of their articulation. Knows nothing of time."""

from dnnvss.phones.inventory import PHONES, SHORT_PAUSE, SILENCE, SILENCES, SPOKEN, VOWELS, phone_id, strip_stress

__all__ = ["PHONES", "SHORT_PAUSE", "SILENCE", "SILENCES", "SPOKEN", "VOWELS", "phone_id", "strip_stress"]

"""Text-to-speech engines behind one interface: sound, and phones with times in our set."""

from dnnvss.speech.engines.base import Engine, Speech, with_silences
from dnnvss.speech.engines.choice import ENGINES, find_engine

__all__ = ["ENGINES", "Engine", "Speech", "find_engine", "with_silences"]

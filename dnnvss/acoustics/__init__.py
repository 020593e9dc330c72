"""Acoustic features of a sound, on the clock of the trajectories. Knows nothing of phones, text or faces."""

from dnnvss.acoustics.logmel import LogMel, log_mel

__all__ = ["LogMel", "log_mel"]

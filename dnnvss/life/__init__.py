"""A face that lives: eyes, brows and head as the talker moves them beside speech; knows nothing of faces' models."""

from dnnvss.life.blinks import Blink, BlinkRates, blink_threshold, find_blinks, shut_share
from dnnvss.life.contexts import CONTEXTS, speech_contexts
from dnnvss.life.drawing import Moves, draw_moves
from dnnvss.life.eyes import EyeModel, EyeRegion
from dnnvss.life.tracks import Life, Tracks

__all__ = ["CONTEXTS", "Blink", "BlinkRates", "EyeModel", "EyeRegion", "Life", "Moves", "Tracks", "blink_threshold",
           "draw_moves", "find_blinks", "shut_share", "speech_contexts"]

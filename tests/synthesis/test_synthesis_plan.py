"""What is said when a text and a recording of it are given."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.synthesis.plan import heard
from dnnvss.synthesis.request import Recording
from dnnvss.text.sentence import parse


def test_words_that_drown_in_noise_are_refused_and_a_voice_alone_is_named() -> None:
    noise = np.random.default_rng(0).normal(0, 0.1, 32000).astype(np.float32)
    run: Any = SimpleNamespace(voice=SimpleNamespace(variant="en_us"))
    with pytest.raises(DnnvssError, match=r"noise.*less noise, or leave the text out: a run whose labels read"):
        heard(run, parse("hello there"), Recording(noise, 16000))

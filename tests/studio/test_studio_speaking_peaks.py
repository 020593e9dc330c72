"""The waveform that the page draws beside the phones."""

import numpy as np
import pytest

from dnnvss.studio.speaking.takes import peaks


@pytest.mark.parametrize("rate", [8000, 11025, 16000, 22050, 44100])
def test_a_click_is_drawn_in_the_hundredth_of_a_second_in_which_it_is_heard(rate: int) -> None:
    samples = np.zeros(30 * rate, np.float32)
    samples[round(29.505 * rate)] = -0.5
    drawn = peaks(samples, rate)
    assert len(drawn) == 3000 and np.flatnonzero(drawn).tolist() == [2950] and drawn[2950] == 0.5
    assert peaks(samples[:0], rate) == []

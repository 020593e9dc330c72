"""Random alignments, and the frames of an utterance in a store."""

import numpy as np
from hypothesis import strategies as st

from dnnvss.features import CodeStore
from dnnvss.phones import PHONES, SPOKEN
from dnnvss.timing import Alignment, Tier


@st.composite
def alignments(draw: st.DrawFn, units: int = 12) -> Alignment:
    """Words of one to five phones between optional pauses, phones of 1 to 90 ms (some shorter than a frame)."""
    phones, words, time = [], [], draw(st.sampled_from([0.0, 1.2345]))
    begin = time
    for _ in range(draw(st.integers(1, 4))):
        start = time
        kind = draw(st.sampled_from(["word", "word", "sil", "sp"]))
        labels = [kind] if kind in PHONES else draw(st.lists(st.sampled_from(SPOKEN), min_size=1, max_size=5))
        for label in labels:
            length = draw(st.sampled_from([0.001, 0.004, 0.01, 0.0333, 0.09]))
            phones.append((time, time + length, label))
            time += length
        words.append((start, time, "" if kind in PHONES else f"w{len(words)}"))
    if time - begin < 0.0401:  # a frame of the lowest rate
        phones.append((time, time + 0.05, "sil"))
        words.append((time, time + 0.05, ""))
        time += 0.05
    cuts = draw(st.lists(st.floats(0.05, 0.95), max_size=6, unique_by=lambda x: round(x, 2)))
    edges = [begin, *(begin + round(c, 2) * (time - begin) for c in sorted(cuts)), time]
    labels = [str(draw(st.integers(0, units - 1))) for _ in edges[1:]]
    visemes = Tier("visemes", zip(edges[:-1], edges[1:], labels, strict=True))
    return Alignment([Tier("phones", phones), Tier("words", words), visemes])


def frames_of(store: CodeStore, name: str) -> np.ndarray:
    """The indices (T,) of an utterance's frames."""
    edges = [*store.arrays["utterance_start"], len(store)]
    place = store.ids.index(name)
    return np.arange(edges[place], edges[place + 1])

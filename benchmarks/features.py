"""Phones a second from an alignment to features: dnnvss, and nnmnkwii's Merlin frontend, in one run on one core.

    OMP_NUM_THREADS=1 python benchmarks/features.py

nnmnkwii imports only beside an old setuptools: ``pip install --no-deps --target FOLDER "setuptools<81"``, then the same
for ``nnmnkwii==0.1.3``, then ``PYTHONPATH=FOLDER``. Both see the same alignment of the same sentence. nnmnkwii is given
its full-context labels ready made, and answers one question, a regular expression, for each column; a frame's features
are then a phone's, repeated. Ours reads phones, words and visemes and finds syllables and phrases by itself; the second
row also looks up the active columns and numbers of every frame, the third writes the dense matrix. Times are of the
processor, the least of repeated runs after a warm-up.
"""

import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from synthetic import all_features

from dnnvss.features import FeatureTable, encode, expand
from dnnvss.phones import SPOKEN
from dnnvss.text.full_context import write_full_context
from dnnvss.timing import Alignment, FrameClock, Tier

CLOCK, WORD, COUNT = FrameClock(100), ("P", "L", "EY", "S"), 25
SMALL = FeatureTable(("centre_phone", "phone_context", "acoustic_class", "phone_position", "phone_frames", "phone_span",
                      "syllable_phone_position", "word_syllable_position", "phrase_word_position"))


def sentence() -> tuple[Alignment, str]:
    """Return an alignment of a hundred phones and its text."""
    rng = np.random.default_rng(0)
    phones = ["sil", *(WORD * COUNT), "sil"]
    edges = np.cumsum([0, *rng.integers(4, 14, len(phones))]) / 100
    starts = range(1, len(phones) - 1, len(WORD))
    words = [(0, edges[1], ""), *((edges[i], edges[i + len(WORD)], "place") for i in starts), (*edges[-2:], "")]
    cuts = np.unique(np.r_[0, np.cumsum(rng.integers(5, 16, 200)) / 100])
    cuts = np.r_[cuts[cuts < edges[-1]], edges[-1]]
    visemes = [(a, b, str(u)) for a, b, u in zip(cuts[:-1], cuts[1:], rng.integers(0, 160, len(cuts)), strict=False)]
    tiers = [Tier("phones", zip(edges[:-1], edges[1:], phones, strict=True)), Tier("words", words)]
    return Alignment([*tiers, Tier("visemes", visemes)]), " ".join(["place"] * COUNT)


def seconds(function: Callable[[], Any], repeats: int) -> float:
    """Return the least processor time of a call."""
    function()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


def peer(alignment: Alignment, text: str, columns: int) -> Callable[[], Any] | None:
    """Return nnmnkwii's extraction of so many columns, or None where it cannot be imported."""
    try:
        if not hasattr(np, "int"):
            setattr(np, "int", int)  # noqa: B010 (nnmnkwii 0.1.3 still uses numpy's old name)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            from nnmnkwii.frontend import merlin
            from nnmnkwii.io import hts
    except ImportError as error:
        print(f"nnmnkwii is not installed ({error}): its column stays empty")
        return None
    names = [p.lower() for p in SPOKEN]
    marks = [("*^{}-*", "ll"), ("*-{}+*", "c"), ("*+{}=*", "r"), ("*={}@*", "rr"), ("{}^*", "l")]
    questions = [f'QS "{place}-{name}-{n}" {{{mark.format(name)}}}' for n in range(columns)
                 for mark, place in marks for name in names][:columns]
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "q.hed").write_text("\n".join(questions), encoding="utf-8")
        binary, numeric = hts.load_question_set(str(Path(folder, "q.hed")))
        labels = hts.load(str(write_full_context(Path(folder, "a.lab"), alignment, text)))
    return lambda: merlin.linguistic_features(labels, binary, numeric, add_frame_features=True, subphone_features=None)


def main() -> None:
    """Print the table."""
    warnings.simplefilter("ignore")
    alignment, text = sentence()
    phones = len(alignment["phones"].labels)
    print(f"{phones} phones\n{'phones a second':52}{'dnnvss':>10}{'nnmnkwii':>10}{'ratio':>8}")
    for table in (all_features(), SMALL):
        other = peer(alignment, text, table.width)
        theirs = phones / seconds(other, 2) if other else float("nan")
        codes = encode(alignment, text, table, CLOCK)
        every = np.arange(len(codes))

        def look_up(codes: Any = codes, every: np.ndarray = every) -> None:
            codes.active(every), codes.numeric(every)

        coded = seconds(lambda table=table: encode(alignment, text, table, CLOCK), 20)  # type: ignore[misc]
        looked, dense = seconds(look_up, 20), seconds(lambda codes=codes: expand(codes), 5)  # type: ignore[misc]
        for title, spent in (("frame codes", coded), ("and active columns of all frames", coded + looked),
                             ("and the dense matrix", coded + dense)):
            print(f"{f'{table.width} columns: {title}':52}{phones / spent:10.0f}{theirs:10.0f}"
                  f"{phones / spent / theirs:8.1f}")


if __name__ == "__main__":
    main()

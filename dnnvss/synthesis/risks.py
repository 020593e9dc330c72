"""Which frames of a synthesised sentence may be wrong, and why: what the talker never said, and what was guessed."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import groupby, pairwise
from typing import Any, NamedTuple

import numpy as np

from dnnvss.phones import SILENCES
from dnnvss.phones.contexts import triphones
from dnnvss.style.keys import Key, key_time
from dnnvss.style.within import Reach
from dnnvss.timing import Alignment, FrameClock, Tier

Risk = Mapping[str, Any]
"""Plain values with a ``kind``: ``unseen phone`` (with ``phone`` and ``stands_in``), ``unseen triphone`` (with
``triphone``), ``unseen neighbours`` (likewise), ``weak alignment`` (with ``word`` and its ``score`` a frame), ``unknown
word`` (with ``word`` and the ``phones`` that a network guessed), ``unheard sound`` (with its ``distance``, over what is
usual in the recordings that the run has heard), ``key beyond the talker`` (with ``name``, the key's ``low`` and
``high``, and what the talker ``showed``)."""


_TELLING, _MOST = 8, 0.5
"""Phones of a sentence that is long enough to tell, and the share of unseen triphones that is most of them."""


class Span(NamedTuple):
    """Frames ``first`` to ``last`` inclusive, their start and end in seconds, and what may be wrong in each of them."""

    first: int
    last: int
    start: float
    end: float
    risks: tuple[Risk, ...]

    def to_json(self) -> dict[str, Any]:
        """Return plain containers, times to 0.1 ms."""
        return {**self._asdict(), "start": round(self.start, 4), "end": round(self.end, 4),
                "risks": [dict(r) for r in self.risks]}


def word_risks(report: Sequence[Mapping[str, str]], scores: Sequence[float] = ()) -> list[list[Risk]]:
    """Return what is doubtful about each word.

    Args:
        report: the pronunciation report, a row a word.
        scores: of the alignment, one a word; none where nothing was aligned.
    """
    found: list[list[Risk]] = [[] for _ in report]
    for row, risks in zip(report, found, strict=True):
        if row["source"] == "network":
            risks.append({"kind": "unknown word", "word": row["spoken"], "phones": row["phones"]})
    if not scores:
        return found
    from dnnvss.speech.align import DOUBTFUL  # which loads the aligner

    for row, risks, score in zip(report, found, scores, strict=False):
        if score < DOUBTFUL:
            risks.append({"kind": "weak alignment", "word": row["spoken"], "score": round(score, 1)})
    return found


def key_risks(keys: Sequence[Key], reach: Reach | None, names: Sequence[str],
              tier: Tier | None = None) -> list[tuple[float, Risk]]:
    """The keys, by the times at which they are held, that ask for what the talker never showed; they are obeyed.

    Args:
        keys: an artist's.
        reach: what the talker showed; nothing is told where that was not kept.
        names: of the coefficients.
        tier: the phones as they are said, with which anchored keys move; all keys keep their times where None.
    """
    found: list[tuple[float, Risk]] = []
    for key in keys:
        span = reach.range_of(key.name, names) if reach else None
        if span and (key.low > span[1] or key.high < span[0]):
            bounds = {"low": round(key.low, 4), "high": round(key.high, 4)}
            showed = [round(v, 4) for v in span]
            risk = {"kind": "key beyond the talker", "name": key.name, **bounds, "showed": showed}
            found.append((key_time(key, tier), risk))
    return found


def find_risks(alignment: Alignment, clock: FrameClock, replaced: Mapping[str, str], known: Iterable[str],
               words: Sequence[Sequence[Risk]] = (), keys: Sequence[tuple[float, Risk]] = ()) -> list[Span]:
    """Return the spans of frames that carry a risk, in order; frames in none of them carry none.

    Args:
        alignment: what is said, with tiers ``phones`` and ``words``.
        clock: of the frames.
        replaced: phones that the talker never spoke, and which phone stands in for each.
        known: triphones that the talker spoke. Contexts are judged with the stand-ins, as the model sees them.
        words: risks of each word; none where nothing is known about the words.
        keys: risks of keys, each with its time from the start in seconds; they are those of the phone it lies in.

    Where most triphones of a sentence are unseen (:func:`unfamiliar`), each of them says nothing: then phones are
    marked beside which neither neighbour was ever heard (``unseen neighbours``).
    """
    strange = unfamiliar(alignment, replaced, known := frozenset(known)) is not None
    tier, pairs = alignment["phones"], _pairs(known)
    seen = triphones(tier.renamed(replaced.get(p, p) for p in tier.labels))
    named = [k for k, label in enumerate(alignment["words"].labels) if label]
    risks_of = dict(zip(named, words, strict=True)) if words else {}
    rows: list[tuple[Risk, ...]] = []
    owners = alignment["words"].indices_at(tier.middles).tolist()
    for segment, triphone, owner in zip(tier, seen, owners, strict=True):
        own: list[Risk] = [risk for time, risk in keys if segment.start <= time + tier.start < segment.end]
        if segment.label in SILENCES:
            rows.append(tuple(own))
            continue
        if segment.label in replaced:
            own.append({"kind": "unseen phone", "phone": segment.label, "stands_in": replaced[segment.label]})
        if triphone not in known and not strange:
            own.append({"kind": "unseen triphone", "triphone": triphone})
        if strange and not _pairs((triphone,)) & pairs:
            own.append({"kind": "unseen neighbours", "triphone": triphone})
        rows.append((*own, *risks_of.get(owner, ())))
    frames, seconds = tier.frame_edges(clock).tolist(), tier.edges.tolist()
    spans = [Span(a, b - 1, s, e, row) for (a, b), (s, e), row in zip(pairwise(frames), pairwise(seconds), rows,
                                                                      strict=True) if row and b > a]
    return _joined(spans)


def unfamiliar(alignment: Alignment, replaced: Mapping[str, str], known: Collection[str]) -> float | None:
    """The share of a sentence's triphones that the talker never spoke; None where that is not most of them.

    Sentences of less than eight phones are too short to tell.
    """
    tier = alignment["phones"]
    seen = triphones(tier.renamed(replaced.get(p, p) for p in tier.labels))
    spoken = [triphone in known for triphone, p in zip(seen, tier.labels, strict=True) if p not in SILENCES]
    share = 1 - sum(spoken) / max(len(spoken), 1)
    return share if len(spoken) >= _TELLING and share > _MOST else None


def _pairs(known: Collection[str]) -> frozenset[tuple[str, str]]:
    """The neighbouring phones in triphones."""
    parts = [name.replace("+", "-").split("-") for name in known]
    return frozenset(pair for a, b, c in parts for pair in ((a, b), (b, c)))


def sound_risks(strangeness: np.ndarray, clock: FrameClock) -> list[Span]:
    """The spans of frames whose sound lies further than usual from what the run has heard.

    Args:
        strangeness: of each frame (T,), see :meth:`dnnvss.runs.heard.Heard.strangeness`.
        clock: of the frames.
    """
    above, spans = strangeness > 1, []
    edges = [0, *(np.flatnonzero(np.diff(above)) + 1).tolist(), len(above)]
    for first, stop in pairwise(edges):
        if stop > first and above[first]:
            far = round(float(strangeness[first:stop].max()), 2)
            spans.append(Span(first, stop - 1, clock.seconds(first), clock.seconds(stop),
                              ({"kind": "unheard sound", "distance": far},)))
    return spans


def _joined(spans: Sequence[Span]) -> list[Span]:
    """Return the spans with neighbours that carry the same risks made one."""
    joined: list[Span] = []
    for span in spans:
        if joined and joined[-1].risks == span.risks and joined[-1].last + 1 == span.first:
            joined[-1] = joined[-1]._replace(last=span.last, end=span.end)
        else:
            joined.append(span)
    return joined


def summary(spans: Sequence[Span], count: int) -> str:
    """Return in one line how many of ``count`` frames carry a risk, and of which kinds."""
    if not spans:
        return f"none of the {count} frames carries a risk"
    risky = len({frame for s in spans for frame in range(s.first, s.last + 1)})
    kinds = sorted((r["kind"], s.last - s.first + 1) for s in spans for r in s.risks)
    counted = ", ".join(f"{kind} {sum(n for _, n in rows)}" for kind, rows in groupby(kinds, key=lambda k: k[0]))
    return f"{risky} of {count} frames carry a risk ({counted}); the report names them"

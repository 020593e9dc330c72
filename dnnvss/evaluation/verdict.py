"""What a run is worth in five lines that can be read aloud, and as a page."""

import html
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from string import Template

import numpy as np

from dnnvss import files
from dnnvss.evaluation.cells import Ranged, interval, number, number_of
from dnnvss.evaluation.report import Report
from dnnvss.evaluation.statistics import FEWEST, Difference, difference, estimate
from dnnvss.pages import bars, document
from dnnvss.phones import SILENCES, SPOKEN
from dnnvss.runs.folds import speech
from dnnvss.runs.voice import Voice
from dnnvss.systems import Example
from dnnvss.text.coverage import EXAMPLES, Coverage, next_prompts

NULL = "phone mean"
SHOWN = 3
"""Sentences to record next that are read out; the page has all."""
_SURE = 0.05
_UNTOLD = "What is said in them was not written down, so that sounds are not counted and no sentences proposed."
_LIKE = {False: "each phone, which is told the phones and their times",
         True: "speech, which is told when somebody speaks"}
"""What the mean is of that a system without phones stands beside: where words are known, and where they are not."""
_EXPECT = (
    (0.85, "The mouth follows speech closely; most sentences can be shown in a close-up."),
    (0.75, "The mouth opens, closes and rounds with the words; small movements of single sounds are missing now and "
           "then."),
    (0.6, "The mouth opens and closes with the words, and wide and round vowels differ; many single sounds look alike. "
          "It will do in a small picture, not in a close-up."),
    (0.4, "The mouth moves when it should and hardly more than that; do not show it close."),
    (-1.0, "What the mouth does has little to do with what is said; record more before you show it."),
)
_WORSE = ("It is worse than the mean of each phone, which more speech will not mend: its fit failed, or it does "
          "not suit these recordings. Take another (model=auto chooses), or a third of trainer.learning_rate.")
_GROWTH = ((60, "Every further sentence helps: with twice the speech it will be clearly better."),
           (600, "With twice the speech it will be better still, though no longer by much."),
           (float("inf"), "More speech will change little; other sentences than these might."))


@dataclass(frozen=True)
class Verdict:
    """What a run is worth.

    Args:
        lines: five sentences or few more: what was recorded, what it covers, the system against what knows nothing,
            what to record next, what to expect.
        prompts: sentences to record next, the most useful first; none where nobody knows what was said.
        coverage: what was heard of the talker.
    """

    lines: tuple[str, ...]
    prompts: tuple[str, ...]
    coverage: Coverage

    @property
    def text(self) -> str:
        """The lines, to be printed."""
        return "\n".join(["Verdict", *(f"{k}. {line}" for k, line in enumerate(self.lines, start=1))])

    def markdown(self) -> str:
        """The lines as a part of the page of results."""
        return "\n".join(["## Verdict", "", *(f"{k}. {line}" for k, line in enumerate(self.lines, start=1))])

    def write(self, path: Path, title: str, more: str = "") -> Path:
        """Write the page and return its path.

        Args:
            path: the ``.html`` file.
            title: what was judged.
            more: how the system was chosen, as text; nothing where it was named.
        """
        phones = bars((p, EXAMPLES[p], self.coverage.phones[p]) for p in SPOKEN)
        prompts = "".join(f"<li>{html.escape(text)}</li>" for text in self.prompts)
        heard = "" if self.coverage.untold else _template("verdict_heard").substitute(prompts=prompts, phones=phones)
        chosen = f"<h2>How the system was chosen</h2><pre>{html.escape(more)}</pre>" if more else ""
        body = _template("verdict").substitute(
            title=html.escape(title), lines="".join(f"<li>{html.escape(line)}</li>" for line in self.lines),
            heard=heard, chosen=chosen)
        return files.write_text(path, document(title, body, "main { --measure: 860px; }\n"))


def _template(name: str) -> Template:
    return Template(resources.files("dnnvss.evaluation").joinpath(f"{name}.html").read_text("utf-8"))


def verdict(report: Report, system: str, train: Sequence[Example], voice: Voice,
            sources: Sequence[str] = (), company: Sequence[str] = (), listens: bool = False) -> Verdict:
    """The verdict on a run.

    Args:
        report: of the evaluation, with the row ``model`` and the null models.
        system: its name.
        train: what it was trained on.
        voice: of the talker.
        sources: talkers whose systems it learnt from.
        company: talkers who were heard in the same training.
        listens: whether a voice alone drives it: the mean of each phone, which is told phones and times, is no rival.
    """
    heard = Counter(p for e in train for p in e.alignment["phones"].labels if p not in SILENCES)
    coverage = Coverage.of(heard, voice.triphones)
    prompts = () if coverage.untold else tuple(next_prompts(coverage, voice.variant))
    seconds, gain = speech(train), _gain(report)
    lines = (_recorded(len(train), seconds, sources, company),
             _UNTOLD if coverage.untold else _covered(coverage, voice),
             _against(report, system, gain, _LIKE[coverage.untold] if listens else None),
             *(() if coverage.untold else (_next(prompts),)),
             _expected(report.headline("model"), seconds, None if listens else gain))
    return Verdict(lines, prompts, coverage)


def _recorded(sentences: int, seconds: float, sources: Sequence[str], company: Sequence[str]) -> str:
    amount = f"{seconds:.0f} seconds" if seconds < 120 else f"{seconds / 60:.0f} minutes"
    others = f", and on what runs of {', '.join(sources)} had learnt" if sources else ""
    beside = f", together with {', '.join(company)}" if company else ""
    return f"Trained on {number_of(sentences, 'sentence')} with {amount} of speech{others}{beside}."


def _covered(coverage: Coverage, voice: Voice) -> str:
    said = len(SPOKEN) - len(coverage.missing)
    never = ""
    if coverage.missing:
        named = ", ".join(f"{p} as in {EXAMPLES[p]}" for p in coverage.missing[:4])
        more = f" and {len(coverage.missing) - 4} more" if len(coverage.missing) > 4 else ""
        lacking = set(coverage.missing) - set(voice.borrowed)
        instead = "for which the likest sound stands in" if lacking else "which are borrowed from other talkers"
        if lacking and voice.borrowed:
            instead = "some of which are borrowed from other talkers; for the rest the likest sound stands in"
        never = f"; never heard: {named}{more}, {instead}"
    share = coverage.share(voice.variant)
    return (f"They hold {said} of the {len(SPOKEN)} sounds of English and {coverage.triphones} different triphones, "
            f"and {share:.0%} of the transitions from sound to sound in ordinary sentences{never}.")


def _gain(report: Report) -> Difference | None:
    """What the system has over the mean of each phone; None where the sentences are too few to say."""
    model, null = (_pairs(report, name) for name in ("model", NULL))
    return difference(null, model) if model[:, 1].sum() >= FEWEST else None


def _against(report: Report, system: str, gain: Difference | None, like: str | None) -> str:
    """The system beside the mean of each phone; ``like`` says what that is told where the system listens."""
    model, null = (_pairs(report, name) for name in ("model", NULL))
    count = int(model[:, 1].sum())
    own, other = estimate(model), estimate(null)
    said = f"On {number_of(count, 'sentence')} that it was not trained on"
    if like is not None:
        told = _short if gain is None else _ranged
        return (f"{said}, {system} correlates with the talker by {told(own)}, a face that stands still by 0; the mean "
                f"of {like} where this one listens, by {told(other)}.")
    if gain is None:
        few = "1 is" if count == 1 else f"{count} are"
        return (f"{said}, {system} correlates with the talker by {_short(own)}, the mean of each phone by "
                f"{_short(other)}, a face that stands still by 0; {few} too few to say whether that is chance.")
    sure = "and is not chance" if gain.p < _SURE else "which may be chance"
    return (f"{said}, {system} correlates with the talker by {_ranged(own)}, the mean of each phone by "
            f"{_ranged(other)}, a face that stands still by 0; the gain over the means is {_ranged(gain)} {sure}.")


def _pairs(report: Report, system: str) -> np.ndarray:
    """Correlation of each sentence as (amount, weight)."""
    values = report.sentences(system, "correlation")
    return np.stack([np.nan_to_num(values), ~np.isnan(values)], axis=1).astype(float)


def _short(found: Ranged) -> str:
    return number(found.value, 2)


def _ranged(found: Ranged) -> str:
    return interval(found, 2)


def _next(prompts: Sequence[str]) -> str:
    if not prompts:
        return "Record whatever you like next: every transition of the sentences that we would propose was heard."
    quoted = " ".join(f"“{text}”" for text in prompts[:SHOWN])
    more = f" The page of the verdict has {len(prompts)}." if len(prompts) > SHOWN else ""
    return f"Record next: {quoted}{more}"


def _expected(correlation: float, seconds: float, gain: Difference | None) -> str:
    if gain is not None and gain.high < 0:
        return _WORSE
    level = 0.0 if np.isnan(correlation) else correlation
    words = next(text for least, text in _EXPECT if level >= least)
    return f"{words} {next(text for most, text in _GROWTH if seconds < most)}"

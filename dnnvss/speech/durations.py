"""How long phones last: a regression learnt from a corpus, and time lines for new sentences."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.archives import Held, read_declared
from dnnvss.corpus.utterance import Utterance
from dnnvss.errors import DnnvssError
from dnnvss.phones import ARTICULATION, SHORT_PAUSE, SILENCE, SILENCES, strip_stress
from dnnvss.text.sentence import Sentence, Word, spoken_words
from dnnvss.text.tree import LinguisticTree, linguistic_tree
from dnnvss.timing import Alignment, Tier

Expected = Callable[[Alignment, str], np.ndarray]
"""What tells the expected seconds (n,) of each spoken phone of an alignment and its text, whatever its times are."""
SHORTEST = 0.01
"""Seconds below which a duration of the corpus is not believed, and below which none is predicted."""
_SLOWEST = 20
"""How many times longer than the talker's a total length may let phones last."""

_PENALTIES = (0.3, 1.0, 3.0, 10.0, 30.0)
_FOLDS = 5
_ALWAYS = "always"  # the context of every phone
_ARRAYS = {"columns": Held(("columns",), "U"), "weights": Held(("columns",)), "variance_of": Held(("phones",), "U"),
           "variance": Held(("phones",)), "pause_labels": Held((3,), "U"), "pause_seconds": Held((3,))}
_ROWS = 4096  # phones whose contexts are held as a matrix at once
_EMPHASIS = 0.8  # standard deviations by which an emphasised phone is longer
_DEFAULT_PAUSES = {"minor": (SHORT_PAUSE, 0.18), "major": (SHORT_PAUSE, 0.4)}


@dataclass(frozen=True)
class Pauses:
    """What a corpus does after the breaks ``none``, ``minor`` and ``major``: a label and seconds, or None."""

    none: tuple[str, float] | None
    minor: tuple[str, float] | None
    major: tuple[str, float] | None


@dataclass(frozen=True)
class DurationModel:
    """A ridge regression from a phone's context to the logarithm of its duration in seconds.

    ``log d ~ Normal(weights . context, variance[phone])``; the expected duration is ``exp(mean + variance / 2)``.

    Args:
        columns: names of the context features, such as ``phone=AA``, ``next=stop-``, ``in phrase=last``.
        weights: (len(columns),) in log seconds.
        variance: variance of the log duration about the mean, by phone, by class and for all.
        pauses: pauses between words.
    """

    columns: tuple[str, ...]
    weights: np.ndarray
    variance: dict[str, float]
    pauses: Pauses

    @classmethod
    def fit(cls, utterances: Sequence[Utterance]) -> "DurationModel":
        """Return a model of the durations in aligned utterances; the penalty is chosen by cross-validation over them.

        Raises:
            DnnvssError: fewer than two utterances, or no spoken phone in them.
        """
        if len(utterances) < 2:
            raise DnnvssError(f"a duration model cannot be learnt from {len(utterances)} utterance(s)",
                              remedy="Give the training split of a corpus")
        contexts, logs, groups = [], [], []
        for number, utterance in enumerate(utterances):
            rows, seconds = spoken_contexts(utterance.alignment, utterance.text)
            contexts += rows
            logs.append(np.log(np.maximum(seconds, SHORTEST)))
            groups += [number % _FOLDS] * len(rows)
        if not contexts:
            raise DnnvssError("the utterances have no spoken phone", remedy="Align the corpus first")
        columns = tuple(sorted({name for row in contexts for name in row}))
        x, y = _matrix(contexts, columns), np.concatenate(logs)
        weights = _ridge(x, y, np.array(groups))
        return cls(columns, weights, _variances(contexts, y - x @ weights), _pauses(utterances))

    def borrowing(self, other: "DurationModel") -> "DurationModel":
        """This model with what another talker's adds for phones that this corpus lacks.

        A phone's weight is what it adds to its class and context; these stay the talker's own.
        """
        theirs = dict(zip(other.columns, other.weights, strict=True))
        lacking = [p for p in ARTICULATION if p in theirs and p not in self.columns]
        return DurationModel((*self.columns, *lacking), np.array([*self.weights, *(theirs[p] for p in lacking)]),
                             {**{p: other.variance[p] for p in lacking if p in other.variance}, **self.variance},
                             self.pauses)

    def log_durations(self, alignment: Alignment, text: str) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and standard deviation (n,) of the log duration of each spoken phone, whatever its times are.

        A phone that the corpus lacks has the columns of its class only.
        """
        rows, _ = _spoken_contexts(alignment, text)
        parts, variances = [np.zeros(0)], list[float]()
        while some := list(islice(rows, _ROWS)):  # the contexts of an hour of speech never lie there at once
            parts.append(_matrix(some, self.columns) @ self.weights)
            variances += [next(self.variance[n] for n in row if n in self.variance) for row in some]
        return np.concatenate(parts), np.sqrt(variances)

    def durations(self, alignment: Alignment, text: str) -> np.ndarray:
        """Return the expected duration (n,) in seconds of each spoken phone, whatever its times are."""
        mean, deviation = self.log_durations(alignment, text)
        return np.exp(mean + deviation**2 / 2)

    def predict(self, sentence: Sentence, rate: float = 1.0, total: float | None = None, lead_in: float = 0.2,
                lead_out: float = 0.3, expected: Expected | None = None) -> Alignment:
        """Return a time line for a sentence, with the tiers ``phones`` and ``words``.

        To speak faster or slower, and to meet a total length, each phone is moved by the same number of its own
        standard deviations of log duration, so that elastic phones give way more than stiff ones; pauses scale.

        Args:
            rate: speaking rate, 1 as in the corpus, 2 twice as fast.
            total: length in seconds to meet exactly, silences at both ends included; then ``rate`` is not used.
            lead_in, lead_out: seconds of silence before and after, 0 for none; pauses that the text asks for there are
                added.
            expected: another source of the expected seconds (n,) of each spoken phone; this model's own if left out.

        Raises:
            DnnvssError: a rate outside 0.25 to 4, negative silences, or a total that is too short or too long for the
                phones.
        """
        if not 0.25 <= rate <= 4 or lead_in < 0 or lead_out < 0:
            raise DnnvssError(f"cannot speak at a speed of {rate} with silences of {lead_in} and {lead_out} s",
                              remedy="Give speed=0.25 to 4, and silences (lead_in, lead_out) of 0 or more")
        lead_in, lead_out = lead_in + sentence.pause_before, lead_out + sentence.pause_after
        plan = _planned(sentence, self.pauses)
        mean, deviation = self.log_durations(plan, sentence.text)
        mean = mean + deviation**2 / 2 if expected is None else np.log(expected(plan, sentence.text))
        mean = mean + _EMPHASIS * deviation * _emphasised(sentence) - np.log(_rates(sentence))
        pauses = np.array([s.duration for s in plan["phones"] if s.label in SILENCES])
        fixed = _asked(sentence, plan)
        wanted = (np.exp(mean).sum() + pauses[~fixed].sum()) / rate
        if total is not None:
            wanted = total - lead_in - lead_out - pauses[fixed].sum()
            if wanted < 2 * SHORTEST * len(mean):
                silence = lead_in + lead_out
                raise DnnvssError(f"{total} s are too short for {len(mean)} phones and {silence:.2f} s of silence",
                                  remedy=f"Give at least {total - wanted + 2 * SHORTEST * len(mean):.2f} s")
            if wanted > (most := _SLOWEST * (np.exp(mean).sum() + pauses[~fixed].sum())):
                raise DnnvssError(f"{total:g} s are too long for {len(mean)} phones",
                                  remedy=f"Give at most {total - wanted + most:.2f} s, or more silence around the "
                                  "words (lead_in, lead_out, [pause 2s])")
        seconds, pauses[~fixed] = _stretched(mean, deviation, pauses[~fixed], float(wanted))
        return _laid_out(plan, seconds, pauses, lead_in, lead_out)

    def save(self, path: str | Path) -> Path:
        """Write the model as ``.npz`` of plain arrays and return the path."""
        pauses = [self.pauses.none, self.pauses.minor, self.pauses.major]
        return files.write_arrays(
            path, columns=np.array(self.columns), weights=self.weights, variance_of=np.array(list(self.variance)),
            variance=np.array(list(self.variance.values())), pause_labels=np.array([p[0] if p else "" for p in pauses]),
            pause_seconds=np.array([p[1] if p else 0.0 for p in pauses]))

    @classmethod
    def load(cls, path: str | Path) -> "DurationModel":
        """Return the model in a file written by :meth:`save`.

        Raises:
            DnnvssError: the file is missing, damaged or of another kind.
        """
        remedy = "Train again: the duration model is written beside the checkpoint"
        a = read_declared(path, _ARRAYS, remedy)
        pauses = [(str(p), float(s)) if p else None for p, s in zip(a["pause_labels"], a["pause_seconds"], strict=True)]
        variance = {str(k): float(v) for k, v in zip(a["variance_of"], a["variance"], strict=True)}
        columns = tuple(map(str, a["columns"]))
        silent = all(p is None or (p[0] in SILENCES and p[1] > 0) for p in pauses)
        if not silent or _ALWAYS not in variance or _ALWAYS not in columns or min(variance.values()) < 0:
            raise DnnvssError("is no duration model", file=path, remedy=remedy)
        return cls(columns, a["weights"], variance, Pauses(*pauses))


# ---- context ---------------------------------------------------------------------------------------------------------


def phone_class(phone: str) -> str:
    """Return a phone's class for durations: its manner, ``-`` if voiceless; vowels tense, lax or gliding."""
    a = ARTICULATION[phone]
    if a.manner == "vowel":
        return "diphthong" if a.glide else "tense" if a.tense else "lax"
    return a.manner if a.voiced or a.manner == "silence" else f"{a.manner}-"


def spoken_contexts(alignment: Alignment, text: str) -> tuple[list[list[str]], np.ndarray]:
    """Return the context features of each spoken phone, and the durations (n,) in seconds.

    A row begins with the phone, its class and ``always``.

    Args:
        alignment: with tiers ``phones`` and ``words``.
        text: the words as written.
    """
    rows, seconds = _spoken_contexts(alignment, text)
    return list(rows), seconds


def _spoken_contexts(alignment: Alignment, text: str) -> tuple[Iterator[list[str]], np.ndarray]:
    """The same with the rows one by one."""
    tree = linguistic_tree(alignment, text)
    padded = (SILENCE, SILENCE, *alignment["phones"].labels, SILENCE, SILENCE)
    spoken = np.flatnonzero(tree.word >= 0)
    places = _places(tree)
    rows = (_context(padded[i : i + 5], tree, i, places[i]) for i in spoken.tolist())
    return rows, np.diff(alignment["phones"].edges)[spoken]


def _context(window: Sequence[str], tree: LinguisticTree, i: int, place: str) -> list[str]:
    """Return the feature names of segment ``i`` at a place in its syllable, in the middle of five labels."""
    far_left, left, own, right, far_right = window
    kind = phone_class(own)
    last_syllable = tree.syllable_in_word[i] == tree.syllables_in_word[i] - 1
    final = last_syllable and tree.word_in_phrase[i] == tree.words_in_phrase[i] - 1
    end = final and tree.phrase[i] == tree.phrases - 1
    ending = "end" if end else "final" if final else "word" if last_syllable else "inner"
    first = tree.syllable_in_word[i] == 0 and tree.word_in_phrase[i] == 0
    return [
        own, f"class={kind}", _ALWAYS, f"left={left}", f"right={right}", f"left class={phone_class(left)}",
        f"right class={phone_class(right)}", f"left class 2={phone_class(far_left)}",
        f"right class 2={phone_class(far_right)}", f"{kind} before {phone_class(right)}", f"{kind} {place}",
        f"{kind} {ending}", f"{own} {ending}", f"{own} {place}", f"{place} {ending}", f"first={first} {place}",
        f"syllables={min(int(tree.syllables_in_word[i]), 4)} {kind == 'lax'}",
        f"syllable={min(int(tree.syllable_in_word[i]), 3)}",
        f"phones={min(int(tree.phones_in_syllable[i]), 5)} {place}",
        f"words before={min(int(tree.word_in_phrase[i]), 6)}",
        f"words after={min(int(tree.words_in_phrase[i] - 1 - tree.word_in_phrase[i]), 6)}",
        f"word length={min(int(tree.phones_in_word[i]), 8)}", f"{left} {own}", f"{own} {right}",
    ]  # fmt: skip


def _places(tree: LinguisticTree) -> list[str]:
    """Where in its syllable each segment stands: onset, nucleus or coda."""
    nuclei = np.full(tree.syllables + 1, -1)  # the last place is that of silences
    vowels = np.flatnonzero(tree.vowel)[::-1]
    nuclei[tree.syllable[vowels]] = vowels  # the first of each syllable is written last
    onset = np.arange(len(tree.syllable)) < nuclei[tree.syllable]
    return ["nucleus" if v else "onset" if o else "coda" for v, o in zip(tree.vowel, onset, strict=True)]


def _matrix(contexts: Sequence[Sequence[str]], columns: Sequence[str]) -> np.ndarray:
    """Return the contexts as ones and zeros (n, len(columns)); names that are no column are passed over."""
    place = {name: k for k, name in enumerate(columns)}
    x = np.zeros((len(contexts), len(columns)))
    for row, names in enumerate(contexts):
        x[row, [place[name] for name in names if name in place]] = 1.0
    return x


# ---- fitting ---------------------------------------------------------------------------------------------------------


def _ridge(x: np.ndarray, y: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Return the weights under the penalty with the least squared error on groups left out."""
    centre = y.mean()
    folds = [(x[groups == g].T @ x[groups == g], x[groups == g].T @ (y[groups == g] - centre), groups == g)
             for g in np.unique(groups)]
    gram, moment = sum(f[0] for f in folds), sum(f[1] for f in folds)
    eye = np.eye(x.shape[1])

    def error(penalty: float) -> float:
        total = 0.0
        for part, part_moment, rows in folds:
            w = np.linalg.solve(gram - part + penalty * eye, moment - part_moment)
            total += float(((y[rows] - centre - x[rows] @ w) ** 2).sum())
        return total

    best = min(_PENALTIES, key=error) if len(folds) > 1 else _PENALTIES[-1]
    weights = np.linalg.solve(gram + best * eye, moment)
    weights[int(x.all(axis=0).argmax())] += centre  # the column "always"
    return weights


def _variances(contexts: Sequence[Sequence[str]], residual: np.ndarray) -> dict[str, float]:
    """Return the variance of the residual of each phone, class and of all, rare ones drawn toward the overall one."""
    overall = float((residual**2).mean())
    found = {}
    for level in range(3):
        names = np.array([row[level] for row in contexts])
        for name in sorted(set(names)):
            own = residual[names == name]
            found[str(name)] = max(float(((own**2).sum() + 20 * overall) / (len(own) + 20)), 1e-4)
    return found


def _pauses(utterances: Iterable[Utterance]) -> Pauses:
    """Return the pauses that the corpus makes after each kind of break, defaults where it has fewer than five."""
    seen: dict[bool, list[tuple[str, float]]] = {False: [], True: []}
    for utterance in utterances:
        punctuated = dict(enumerate(b for _, b in spoken_words(utterance.text)))
        tree = linguistic_tree(utterance.alignment, utterance.text)
        segments = list(utterance.alignment["phones"])
        spoken = np.flatnonzero(tree.word >= 0)
        agree = tree.words == len(punctuated)
        for a, b in pairwise(spoken):
            if tree.word[a] == tree.word[b]:
                continue
            between = segments[a + 1 : b]
            label = SILENCE if any(s.label == SILENCE for s in between) else SHORT_PAUSE if between else ""
            seen[bool(agree and punctuated[int(tree.word[a])])].append((label, sum(s.duration for s in between)))
    return Pauses(_usual(seen[False], None), _usual(seen[True], _DEFAULT_PAUSES["minor"]),
                  _usual(seen[True], _DEFAULT_PAUSES["major"], 1.6))


def _usual(seen: list[tuple[str, float]], default: tuple[str, float] | None,
           longer: float = 1.0) -> tuple[str, float] | None:
    paused = [(label, seconds) for label, seconds in seen if label]
    if len(seen) < 5:
        return default
    if len(paused) < len(seen) / 2:
        return default
    label = Counter(label for label, _ in paused).most_common(1)[0][0]
    return label, float(np.median([s for _, s in paused])) * longer


# ---- time lines ------------------------------------------------------------------------------------------------------


def _planned(sentence: Sentence, pauses: Pauses) -> Alignment:
    """Return the sentence's phones and pauses in order; phones last 0.1 s, pauses what they should."""
    phones: list[tuple[str, float]] = []
    words: list[tuple[str, float]] = []
    for number, word in enumerate(sentence.words):
        bare = [strip_stress(p) for p in word.phones]
        phones += [(p, 0.1) for p in bare]
        words.append((word.spoken, 0.1 * len(bare)))
        pause = _pause_after(word, pauses)
        if pause and number < len(sentence.words) - 1:
            phones.append(pause)
            words.append(("", pause[1]))
    return Alignment([_row("phones", phones), _row("words", words)])


def _pause_after(word: Word, pauses: Pauses) -> tuple[str, float] | None:
    usual = {"none": pauses.none, "minor": pauses.minor, "major": pauses.major}[word.break_after]
    if word.pause is None:
        return usual
    return ((usual or _DEFAULT_PAUSES["major"])[0], word.pause) if word.pause >= SHORTEST else None


def _asked(sentence: Sentence, plan: Alignment) -> np.ndarray:
    """Return for each pause of the plan whether the text gives its length, shape (pauses,)."""
    fixed, words = [], iter(sentence.words)
    current = None
    for label in plan["words"].labels:
        if label:
            current = next(words)
        else:
            fixed.append(current is not None and current.pause is not None)
    return np.array(fixed, dtype=bool)


def _emphasised(sentence: Sentence) -> np.ndarray:
    return np.array([float(w.emphasis) for w in sentence.words for _ in w.phones])


def _rates(sentence: Sentence) -> np.ndarray:
    """How fast the text asks for each phone, 1 as usual."""
    return np.array([w.rate for w in sentence.words for _ in w.phones])


def _stretched(mean: np.ndarray, deviation: np.ndarray, pauses: np.ndarray,
               wanted: float) -> tuple[np.ndarray, np.ndarray]:
    """Return durations (n,) and pauses whose sum is ``wanted`` seconds.

    Phones become ``exp(mean + r * deviation)``, pauses scale by ``exp(r * average deviation)``; ``r`` by bisection.
    """
    pause_deviation = float(deviation.mean())

    def lengths(r: float) -> tuple[np.ndarray, np.ndarray]:
        return np.maximum(np.exp(mean + r * deviation), SHORTEST), pauses * np.exp(r * pause_deviation)

    low, high = -40.0, 40.0
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if sum(map(np.sum, lengths(middle))) < wanted else (low, middle)
    seconds, pauses = lengths((low + high) / 2)
    correction = wanted / (seconds.sum() + pauses.sum())
    return seconds * correction, pauses * correction


def _row(name: str, labelled: Iterable[tuple[str, float]]) -> Tier:
    rows, time = [], 0.0
    for label, seconds in labelled:
        rows.append((time, time + seconds, label))
        time += seconds
    return Tier(name, rows)


def _laid_out(plan: Alignment, seconds: np.ndarray, pauses: np.ndarray, lead_in: float, lead_out: float) -> Alignment:
    spoken, silent = iter(seconds), iter(pauses)
    lengths = [float(next(silent if s.label in SILENCES else spoken)) for s in plan["phones"]]
    phones = list(zip(plan["phones"].labels, lengths, strict=True))
    owners = plan["words"].indices_at(plan["phones"].middles).tolist()
    inside: list[list[float]] = [[] for _ in plan["words"]]
    for owner, length in zip(owners, lengths, strict=True):
        inside[owner].append(length)
    words = [(label, sum(own)) for label, own in zip(plan["words"].labels, inside, strict=True)]
    before = [(SILENCE, lead_in)] if lead_in > 0 else []
    after = [(SILENCE, lead_out)] if lead_out > 0 else []
    edge = [[("", length) for _, length in row] for row in (before, after)]
    return Alignment([_row("phones", [*before, *phones, *after]), _row("words", [*edge[0], *words, *edge[1]])])

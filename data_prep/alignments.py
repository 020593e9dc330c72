"""Phone times of all recordings: from the user's files, or by the aligner, twice where a voice can be learnt."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from data_prep.adapt import heard_again, heard_at_last, learn_voice
from data_prep.align import given, heard, sharp
from data_prep.recipe import Preparation, Results
from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.speech.align import DOUBTFUL
from dnnvss.speech.align_onset import longest, runs_of
from dnnvss.text.lexicon import pronunciations
from dnnvss.timing import Alignment

GIVEN = 4
"""Version of how given alignments are read."""

ALIGNER = 5
"""Version of the aligner for everybody: alignments of earlier ones are made anew."""

SECOND = 6
"""Version of what is made of them."""

WEAK, WRONG = -15.0, -6.0
"""Fit with the talker's own voice below which a word is noted, and mean fit of its words below which an utterance is
dropped.

Measured on GRID: sentences have means from -1.7 to -0.2, other sentences in their place -20 to -5.5; 99 % of the words
are above -6, half of the letters put in place of another below -17."""


def aligned(run: Preparation, made: Results, late: Mapping[str, float]) -> Results:
    """Return the phone times of every utterance: from the user's file, or heard, twice where a voice can be learnt."""
    given_tasks, tasks = _alignment_tasks(run, made, late)
    results = run.take(run.shop.run("given alignment", given, given_tasks, GIVEN)) if given_tasks else {}
    for name in [n for n, result in results.items() if "other" in result]:
        run.outcomes[name].notes.append(results.pop(name)["other"])
        tasks[name] = {**{k: given_tasks[name][k] for k in ("words", "frames", "rate", "audio")}, "bounds": [],
                       "slack": run.recipe.slack}
    for name, result in results.items():
        run.outcomes[name].notes += result["notes"]
    tried = run.shop.run("alignment", heard, tasks, ALIGNER) if tasks else {}
    first = {n: result for n, result in tried.items() if "dropped" not in result}
    bare = {n: {k: v for k, v in t.items() if k != "slack"} for n, t in tasks.items()}
    voice = learn_voice(run.shop, {n: bare[n] for n in first}, first) if run.recipe.adapt else None
    if voice is None:
        first = run.take({n: r for n, r in tried.items() if n not in first}) | _sharp(run, bare, first)
    else:
        own = str(voice.relative_to(run.shop.out))
        again = {n: {**bare[n], "voice": own, "scores": r["scores"], "attempt": r["attempt"]} for n, r in first.items()}
        last = {n: {**bare[n], "voice": own, "refused": r["unfit"]} for n, r in tried.items() if "unfit" in r}
        run.take({n: r for n, r in tried.items() if n not in first and n not in last})
        first = run.take(run.shop.run("own voice", heard_again, again, SECOND)
                         | run.shop.run("second chance", heard_at_last, last, SECOND))
    for name, result in first.items():
        run.outcomes[name].notes += _doubts(result, [w for w, _ in tasks[name]["words"]], run.recipe.far)
        if (fit := float(np.mean(result.get("fit") or [0.0]))) < WRONG:
            run.drop(name, f"its text is not what the talker says (fit {fit:.1f}, {WRONG:g} at least)")
    return results | first


def _sharp(run: Preparation, tasks: Mapping[str, dict[str, Any]], first: Results) -> Results:
    """Return the alignments with their edges where the sound changes: no voice of the talker's puts them right."""
    limits = longest([runs_of(Alignment.from_json(r["alignment"])) for r in first.values()])
    kept = {n: {"audio": tasks[n]["audio"], "first": r, "bounds": tasks[n]["bounds"], "limits": limits}
            for n, r in first.items()}
    return run.shop.run("sharp", sharp, kept, SECOND)


def _alignment_tasks(run: Preparation, made: Results, late: Mapping[str, float]
                     ) -> tuple[dict[str, dict[str, Any]], dict[str, dict[str, Any]]]:
    """Return the tasks of the utterances whose alignment is given, and of those that are to be aligned.

    Times that the user gave belong to the sound of the file, from its first sample on; they move with it.
    """
    recipe, known, tasks = run.recipe, {}, {}
    for s in run.alive():
        try:
            words = [(w, pronunciations(w, recipe.info.variant, recipe.lexicon)) for w in s.words]
        except DnnvssError as error:
            run.drop(s.id, str(error))
            continue
        task = {"words": words, "frames": made[s.id]["frames"], "rate": made[s.id]["rate"]}
        if s.alignment:
            sound = made[s.id]["audio"]
            known[s.id] = {**task, "path": s.alignment, "late": late.get(s.id, 0.0), "text": s.text,
                           "starts": made[s.id].get("starts", 0.0), "variant": recipe.info.variant,
                           "audio": files.inside(run.shop.out, sound) if sound else None}
        else:
            bounds = [(a - late[s.id], b - late[s.id]) for a, b in s.bounds]
            audio = files.inside(run.shop.out, made[s.id]["audio"])
            tasks[s.id] = {**task, "audio": audio, "bounds": bounds, "slack": recipe.slack}
    return known, tasks


def _doubts(result: dict[str, Any], words: Sequence[str], far: float) -> list[str]:
    notes = []
    wrong = [(abs(late), word, late) for word, late in zip(words, result["late"], strict=False) if abs(late) > far]
    if wrong:
        _, word, late = max(wrong)
        notes.append(f"{word!r} is heard {abs(late):.2f} s {'after' if late > 0 else 'before'} its given time")
    weak = [(fit, word) for word, fit in zip(words, result.get("fit", []), strict=False) if fit < WEAK]
    if weak:
        fit, word = min(weak)
        notes.append(f"{word!r} hardly sounds like this talker's (fit {fit:.1f})")
    return notes


def doubtful_words(words: Sequence[str], result: Mapping[str, Any]) -> list[str]:
    """Which words hardly fit the sound, by the aligner's score and by the talker's own voice.

    Args:
        words: of an utterance.
        result: of its alignment; with neither, none is doubtful.
    """
    low = [score < DOUBTFUL for score in result.get("scores", [])] or [False] * len(words)
    weak = [fit < WEAK for fit in result.get("fit", [])] or [False] * len(words)
    return [word for word, a, b in zip(words, low, weak, strict=False) if a or b]

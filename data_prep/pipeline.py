"""From the recordings of an importer to a prepared corpus: media, landmarks, check-up, alignment, report."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

from data_prep.alignments import aligned, doubtful_words
from data_prep.checks import cleaned, examined, found
from data_prep.digests import with_digests
from data_prep.ready import made_ready
from data_prep.recipe import Preparation, Recipe, Results, Source
from data_prep.recordings import brought, recorded, usual
from data_prep.report import Outcome, counts, write_report
from data_prep.sounds import lateness_of, sounds
from data_prep.splits import completed, lacking, resolved
from data_prep.stages import Workshop
from data_prep.transcribing import TRANSCRIPTS, write_guesses
from dnnvss import files
from dnnvss.corpus import Corpus, Utterance
from dnnvss.errors import DnnvssError
from dnnvss.timing import Alignment

Then = Callable[[Iterable[Source], Recipe, Workshop], Path]
"""What an importer does with what it found: it prepares the corpus, or takes a first look."""


def prepare(sources: Iterable[Source], recipe: Recipe, shop: Workshop) -> Path:
    """Return the folder of the prepared corpus after every stage has run.

    Raises:
        DnnvssError: nothing is left, an output cannot be written, splits that are not given cannot be drawn, or
            (strict) an utterance would be dropped.
    """
    sources = list(sources)
    if recipe.lacking is not None:
        raise recipe.lacking
    if not sources:
        raise DnnvssError("there is no recording to prepare", remedy="Set corpus.raw to the folder with the recordings")
    cuts = made_ready(sources, recipe, shop)
    sources, notes = cuts.sources, list(recipe.told)
    if recipe.splits:  # a mistake in them is said before hours of work
        splits, said = resolved(recipe.splits, [s.id for s in sources])
        recipe, notes = replace(recipe, splits=splits), notes + said
        completed(recipe.splits, [s.id for s in sources], recipe.val, recipe.test, recipe.stratum)
    run = Preparation(sources, recipe, shop, {s.id: Outcome(s.id, list(s.notes)) for s in sources},
                      [*cuts.told, *notes], cuts.left_out)
    for note in [*cuts.told, *notes]:
        print(note)
    try:
        for source in sources:
            if problem := source.problem or unfit_id(source.id):
                run.drop(source.id, problem)
        made = recorded(run)
        found(run, made)
        size, rate = usual(run, made)
        made = brought(run, made, size, rate)
        bad = examined(run, made, size)
        late = lateness_of(run, made, bad)
        made = sounds(run, made, late)
        timed = aligned(run, made, late)
        clean = cleaned(run, made, timed, bad)
        utterances = with_digests(shop, _utterances(run, made, timed, clean))
        _guesses(run, timed)
        return _finished(run, utterances, size, rate)
    finally:
        shop.sweep()


def unfit_id(name: str) -> str:
    """Why an id cannot stand on a line of a split file, or name files everywhere; nothing where it can."""
    if (shown := files.printable(name)) != name:
        return f"the name {shown} is not UTF-8: rename its files"
    if name != name.strip() or len(name.splitlines()) != 1:
        return f"the name {name!r} begins or ends with a space, or holds a line break: rename its files"
    try:
        files.check_name(f"{name}.json", Path())
    except DnnvssError:
        return f"not every system has files of the name {name!r}: rename its files"
    return ""


def _utterances(run: Preparation, made: Results, timed: Results, clean: Results) -> list[Utterance]:
    return [
        Utterance(s.id, s.text, Alignment.from_json(timed[s.id]["alignment"]), made[s.id]["video"], made[s.id]["audio"],
                  clean[s.id]["landmarks"], Fraction(made[s.id]["rate"]), made[s.id]["frames"])
        for s in run.alive()
    ]


def _guesses(run: Preparation, timed: Results) -> None:
    """Set off what was written down by a machine and hardly fits the sound."""
    guessed = [s for s in run.sources if s.guessed and s.text]
    if not guessed:
        return
    doubtful = {s.id: doubtful_words(s.words, timed.get(s.id, {})) for s in guessed}
    for name, words in doubtful.items():
        told = f", doubtful: {', '.join(words)}" if words else ""
        run.outcomes[name].notes.append(f"its text was written down by a machine: read it{told}")
    path = write_guesses(run.shop.out, {s.id: s.text for s in guessed}, doubtful, run.outcomes.values())
    print(f"Read what was written down by a machine, mend it in {run.shop.out / TRANSCRIPTS}, run this again: {path}")


def _finished(run: Preparation, utterances: list[Utterance], size: tuple[int, int], rate: Fraction) -> Path:
    """Write the records, splits and report, say what was written, and return the folder."""
    out, recipe = run.shop.out, run.recipe
    report = write_report(out, run.outcomes.values(), run.found, run.left_out)
    if not utterances:
        run.nothing_left()
    kept = {u.id for u in utterances}
    splits = completed(recipe.splits, kept, recipe.val, recipe.test, recipe.stratum)
    if recipe.splits and (drawn := lacking(recipe.splits, kept)):
        print(f"splits drawn, as no utterance was given for them: {', '.join(drawn)}")
    Corpus.write(out, replace(recipe.info, size=size, rate=str(rate)), utterances, splits)
    number = counts(run.outcomes.values())
    print(f"{len(kept)} utterances ({number['repaired']} of them repaired), {number['dropped']} dropped: {report}")
    print(f"Corpus {recipe.info.name}: {out}")
    return out

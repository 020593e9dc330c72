"""From the recordings of an importer to a prepared corpus: media, landmarks, check-up, alignment, report."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from data_prep.adapt import heard_again, heard_at_last, learn_voice
from data_prep.align import given, heard, sharp
from data_prep.digests import with_digests
from data_prep.evening import evened, square_size, told
from data_prep.landmarks import read_raw, write_clean
from data_prep.media import media
from data_prep.points import FOUND, VERSION, find_points
from data_prep.recipe import Preparation, Recipe, Results, Source
from data_prep.report import Outcome, counts, write_report
from data_prep.splits import completed, lacking, resolved
from data_prep.stages import FOLDER, Workshop
from data_prep.sync import FEWEST, find_sync, in_step
from data_prep.unfilmed import measured, sounded, told_rate
from dnnvss import files
from dnnvss.corpus import Corpus, Utterance, checkup
from dnnvss.errors import DnnvssError
from dnnvss.phones import SILENCES
from dnnvss.text.lexicon import pronunciations
from dnnvss.timing import Alignment, FrameClock, fill_invalid


def prepare(sources: Iterable[Source], recipe: Recipe, shop: Workshop) -> Path:
    """Return the folder of the prepared corpus after every stage has run.

    Raises:
        DnnvssError: nothing is left, an output cannot be written, splits that are not given cannot be drawn, or
            (strict) an utterance would be dropped.
    """
    sources = list(sources)
    if not sources:
        raise DnnvssError("there is no recording to prepare", remedy="Set corpus.raw to the folder with the recordings")
    notes: list[str] = []
    if recipe.splits:  # a mistake in them is said before hours of work
        splits, notes = resolved(recipe.splits, [s.id for s in sources])
        recipe = replace(recipe, splits=splits)
        completed(recipe.splits, [s.id for s in sources], recipe.val, recipe.test, recipe.stratum)
    run = Preparation(sources, recipe, shop, {s.id: Outcome(s.id, list(s.notes)) for s in sources}, notes)
    for note in notes:
        print(note)
    try:
        for source in sources:
            if problem := source.problem or _unfit_id(source.id):
                run.drop(source.id, problem)
        made = _media(run)
        _found(run, made)
        size, rate = _usual(run, made)
        made = _evened(run, made, size, rate)
        bad = _examined(run, made, size)
        late = _late(run, made, bad)
        made = _sounds(run, made, late)
        timed = _aligned(run, made, late)
        cleaned = _cleaned(run, made, timed, bad)
        utterances = with_digests(shop, _utterances(run, made, timed, cleaned))
        return _finished(run, utterances, size, rate)
    finally:
        shop.sweep()


def _unfit_id(name: str) -> str:
    """Why an id cannot stand on a line of a split file; nothing where it can."""
    if (shown := files.printable(name)) != name:
        return f"the name {shown} is not UTF-8: rename its files"
    if name == name.strip() and len(name.splitlines()) == 1:
        return ""
    return f"the name {name!r} begins or ends with a space, or holds a line break: rename its files"


MEDIA = 3
"""Version of what the stage of the recordings leaves behind."""


def _media(run: Preparation) -> Results:
    tasks = {s.id: {"video": s.video, "delay": s.delay, **({"sound": s.sound} if s.sound else {})}
             for s in run.alive() if s.video is not None}
    made = run.take(run.shop.run("media", media, tasks, MEDIA)) if tasks else {}
    return made | _unfilmed(run, made)


def _found(run: Preparation, made: Results) -> None:
    """Find the landmarks of the videos that bring none."""
    recipe, shop = run.recipe, run.shop
    if recipe.task is None:
        return
    tasks = {s.id: {"video": s.video, "sound": files.inside(shop.out, made[s.id]["sound"]), "rate": made[s.id]["rate"],
                    "task": recipe.task} for s in run.alive() if s.video is not None and not s.landmarks}
    for name, found in run.take(shop.run(FOUND, find_points, tasks, VERSION)).items():
        run.outcomes[name].notes.extend(found["notes"])
    run.found.append(f"the landmarks of {len(tasks)} recordings were found in their pictures")
    for k, source in enumerate(run.sources):
        if source.id in tasks:
            run.sources[k] = replace(source, landmarks=(shop.out / FOLDER / FOUND / f"{source.id}.npz",))


def _unfilmed(run: Preparation, filmed: Results) -> Results:
    """Return what is known of the recordings without video; the rate is one for all of them."""
    bare = {s.id: s for s in run.alive() if s.video is None}
    if not bare:
        return {}
    dimensions = run.recipe.info.dimensions
    own = {i: {"landmarks": s.landmarks, "dimensions": dimensions} for i, s in bare.items()}
    counted = run.take(run.shop.run("stamps", measured, own))
    if not counted:
        return {}
    rates = Counter(Fraction(m["rate"]) for m in filmed.values()).most_common(1)
    clock, whence = told_rate(counted, run.recipe.rate, rates[0][0] if rates else None)
    tasks = {i: {**own[i], "frames": c["frames"], "rate": str(clock), "stamps": "stamps" in whence,
                 "sound": bare[i].sound, "delay": bare[i].delay} for i, c in counted.items()}
    for name, c in counted.items():
        if c["span"] and abs(c["span"][0] / c["span"][1] / float(clock.rate) - 1) > OFF_RATE:
            run.outcomes[name].notes.append(f"its time stamps tell {c['span'][0] / c['span'][1]:.3g} frames a second, "
                                            f"{float(clock.rate):g} are taken")
    silent = sum(s.sound is None for s in bare.values())
    run.found.append(f"{len(bare)} of {len(run.sources)} recordings are landmarks without video"
                     + (f", {silent} of them without sound" if silent else ""))
    run.found.append(f"landmarks without video have {float(clock.rate):.6g} frames a second ({whence})")
    return run.take(run.shop.run("sounded", sounded, tasks))


OFF_RATE = 0.02
"""Share by which the rate of an utterance's time stamps may differ from the one that is taken before it is noted."""


def _usual(run: Preparation, made: Results) -> tuple[tuple[int, int], Fraction]:
    """The size and rate that most recordings have; landmarks without video at another rate are dropped."""
    filmed = [m for m in made.values() if "pixel" in m]
    rates = {name: Fraction(m["rate"]) for name, m in made.items() if "pixel" not in m}
    if not filmed and not rates:
        _nothing_left(run)
    sizes = Counter(square_size(tuple(m["size"]), Fraction(m["pixel"])) for m in filmed)
    size = sizes.most_common(1)[0][0] if sizes else run.recipe.size or (0, 0)
    rate = Counter([Fraction(m["rate"]) for m in filmed] or rates.values()).most_common(1)[0][0]
    for name, other in rates.items():
        if other != rate:
            run.drop(name, f"its landmarks are at {other} frames a second, the videos of the corpus at {rate}")
    return size, rate


def _evened(run: Preparation, made: Results, size: tuple[int, int], rate: Fraction) -> Results:
    """What is known of the recordings after their videos were brought to one size and rate."""
    tasks = {s.id: {"video": s.video, **{k: m[k] for k in ("size", "pixel", "plain", "starts")}, "target": list(size),
                    "rate": str(rate), **({"sound": s.sound} if s.sound else {})}
             for s in run.alive() if "pixel" in (m := made[s.id])}
    seen = run.take(run.shop.run("video", evened, tasks, MEDIA)) if tasks else {}
    for name, result in seen.items():
        run.outcomes[name].notes += told(made[name], result)
        if result["gaps"]:
            run.outcomes[name].repair(f"no pictures were recorded in {result['gaps']} frames")
    return {n: {**m, "source": m} | seen.get(n, {"video": None}) for n, m in made.items()}


def _examined(run: Preparation, made: Results, size: tuple[int, int]) -> dict[str, np.ndarray]:
    """Return for each utterance the frames (F,) that show no face of the talker, and say why in the report.

    Where there is no video, that is what the landmarks tell alone.
    """
    dimensions = run.recipe.info.dimensions
    stages = run.shop.out / FOLDER
    tasks = {s.id: {"landmarks": s.landmarks, "scale": run.recipe.scale, "frames": made[s.id]["source"]["frames"],
                    "size": made[s.id]["source"]["size"] if made[s.id]["video"] else list(size),
                    "dimensions": dimensions,
                    **({"shown": stages / "video" / f"{s.id}.npz", "place": made[s.id]["place"]}
                       if made[s.id]["video"] else {})} for s in run.alive()}
    if run.recipe.rows is not None:
        tasks = {i: {**task, "rows": run.recipe.rows} for i, task in tasks.items()}
    counted = run.take(run.shop.run("landmarks", read_raw, tasks, MEDIA))
    if shares := sum("shares" in c for c in counted.values()):
        run.found.append(f"the landmarks of {shares} recordings are shares of the picture: taken times its size")
    usual = Counter(c["points"] for c in counted.values()).most_common(1)
    for name, c in counted.items():
        if c["rows"] != tasks[name]["frames"]:
            run.outcomes[name].notes.append(f"has {c['rows']} rows of landmarks for {tasks[name]['frames']} frames")
        if c["faces"] > 1:
            run.outcomes[name].notes.append(f"{c['faces']} faces were tracked; the largest is taken")
        if c["points"] != usual[0][0]:
            run.drop(name, f"has {c['points']} landmarks a frame, most of the corpus has {usual[0][0]}")
    if usual:
        _check_groups(run.recipe.info.landmark_groups, usual[0][0])
    names = [s.id for s in run.alive()]
    limits = run.recipe.limits
    clips = {n: run.shop.arrays("media", n)["thumbnails"][run.shop.arrays("video", n)["index"]]
             for n in names if made[n]["video"]}
    marks = {n: run.shop.arrays("landmarks", n) for n in names}
    if not names:
        _nothing_left(run)
    whole = {n: np.zeros(made[n]["frames"], bool) for n in names}
    broken = whole | (checkup.broken_pictures(clips, limits) if clips else {})
    jumps = whole | ({n: m & ~broken[n] for n, m in checkup.jumps(clips, limits).items()} if clips else {})
    outside = whole | ({n: marks[n]["valid"] & checkup.outside(marks[n]["points"], size, limits) for n in names}
                       if dimensions == 2 and min(size) > 0 else {})
    run.found.append(f"{marks[names[0]]['points'].shape[1]} landmarks a frame, {dimensions} coordinates in "
                     f"{run.recipe.info.unit}")
    valid = {n: marks[n]["valid"] & ~broken[n] & ~outside[n] for n in names}
    ghosts = checkup.ghosts({n: marks[n]["points"] for n in names}, valid, limits)
    for name in names:
        for what, mask in (("broken pictures", broken[name]), ("landmarks not found", ~marks[name]["valid"]),
                           ("landmarks outside the picture", outside[name]),
                           ("landmarks that are not the face", ghosts[name])):
            if mask.any():
                run.outcomes[name].repair(f"{what} in {mask.sum()} frames ({_ranges(mask)})")
        if jumps[name].any():
            run.outcomes[name].notes.append(f"the picture jumps at frame {_ranges(jumps[name])}; damaged before?")
            if ghosts[name].sum() >= DAMAGED:
                run.drop(name, "pictures damaged for long: they jump, and the landmarks leave the face")
    for name, distance in (checkup.off_colour(clips, limits) if clips else {}).items():
        run.outcomes[name].notes.append(f"off colour throughout ({distance:.0f} robust sd from the corpus)")
    return {n: broken[n] | outside[n] | ghosts[n] for n in names}


def _check_groups(groups: Mapping[str, tuple[int, int]], points: int) -> None:
    """Refuse groups of landmarks that go beyond the points of a frame."""
    for name, (first, end) in groups.items():
        if end > points:
            raise DnnvssError(f"the group of landmarks {name} runs from {first} to {end}, and a frame has {points}",
                              remedy="Describe the groups in landmarks.json as the landmarks have them")


def _ranges(mask: np.ndarray) -> str:
    """Return the runs of True as text, such as ``0-11, 36``."""
    index = np.flatnonzero(mask)
    runs = np.split(index, np.flatnonzero(np.diff(index) > 1) + 1)
    return ", ".join(f"{r[0]}-{r[-1]}" if len(r) > 1 else f"{r[0]}" for r in runs)


LATE = 0.06
"""Seconds by which sound is late or early from which the report says so."""


def _late(run: Preparation, made: Results, bad: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Return by how many seconds each utterance's sound is late beside its picture; 0 where that is not measured."""
    names = [s.id for s in run.alive() if made[s.id]["sound"]]
    if not run.recipe.sync or not names:
        return dict.fromkeys(names, 0.0)
    seen = {}
    for name in names:
        marks = run.shop.arrays("landmarks", name)
        if (good := marks["valid"] & ~bad[name]).any():
            seen[name] = fill_invalid(marks["points"][..., :2], good), good
    if len(seen) < FEWEST:
        print(f"sound and picture are taken as they are: {len(seen)} clips are too few to tell ({FEWEST} needed)")
        return dict.fromkeys(names, 0.0)
    sounds = {name: made[name]["sound"] for name in seen}
    rate = float(Fraction(made[names[0]]["rate"]))
    found = find_sync(run.shop, sounds, seen, run.recipe.info.landmark_groups, rate)
    print(f"sound and picture: {1000 * found.spread:.0f} ms apart (standard deviation over clips), "
          f"known to {1000 * found.error:.0f} ms; {len(found.unknown)} clips do not tell")
    for name in found.unknown:
        run.outcomes[name].notes.append("its lips do not tell whether its sound is late (left as it is)")
    for name, late in found.late.items():
        if abs(late) > LATE:
            where = "late" if late > 0 else "early"
            run.outcomes[name].notes.append(f"its sound was {1000 * abs(late):.0f} ms {where} (moved)")
    return {name: found.late.get(name, 0.0) for name in names}


def _sounds(run: Preparation, made: Results, late: Mapping[str, float]) -> Results:
    """Return what is known of the recordings with the path of the sound that is in step with the picture."""
    tasks = {s.id: {"sound": files.inside(run.shop.out, made[s.id]["sound"]), "late": late[s.id],
                    "seconds": float(made[s.id]["frames"] / Fraction(made[s.id]["rate"]))}
             for s in run.alive() if made[s.id]["sound"]}
    moved = run.take(run.shop.run("sound", in_step, tasks)) if tasks else {}
    return {s.id: made[s.id] | moved.get(s.id, {"audio": None}) for s in run.alive()}


def _aligned(run: Preparation, made: Results, late: Mapping[str, float]) -> Results:
    """Return the phone times of every utterance: from the user's file, or heard, twice where a voice can be learnt."""
    given_tasks, tasks = _alignment_tasks(run, made, late)
    results = run.take(run.shop.run("given alignment", given, given_tasks, GIVEN)) if given_tasks else {}
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
        first = run.take(run.shop.run("own voice", heard_again, again, ALIGNER)
                         | run.shop.run("second chance", heard_at_last, last, ALIGNER))
    for name, result in first.items():
        run.outcomes[name].notes += _doubts(result, [w for w, _ in tasks[name]["words"]], run.recipe.far)
        if (fit := float(np.mean(result.get("fit") or [0.0]))) < WRONG:
            run.drop(name, f"its text is not what the talker says (fit {fit:.1f}, {WRONG:g} at least)")
    return results | first


def _sharp(run: Preparation, tasks: Mapping[str, dict[str, Any]], first: Results) -> Results:
    """Return the alignments with their edges where the sound changes: no voice of the talker's puts them right."""
    kept = {n: {"audio": tasks[n]["audio"], "first": r, "bounds": tasks[n]["bounds"]} for n, r in first.items()}
    return run.shop.run("sharp", sharp, kept, ALIGNER)


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


DAMAGED = 5
"""Frames of landmarks off the face from which a clip whose picture jumps is taken to be damaged."""

GIVEN = 1
"""Version of how given alignments are read."""

ALIGNER = 5
"""Version of the aligner: alignments of earlier ones are made anew."""

WEAK, WRONG = -15.0, -6.0
"""Fit with the talker's own voice below which a word is noted, and mean fit of its words below which an utterance is
dropped.

Measured on GRID: sentences have means from -1.7 to -0.2, other sentences in their place -20 to -5.5; 99 % of the words
are above -6, half of the letters put in place of another below -17."""


def _cleaned(run: Preparation, made: Results, timed: Results, bad: Mapping[str, np.ndarray]) -> Results:
    """Write the landmarks that are left; drop utterances with too few of them over speech."""
    tasks = {}
    for s in run.alive():
        marks = run.shop.out / FOLDER / "landmarks" / f"{s.id}.npz"
        good = run.shop.arrays("landmarks", s.id)["valid"] & ~bad[s.id]
        phones = Alignment.from_json(timed[s.id]["alignment"])["phones"]
        spoken = [p for p in phones if p.label not in SILENCES]
        if not spoken:
            run.drop(s.id, "its alignment holds no speech")
            continue
        clock = FrameClock(made[s.id]["rate"])
        speech = good[clock.edge(spoken[0].start): clock.edge(spoken[-1].end)]
        if not good.any() or speech.mean() < run.recipe.speech_valid:
            run.drop(s.id, f"only {speech.sum()} of the {len(speech)} frames of speech have landmarks to be trusted")
        else:
            tasks[s.id] = {"marks": marks, "bad": "".join("10"[int(g)] for g in good)}
    return run.take(run.shop.run("clean landmarks", write_clean, tasks))


def _utterances(run: Preparation, made: Results, timed: Results, cleaned: Results) -> list[Utterance]:
    return [
        Utterance(s.id, s.text, Alignment.from_json(timed[s.id]["alignment"]), made[s.id]["video"], made[s.id]["audio"],
                  cleaned[s.id]["landmarks"], Fraction(made[s.id]["rate"]), made[s.id]["frames"])
        for s in run.alive()
    ]


def _finished(run: Preparation, utterances: list[Utterance], size: tuple[int, int], rate: Fraction) -> Path:
    """Write the records, splits and report, say what was written, and return the folder."""
    out, recipe = run.shop.out, run.recipe
    report = write_report(out, run.outcomes.values(), run.found)
    if not utterances:
        _nothing_left(run)
    kept = {u.id for u in utterances}
    splits = completed(recipe.splits, kept, recipe.val, recipe.test, recipe.stratum)
    if recipe.splits and (drawn := lacking(recipe.splits, kept)):
        print(f"splits drawn, as no utterance was given for them: {', '.join(drawn)}")
    Corpus.write(out, replace(recipe.info, size=size, rate=str(rate)), utterances, splits)
    number = counts(run.outcomes.values())
    print(f"{len(kept)} utterances ({number['repaired']} of them repaired), {number['dropped']} dropped: {report}")
    print(f"Corpus {recipe.info.name}: {out}")
    return out


def _nothing_left(run: Preparation) -> NoReturn:
    report = write_report(run.shop.out, run.outcomes.values())
    name, outcome = next(iter(run.outcomes.items()))
    raise DnnvssError(f"none of the {len(run.outcomes)} utterances can be used; the first one, {name}: "
                      f"{'; '.join(outcome.reasons)}", file=report, remedy="See the report for the others")

"""The recordings of a corpus: their pictures and sounds read, and brought to one size and one clock."""

from collections import Counter
from fractions import Fraction

from data_prep.evening import evened, square_size, told
from data_prep.media import media
from data_prep.recipe import Preparation, Results
from data_prep.unfilmed import measured, sounded, told_rate

MEDIA = 7
"""Version of what the stage of the recordings leaves behind."""

OFF_RATE = 0.02
"""Share by which the rate of an utterance's time stamps may differ from the one that is taken before it is noted."""


def recorded(run: Preparation) -> Results:
    """What is known of every recording: of its pictures and its sound, or of its landmarks alone."""
    tasks = {s.id: {"video": s.video, "delay": s.delay, **({"sound": s.sound} if s.sound else {})}
             for s in run.alive() if s.video is not None}
    made = run.take(run.shop.run("media", media, tasks, MEDIA)) if tasks else {}
    return made | _unfilmed(run, made)


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


def usual(run: Preparation, made: Results) -> tuple[tuple[int, int], Fraction]:
    """The size and rate that most recordings have; landmarks without video at another rate are dropped."""
    filmed = [m for m in made.values() if "pixel" in m]
    rates = {name: Fraction(m["rate"]) for name, m in made.items() if "pixel" not in m}
    if not filmed and not rates:
        run.nothing_left()
    sizes = Counter(square_size(tuple(m["size"]), Fraction(m["pixel"])) for m in filmed)
    size = sizes.most_common(1)[0][0] if sizes else run.recipe.size or (0, 0)
    rate = Counter([Fraction(m["rate"]) for m in filmed] or rates.values()).most_common(1)[0][0]
    for name, other in rates.items():
        if other != rate:
            run.drop(name, f"its landmarks are at {other} frames a second, the videos of the corpus at {rate}")
    return size, rate


def brought(run: Preparation, made: Results, size: tuple[int, int], rate: Fraction) -> Results:
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

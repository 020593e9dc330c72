"""The sounds of a corpus, in step with their pictures."""

from collections.abc import Mapping
from fractions import Fraction

import numpy as np

from data_prep.recipe import Preparation, Results
from data_prep.sync import FEWEST, find_sync, in_step
from dnnvss import files
from dnnvss.timing import fill_invalid

LATE = 0.06
"""Seconds by which sound is late or early from which the report says so."""


def lateness_of(run: Preparation, made: Results, bad: Mapping[str, np.ndarray]) -> dict[str, float]:
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
    if not any(found.late.values()):
        print("sound and picture are left as they are: what they are apart is within what is known")
    for name in found.unknown:
        run.outcomes[name].notes.append("its lips do not tell whether its sound is late (left as it is)")
    for name, late in found.late.items():
        if abs(late) > LATE:
            where = "late" if late > 0 else "early"
            run.outcomes[name].notes.append(f"its sound was {1000 * abs(late):.0f} ms {where} (moved)")
    return {name: found.late.get(name, 0.0) for name in names}


def sounds(run: Preparation, made: Results, late: Mapping[str, float]) -> Results:
    """Return what is known of the recordings with the path of the sound that is in step with the picture."""
    tasks = {s.id: {"sound": files.inside(run.shop.out, made[s.id]["sound"]), "late": late[s.id],
                    "seconds": float(made[s.id]["frames"] / Fraction(made[s.id]["rate"]))}
             for s in run.alive() if made[s.id]["sound"]}
    moved = run.take(run.shop.run("sound", in_step, tasks)) if tasks else {}
    return {s.id: made[s.id] | moved.get(s.id, {"audio": None}) for s in run.alive()}

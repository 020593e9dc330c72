"""The page of a first look."""

import html
from collections import Counter
from collections.abc import Iterable, Sequence
from importlib import resources

from data_prep.look_pictures import faces, wave
from data_prep.looked import Look
from data_prep.sample import PART, Sample
from dnnvss.pages import bars, document, wide
from dnnvss.phones import SPOKEN
from dnnvss.text.coverage import EXAMPLES, next_prompts, unsaid

_SHOWN = 60
"""Recordings that are named as not usable; the others are counted."""
_NAMED = 24
"""Triphones that are named as missing."""


def page(look: Look, took: float) -> str:
    """The page as text, with all of its pictures in it.

    Args:
        look: what was found.
        took: seconds that it took.
    """
    title = f"First look: {look.name}"
    parts = [f"<h1>{html.escape(title)}</h1>", f'<p class="lead">{html.escape(_lead(look, took))}</p>', _sums(look),
             _lacking(look), "<h2>What was found</h2>", _found(look), _recordings(look), _left_out(look), _sounds(look),
             _time(look)]
    return document(title, "\n".join(p for p in parts if p),
                    resources.files("data_prep").joinpath("look.css").read_text("utf-8"))


def _lead(look: Look, took: float) -> str:
    looked = len(look.sample.sources) if look.sample else 0
    return (f"{looked} of {len(look.sources)} recordings were prepared for this page in {took:.0f} seconds. "
            "Nothing was changed, and nothing is kept but the page.")


def _sums(look: Look) -> str:
    """The numbers that matter most, large."""
    sounds = f"{len(SPOKEN) - len(look.coverage.missing)} of {len(SPOKEN)}" if look.coverage.heard else "unknown"
    rows = [(f"{look.usable} of {len(look.sources)}", "recordings that can be used, as far as files tell"),
            (_duration(look.seconds), "they last"),
            (_duration(look.speech), "of speech with a face, by the sample"),
            (sounds, "sounds of English in the texts"),
            (_duration(sum(look.stages.values())) if look.stages else "unknown", "to prepare all of them")]
    return '<div class="sums">' + "".join(f"<div><b>{html.escape(v)}</b><span>{html.escape(t)}</span></div>"
                                          for v, t in rows) + "</div>"


def _duration(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def _lacking(look: Look) -> str:
    if look.lacking is None:
        return ""
    return f'<p class="bad">{html.escape(str(look.lacking))} Pictures below are without points.</p>'


def _found(look: Look) -> str:
    """Files by kind, and pictures and sounds by what headers say."""
    read = look.headers.values()
    rows = [("files", ", ".join(f"{count} {kind}" for kind, count in look.kinds.items())),
            ("pictures", _counted(h.pictures or "none" for h in read)),
            ("sound", _counted(h.sound or "none" for h in read)),
            ("landmarks", _how(look, [bool(s.landmarks) for s in look.sources], "in files", "found in the pictures")),
            ("phone times", _how(look, [s.alignment is not None for s in look.sources], "in files",
                                 "heard, from the words")),
            ("length", _lengths([h.seconds for h in read if h.seconds]))]
    return "<dl>" + "".join(f"<dt>{t}</dt><dd>{html.escape(v or 'none')}</dd>" for t, v in rows) + "</dl>"


def _counted(values: Iterable[str]) -> str:
    found = Counter(values).most_common()
    more = f"; {sum(n for _, n in found[6:])} others" if len(found) > 6 else ""
    return "; ".join(f"{value} ({count})" if len(found) > 1 else value for value, count in found[:6]) + more


def _how(look: Look, given: Sequence[bool], files: str, made: str) -> str:
    count, whole = sum(given), len(look.sources)
    return made if not count else files if count == whole else f"{files} for {count}, {made} for {whole - count}"


def _lengths(seconds: Sequence[float]) -> str:
    if not seconds:
        return "not told"
    ordered = sorted(seconds)
    return f"{ordered[0]:.1f} to {ordered[-1]:.1f} s, {ordered[len(ordered) // 2]:.1f} s in the middle"


def _recordings(look: Look) -> str:
    if look.sample is None:
        return ""
    parts = [_recording(look.sample, s.id, s.text) for s in look.sample.sources]
    return ("<h2>The sample</h2>"
            '<p class="note">Faces with the points that would be learnt, and words where they were heard; frames '
            "that would be left out are marked in red.</p>" + "".join(parts))


def _recording(sample: Sample, name: str, text: str) -> str:
    outcome = sample.run.outcomes[name]
    parts = []
    if sample.made.get(name, {}).get("video"):
        pictures = "".join(
            f'<figure{" class=doubt" if doubted else ""}><img src="{address}" alt="{html.escape(name)} at {told}">'
            f"<figcaption>{told}</figcaption></figure>"
            for address, told, doubted in faces(sample, name, sample.run.recipe.info.landmark_groups))
        parts.append(f'<div class="pictures">{pictures}</div>')
    if name in sample.made:
        parts.append(wide(wave(sample, name), f"Sound of {name}", "wave"))
    parts = ['<div class="both">' + "".join(parts) + "</div>"] if len(parts) > 1 else parts
    cut = [f"only {PART:.0f} seconds of it, without their words: it is long"] if name in sample.cut else []
    cut += ["its words are not known yet"] if name in sample.wordless - sample.cut else []
    told = [*outcome.reasons, *outcome.notes, *cut]
    if told:
        parts.append("<ul>" + "".join(f"<li>{html.escape(line)}</li>" for line in told) + "</ul>")
    kind = "recording dropped" if outcome.status == "dropped" else "recording"
    state = "" if outcome.status == "kept" else f" ({outcome.status})"
    return (f'<section class="{kind}"><h3>{html.escape(name)}{state} <em>{html.escape(text[:160])}</em></h3>'
            f'{"".join(parts)}</section>')


def _left_out(look: Look) -> str:
    """Recordings that will be dropped, each with its reason."""
    dropped = dict(look.problems)
    for name, outcome in look.sample.run.outcomes.items() if look.sample else ():
        if outcome.status == "dropped":
            dropped[name] = "; ".join(outcome.reasons)
    if not dropped:
        return "<h2>What will be dropped</h2><p>Nothing that files tell, and nothing of the sample.</p>"
    rows = "".join(f"<tr><td>{html.escape(name)}</td><td>{html.escape(why)}</td></tr>"
                   for name, why in list(dropped.items())[:_SHOWN])
    more = f'<p class="note">and {len(dropped) - _SHOWN} more</p>' if len(dropped) > _SHOWN else ""
    table = ('<table class="told"><thead><tr><th>recording</th><th>why</th></tr></thead>'
             f"<tbody>{rows}</tbody></table>")
    return f"<h2>What will be dropped</h2>{wide(table, 'Recordings and reasons')}{more}"


def _sounds(look: Look) -> str:
    """Sounds and triphones of the texts, and what to record next."""
    coverage = look.coverage
    if not coverage.heard:
        return "<h2>Sounds in the texts</h2><p>No text is known yet.</p>"
    lacking, wanted = unsaid(coverage, look.variant)
    never = ", ".join(f"{p} as in {EXAMPLES[p]}" for p in coverage.missing) or "none"
    named = ", ".join(lacking[:_NAMED]) + (f" and {len(lacking) - _NAMED} more" if len(lacking) > _NAMED else "")
    prompts = "".join(f"<li>{html.escape(text)}</li>" for text in next_prompts(coverage, look.variant))
    read = ("<h3>Record these too</h3><p class=\"note\">They add most to what the texts hold, the first one most.</p>"
            f'<ol class="read">{prompts}</ol>') if prompts else ""
    return ("<h2>Sounds in the texts</h2><dl>"
            f"<dt>missing sounds</dt><dd>{html.escape(never)}</dd>"
            f"<dt>transitions</dt><dd>{coverage.share(look.variant):.0%} of those from sound to sound in ordinary "
            "sentences</dd>"
            f"<dt>triphones</dt><dd>{len(coverage.heard)} different ones; of the {wanted} in 80 ordinary sentences "
            f"{len(lacking)} are missing{': ' if lacking else ''}{html.escape(named)}</dd></dl>"
            + bars((p, EXAMPLES[p], coverage.phones[p]) for p in SPOKEN) + read)


def _time(look: Look) -> str:
    if not look.stages:
        return ""
    rows = "".join(f"<tr><td>{stage}</td><td>{_duration(took)}</td></tr>" for stage, took in look.stages.items())
    several = f", {look.jobs} recordings at a time" if look.jobs > 1 else ""
    table = f"<table><thead><tr><th>step</th><th>time</th></tr></thead><tbody>{rows}</tbody></table>"
    return ("<h2>How long it will take</h2>"
            f'<p class="note">From what the sample took{several}. Measuring how late each sound is (sync) and a busy '
            f"machine add to it.</p>{wide(table, 'How long it will take')}")

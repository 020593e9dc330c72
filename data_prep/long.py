"""Recordings of minutes or hours: cut into utterances at pauses, what is said put in time piece by piece."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from data_prep.landmarks import slices
from data_prep.long_found import LeftOut, Words, fitted, left_out, off_line
from data_prep.long_work import (
    CLIPS,
    PASSAGES,
    RECOGNISED,
    RECORDING,
    VERSION,
    cut_clip,
    find_words,
    folder_of,
    hear,
    pieces_of,
    put_in_time,
)
from data_prep.recipe import Source
from data_prep.script import Script
from data_prep.stages import FOLDER, Workshop
from dnnvss.archives import read_arrays
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.formats import in_order, read_timed_text
from dnnvss.speech.align_doubt import Word
from dnnvss.speech.matching import matched, settled, trusted
from dnnvss.speech.passages import Passage, passages, widened
from dnnvss.speech.recognise import HeardWord, write_vocabulary
from dnnvss.speech.utterances import edges, utterances
from dnnvss.text.lexicon import pronunciations

FOUND = 0.2
"""Share of the words of a text that must be found in a recording for it to be the text of it."""


@dataclass
class Cuts:
    """What became of long recordings.

    Args:
        sources: the utterances, and recordings that cannot be used.
        told: what is to be said of each recording.
        left_out: what was not used, and when it is said.
    """

    sources: list[Source] = field(default_factory=list)
    told: list[str] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)

    def refuse(self, recording: Source, why: str) -> None:
        """Leave a whole recording out."""
        self.sources.append(Source(recording.id, video=recording.video, problem=why))


@dataclass
class _Work:
    """A recording that is being cut: what is known of it so far."""

    recording: Source
    sound: dict[str, Any]
    script: Script
    ways: dict[str, list[tuple[str, ...]]]
    notes: list[str]
    loud: np.ndarray
    spans: list[tuple[float, float]]
    passages: list[Passage] = field(default_factory=list)
    failed: dict[int, str] = field(default_factory=dict)
    words: Words = field(default_factory=list)

    @property
    def text(self) -> Path:
        """The file that tells what is said."""
        assert self.recording.script is not None
        return self.recording.script

    @property
    def video(self) -> Path:
        """The recording's file."""
        assert self.recording.video is not None
        return self.recording.video

    def said(self, passage: Passage) -> list[Word]:
        """The words of a passage with their pronunciations."""
        return [(w, self.ways[w]) for w in self.script.words[passage.first : passage.last]]


def cut_recordings(recordings: Sequence[Source], shop: Workshop, variant: str, lexicon: Mapping[str, str],
                   dimensions: int = 2) -> Cuts:
    """Utterances of long recordings, as sources with a clip of their own each.

    Each step is kept as it is done, piece by piece, and a killed command goes on where it was.

    Args:
        recordings: each with its script.
        shop: where to work.
        variant: pronunciation variant.
        lexicon: word to phones, before the variant's lexicon.
        dimensions: coordinates of a landmark.
    """
    cuts = Cuts()
    works = _heard(recordings, shop, variant, lexicon, cuts)
    _recognised(works, shop)
    _timed(works, shop)
    for work in [w for w in works if not _belongs(w)]:
        found = sum(word is not None for word in work.words)
        cuts.refuse(work.recording, f"{work.text.name} is not what is said in it: {found} of its "
                    f"{len(work.words)} words were found")
        works.remove(work)
    _cut(works, shop, cuts, dimensions)
    return cuts


def _heard(recordings: Sequence[Source], shop: Workshop, variant: str, lexicon: Mapping[str, str],
           cuts: Cuts) -> list[_Work]:
    results = shop.run(RECORDING, hear, {r.id: {"video": r.video} for r in recordings}, VERSION)
    works = []
    for r in recordings:
        assert r.script is not None
        try:
            if "dropped" in results[r.id]:
                cuts.refuse(r, results[r.id]["dropped"])
                continue
            cues, notes = in_order(read_timed_text(r.script))
            script = Script(cues, variant)
            if not script.words:
                raise DnnvssError("holds no word", file=r.script, remedy="Write what is said in the recording")
            ways = {w: pronunciations(w, variant, lexicon) for w in set(script.words)}
        except ShortageError:
            raise  # it says nothing about the recording
        except DnnvssError as error:
            cuts.refuse(r, str(error))
            continue
        loud = read_arrays(folder_of(shop.out) / f"{r.id}.npz", "Delete .stages and prepare again")["active"]
        works.append(_Work(r, results[r.id], script, ways, list(notes), loud, pieces_of(loud)[0]))
    return works


def _recognised(works: Sequence[_Work], shop: Workshop) -> None:
    """Find out between which pauses which words are said."""
    tasks: dict[str, dict[str, Any]] = {}
    vocabularies = {}
    for work in works:
        name, folder = work.recording.id, shop.out / FOLDER / RECOGNISED / work.recording.id
        text = hashlib.sha256(repr((work.script.words, sorted(work.ways.items()))).encode()).hexdigest()[:16]
        vocabularies[name] = write_vocabulary(folder, work.script.words, work.ways)
        for k, (start, end) in enumerate(pieces_of(work.loud)[1]):
            tasks[f"{name}_{k:05d}"] = {"wav": folder_of(shop.out) / f"{name}.16.wav", "start": start, "end": end,
                                        "vocabulary": str(folder), "text": text}
    found = shop.run(RECOGNISED, find_words, tasks, VERSION) if tasks else {}
    for work in works:
        name, number = work.recording.id, {w: k for k, w in enumerate(vocabularies[work.recording.id])}
        count = len(pieces_of(work.loud)[1])
        heard = [HeardWord(*row) for k in range(count) for row in found[f"{name}_{k:05d}"].get("words", [])]
        wanted, said = [number[w] for w in work.script.words], [word.word for word in heard]
        silent = [b.start - a.end for a, b in pairwise(heard)]
        places = settled(matched(wanted, said), said, np.array([np.inf, *silent, np.inf]))
        good = trusted(wanted, said, places)
        work.passages = passages(work.spans, heard, places, good, len(wanted))


def _timed(works: Sequence[_Work], shop: Workshop) -> None:
    """Put the words of all passages in time; passages that do not fit are tried again with their neighbours."""
    found = _aligned(works, shop, {(w.recording.id, str(k)): p for w in works for k, p in enumerate(w.passages)})
    wider: dict[str, list[tuple[int, int, Passage]]] = {}
    for work in works:
        name = work.recording.id
        wider[name] = widened(work.passages, ["dropped" in found[name, str(k)] for k in range(len(work.passages))])
    again = _aligned(works, shop, {(name, f"{a}-{b}"): p for name, rows in wider.items() for a, b, p in rows})
    for work in works:
        name = work.recording.id
        better = {a: (b, p) for a, b, p in reversed(wider[name]) if "dropped" not in again[name, f"{a}-{b}"]}
        rows, k = list[tuple[Passage, dict[str, Any]]](), 0
        while k < len(work.passages):
            end, passage = better.get(k, (k + 1, work.passages[k]))
            rows.append((passage, again[name, f"{k}-{end}"] if k in better else found[name, str(k)]))
            k = end
        _laid(work, rows)


def _laid(work: _Work, rows: Sequence[tuple[Passage, dict[str, Any]]]) -> None:
    """Lay the words that were put in time on the text."""
    work.words = [None] * len(work.script.words)
    work.passages = [passage for passage, _ in rows]
    for k, (passage, result) in enumerate(rows):
        if "dropped" in result:
            work.failed[k] = result["dropped"]
        else:
            work.words[passage.first : passage.last] = fitted(result["words"])


def _aligned(works: Sequence[_Work], shop: Workshop, wanted: Mapping[tuple[str, str], Passage]
             ) -> dict[tuple[str, str], dict[str, Any]]:
    by = {w.recording.id: w for w in works}
    tasks = {f"{name}_{k}": {"wav": folder_of(shop.out) / f"{name}.16.wav", "start": p.start, "end": p.end,
                             "words": by[name].said(p)} for (name, k), p in wanted.items()}
    found = shop.run(PASSAGES, put_in_time, tasks, VERSION) if tasks else {}
    return {(name, k): found[f"{name}_{k}"] for name, k in wanted}


def _belongs(work: _Work) -> bool:
    return sum(word is not None for word in work.words) >= FOUND * len(work.words)


def _cut(works: Sequence[_Work], shop: Workshop, cuts: Cuts, dimensions: int) -> None:
    tasks: dict[str, dict[str, Any]] = {}
    owners: dict[str, tuple[_Work, tuple[int, int]]] = {}
    for work in works:
        off, notes = off_line(work.words, work.script.given)
        work.notes += notes
        for k in off:
            work.words[k] = None
        for first, last in utterances(work.words, work.script.ends):
            a, b = work.words[first], work.words[last - 1]
            assert a is not None and b is not None
            before = next((w.end for w in reversed(work.words[:first]) if w is not None), 0.0)
            behind = next((w.start for w in work.words[last:] if w is not None), work.sound["seconds"])
            start, end = edges(a, b, work.loud, before, behind)
            name = f"{work.recording.id}_{_clock(a.start)}"
            owners[name] = work, (first, last)
            tasks[name] = {"recording": work.recording.id, "video": work.video,
                           "sound": folder_of(shop.out) / f"{work.recording.id}.48.wav",
                           "pictures": {k: work.sound[k] for k in ("base", "zero", "codec", "late")},
                           "start": round(max(start, 0.0), 4), "end": round(end, 4)}
    clips = shop.run(CLIPS, cut_clip, tasks, VERSION) if tasks else {}
    marks = slices(shop, {w.recording.id: w.recording.landmarks for w in works if w.recording.landmarks},
                   {w.recording.id: {n: (clips[n]["first"], clips[n]["end"]) for n, (o, _) in owners.items()
                                     if o is w and "dropped" not in clips[n]} for w in works}, dimensions)
    for name, (work, (first, last)) in owners.items():
        cuts.sources.append(_source(name, work, (first, last), clips[name], shop.out, marks.get(name, ())))
    for work in works:
        _tell(work, [n for n, (o, _) in owners.items() if o is work], clips, cuts)


def _source(name: str, work: _Work, words: tuple[int, int], clip: Mapping[str, Any], out: Path,
            marks: tuple[Path, ...] | str) -> Source:
    if "dropped" in clip:
        return Source(name, video=work.video, problem=clip["dropped"])
    spoken = tuple(work.script.words[slice(*words)])
    if isinstance(marks, str):
        return Source(name, video=work.video, problem=marks)
    return Source(name, work.script.text(*words), spoken, out / clip["clip"], marks,
                  guessed=work.recording.guessed)


def _tell(work: _Work, names: Sequence[str], clips: Mapping[str, Mapping[str, Any]], cuts: Cuts) -> None:
    """Say what became of a recording."""
    spoken = [w for w in work.words if w is not None]
    minutes = sum(w.end - w.start for w in spoken) / 60
    copied = sum(bool(clips[n].get("copied")) for n in names)
    cuts.told.append(
        f"{work.video.name} ({work.sound['seconds'] / 60:.1f} minutes, {work.recording.long}) is cut at "
        f"pauses into {len(names)} utterances with {minutes:.1f} minutes of speech, {copied} of them copied without a "
        f"loss; {len(spoken)} of the {len(work.words)} words of {work.text.name} were put in time")
    cuts.told += [f"{work.text.name}: {note}" for note in work.notes]
    cuts.left_out += left_out(work.video.name, work.script.words, work.words, work.passages, work.failed,
                              work.spans)


def _clock(seconds: float) -> str:
    """A time as part of a name: hours, minutes and seconds, hundredths."""
    whole = int(seconds * 100)
    return f"{whole // 360000:02d}{whole // 6000 % 60:02d}{whole // 100 % 60:02d}_{whole % 100:02d}"

"""The shapes of JSON that speech recognisers and aligners write, each as rows of start, end and text."""

import re
from collections.abc import Callable, Iterator
from typing import Any

from dnnvss.formats.timed_rows import Row, timed_rows

_TICKS = 1e7
"""Units of 100 ns in a second, in which Azure counts."""


def _whisper(data: Any) -> Iterator[Row]:
    for segment in data["segments"]:
        words = segment.get("words") or []
        if words and all("start" in word and _end(word) is not None for word in words):
            yield from ((w["start"], _end(w), _text(w), 1.0) for w in words)
        else:
            yield segment["start"], _end(segment), segment["text"], 1.0


def _whisper_cpp(data: Any) -> Iterator[Row]:
    yield from ((s["offsets"]["from"], s["offsets"]["to"], s["text"], 1000.0)
                for s in data["transcription"])


def _hugging_face(data: Any) -> Iterator[Row]:
    chunks = data["chunks"]
    behind = [chunk["timestamp"][0] for chunk in chunks[1:]] + [None]
    for chunk, after in zip(chunks, behind, strict=True):
        start, end = chunk["timestamp"]
        yield start, next((t for t in (end, after) if t is not None), start), chunk["text"], 1.0


def _vosk(data: Any) -> Iterator[Row]:
    for part in data if isinstance(data, list) else [data]:
        yield from ((w["start"], w["end"], w["word"], 1.0) for w in part.get("result", []))


def _deepgram(data: Any) -> Iterator[Row]:
    for word in data["results"]["channels"][0]["alternatives"][0]["words"]:
        yield word["start"], word["end"], word.get("punctuated_word") or word["word"], 1.0


def _joined(items: Iterator[Row | str]) -> Iterator[Row]:
    """Words, each with the signs that follow it; a sign that is no text is an error of its type."""
    held: Row | None = None
    for item in items:
        if isinstance(item, tuple):
            if held:
                yield held
            held = item
        elif held:
            held = held[0], held[1], held[2] + item, held[3]
    if held:
        yield held


def _aws(data: Any) -> Iterator[Row]:
    """Amazon's items, and Speechmatics's results, which are like them."""
    results = data["results"]
    items = results["items"] if isinstance(results, dict) else results
    if not any("start_time" in item for item in items):
        raise KeyError("start_time")
    yield from _joined(
        item["alternatives"][0]["content"]
        if item.get("type") == "punctuation" or "start_time" not in item
        else (item["start_time"], item["end_time"], item["alternatives"][0]["content"], 1.0)
        for item in items)


def _google(data: Any) -> Iterator[Row]:
    """Google's results, in an answer of their own or in that of a long operation, whose times of 0 are left out.

    With who speaks comes a last result that holds all words again.
    """
    spoken = [result["alternatives"][0].get("words", []) for result in _results(data) if "alternatives" in result]
    *first, last = [words for words in spoken if words]
    if [word["word"] for words in first for word in words] == [word["word"] for word in last]:
        first = []
    for words in [*first, last]:
        for word in words:
            start, end = (next((word[k] for k in (f"{edge}Time", f"{edge}Offset", f"{edge}_time",
                                                  f"{edge}_offset") if k in word), default)
                          for edge, default in (("start", 0), ("end", None)))
            yield start, end, word["word"], 1.0


def _results(value: Any) -> list[Any]:
    """The first list under the name ``results``; none where there is none."""
    if not isinstance(value, dict):
        return []
    if isinstance(found := value.get("results"), list):
        return found
    return next((found for inner in value.values() if (found := _results(inner))), [])


def _watson(data: Any) -> Iterator[Row]:
    for result in data["results"]:
        yield from ((start, end, word, 1.0)
                    for word, start, end in result["alternatives"][0]["timestamps"])


def _azure(data: Any) -> Iterator[Row]:
    """Azure's phrases: of a batch (``recognizedPhrases``), or one or some detailed results."""
    phrases = data if isinstance(data, list) else data.get("recognizedPhrases", [data])
    for phrase in phrases:
        low = _lowered(phrase)
        best = _lowered(low["nbest"][0])
        for word in map(_lowered, best.get("words") or [{**low, "word": best["display"]}]):
            start = float(word["offsetinticks"] if "offsetinticks" in word else word["offset"])
            length = float(word["durationinticks"] if "durationinticks" in word else word["duration"])
            yield start, start + length, word["word"], _TICKS


def _azure_fast(data: Any) -> Iterator[Row]:
    """Azure's fast transcription: phrases, with their words where they were asked for."""
    for phrase in data["phrases"]:
        for part in phrase.get("words") or [phrase]:
            start = part["offsetMilliseconds"]
            yield start, start + part["durationMilliseconds"], part["text"], 1000.0


def _lowered(row: dict[str, Any]) -> dict[str, Any]:
    return {key.lower(): value for key, value in row.items()}


def _rev(data: Any) -> Iterator[Row]:
    yield from _joined((e["ts"], e["end_ts"], e["value"], 1.0) if "ts" in e else e["value"]
                       for monologue in data["monologues"] for e in monologue["elements"])


def _youtube(data: Any) -> Iterator[Row]:
    for event in data["events"]:
        start, parts = event.get("tStartMs", 0), event.get("segs", [])
        ends = [p.get("tOffsetMs", 0) for p in parts[1:]] + [event.get("dDurationMs", 0)] * bool(parts)
        for part, end in zip(parts, ends, strict=True):
            at = part.get("tOffsetMs", 0)
            yield start + at, start + max(at, end), part["utf8"], 1000.0


def _aeneas(data: Any) -> Iterator[Row]:
    yield from ((f["begin"], f["end"], " ".join(f["lines"]), 1.0) for f in data["fragments"])


def _textgrid(data: Any) -> Iterator[Row]:
    """The tier of words of a TextGrid as JSON, by name or in a list."""
    tiers = data["tiers"]
    named = tiers.items() if isinstance(tiers, dict) else ((t["name"], t) for t in tiers)
    words = [tier for name, tier in named if re.search(r"\bwords?$", name, re.IGNORECASE)]
    yield from ((start, end, word, 1.0) for start, end, word in words[0]["entries"])


def _assembly(data: Any) -> Iterator[Row]:
    if all(isinstance(w["start"], int) for w in data["words"]):  # else they are seconds
        yield from ((w["start"], w["end"], w["text"], 1000.0) for w in data["words"])


def _end(row: dict[str, Any]) -> Any:
    """When a row ends, by its end or by how long it lasts; None where neither is told."""
    start, lasts = row["start"], row.get("duration")
    return row.get("end") if "end" in row or lasts is None else start + lasts


def _text(row: dict[str, Any]) -> Any:
    return row["text"] if "text" in row else row["word"]


SHAPES: tuple[Callable[[Any], Iterator[Row]], ...] = (
    _whisper, _whisper_cpp, _hugging_face, _vosk, _deepgram, _aws, _google, _watson, _azure, _azure_fast,
    _rev, _youtube, _aeneas, _textgrid, _assembly, timed_rows)
"""Each yields the rows of JSON of its shape, and none, or an error of a missing key, of any other; what has no shape
of its own is searched."""

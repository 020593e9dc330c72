"""Recordings without a text: what is said in them is written down, for somebody to read and mend."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from data_prep.long_told import LONG
from data_prep.report import Outcome
from data_prep.stages import Workshop
from dnnvss import files
from dnnvss.acoustics.transcriber import check_transcriber, transcribe
from dnnvss.errors import DnnvssError
from dnnvss.formats import Cue, write_srt
from dnnvss.formats.tables import markdown_table
from dnnvss.media import SPEECH_RATE
from dnnvss.media.index import seconds_of
from dnnvss.media.storing import store_sound, stored, stretch
from dnnvss.speech.activity import louder, stretches
from dnnvss.speech.align_doubt import levels

TRANSCRIPTS, STAGE = "transcripts", "transcripts"
"""The folder of the prepared corpus that holds what was written down, and the stage that writes it."""
_MOST, _TOGETHER, _EDGE = 12.0, 0.6, 0.25
"""Seconds that are transcribed at once, of a pause that does not part them, and of silence around them."""
_VERSION = 1


def written_down(videos: Mapping[str, Path], shop: Workshop) -> dict[str, Path | str]:
    """The file with what is said in each recording, or why there is none.

    Texts go to ``transcripts/ID.txt`` of the prepared corpus, those of recordings longer than a minute with times to
    ``transcripts/ID.srt``. What is there already stays: somebody may have mended it.

    Raises:
        DnnvssError: the transcriber is not installed.
    """
    folder = shop.out / TRANSCRIPTS
    found: dict[str, Path | str] = {}
    for name in videos:
        kept = [path for suffix in (".srt", ".txt") if (path := folder / f"{name}{suffix}").is_file()]
        found |= dict.fromkeys([name], kept[0]) if kept else {}
    waiting = {name: {"video": path} for name, path in videos.items() if name not in found}
    if waiting:
        check_transcriber()
        for name, result in shop.run(STAGE, write_down, waiting, _VERSION).items():
            found[name] = result["dropped"] if "dropped" in result else shop.out / result["text"]
            if not isinstance(found[name], str) and not Path(found[name]).is_file():
                found[name] = _again(shop, name, waiting[name])
    return found


def _again(shop: Workshop, name: str, task: dict[str, Any]) -> Path | str:
    """Write a text down that somebody took away."""
    try:
        return Path(shop.out / write_down(name, shop.out, **task)["text"])
    except DnnvssError as error:
        return str(error)


def write_down(name: str, out: Path, video: Path) -> dict[str, Any]:
    """The path of what is said in a recording, after writing it down piece by piece.

    Raises:
        DnnvssError: the recording cannot be read, or nobody speaks in it.
    """
    sound = out / ".stages" / STAGE / f"{name}.wav"
    seconds = store_sound(video, sound, SPEECH_RATE)
    samples = stored(sound)
    cues = []
    for start, end in speech_pieces(samples):
        said = transcribe(stretch(sound, SPEECH_RATE, start, end))
        cues += [Cue(start, end, said.text)] if any(c.isalnum() for c in said.text) else []
    del samples
    files.remove(sound)
    if not cues:
        raise DnnvssError("nobody is heard to speak in it", file=video, utterance=name,
                          remedy="Give a recording with speech")
    long = max(seconds, seconds_of(video)) > LONG
    path = out / TRANSCRIPTS / f"{name}{'.srt' if long else '.txt'}"
    if long:
        write_srt(path, cues)
    else:
        files.write_text(path, " ".join(cue.text for cue in cues) + "\n")
    return {"text": str(path.relative_to(out))}


def speech_pieces(samples: np.ndarray) -> list[tuple[float, float]]:
    """Pieces of a sound (n,) int16 at 16 kHz between pauses, of up to 12 s, in seconds."""
    block = 600 * SPEECH_RATE
    level = np.concatenate([levels(samples[at : at + block] / np.float32(32767))
                            for at in range(0, len(samples), block)])
    if not len(level) or level.max() < -60:
        return []
    whole: list[tuple[float, float]] = []
    for start, end in stretches(louder(level)):
        if whole and start - whole[-1][1] < _TOGETHER and end - whole[-1][0] <= _MOST:
            whole[-1] = whole[-1][0], end
        else:
            edges = np.linspace(start, end, int(np.ceil((end - start) / _MOST)) + 1)
            whole += [(float(a), float(b)) for a, b in pairwise(edges)]
    last = len(samples) / SPEECH_RATE
    return [(max(a - _EDGE, 0.0), min(b + _EDGE, last)) for a, b in whole]


def write_guesses(out: Path, texts: Mapping[str, str], doubtful: Mapping[str, Sequence[str]],
                  outcomes: Iterable[Outcome]) -> Path:
    """Write ``transcripts.md``: what was written down, doubtful words set off, and return its path.

    Args:
        out: the prepared corpus.
        texts: what is said in each utterance that nobody gave a text for.
        doubtful: the words of it that hardly fit the sound.
        outcomes: what became of all utterances.
    """
    rows = []
    for outcome in outcomes:
        if outcome.id in texts:
            marked = ", ".join(f"**{word}**" for word in doubtful.get(outcome.id, ()))
            rows.append((outcome.id, texts[outcome.id].replace("|", "\\|"), marked,
                         "not used" if outcome.status == "dropped" else ""))
    head = ("# Written down by a machine\n\nRead each text beside its recording, mend it in the folder "
            f"`{TRANSCRIPTS}` and run the same command again. Doubtful words hardly fit the sound.")
    return files.write_text(out / "transcripts.md",
                            head + "\n\n" + markdown_table(["utterance", "text", "doubtful", ""], rows) + "\n")

"""What is done before everything else: texts that lack are written down, long recordings become utterances."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from data_prep.long import Cuts, cut_recordings
from data_prep.long_told import LONG
from data_prep.recipe import Recipe, Source
from data_prep.stages import Workshop
from data_prep.transcribing import written_down
from dnnvss import files
from dnnvss.text.sentence import spoken_words


def made_ready(sources: Sequence[Source], recipe: Recipe, shop: Workshop) -> Cuts:
    """An utterance a source, each with its words.

    Raises:
        DnnvssError: a text is to be written down, and what does it is not installed.
    """
    texts = written_down({s.id: s.video for s in sources if s.guessed and s.video is not None and not s.problem}, shop)
    ready = [_with_text(s, texts[s.id], recipe.info.variant) if s.id in texts else s for s in sources]
    long = [s for s in ready if s.script is not None and not s.problem]
    cuts = cut_recordings(long, shop, recipe.info.variant, recipe.lexicon, recipe.info.dimensions) if long else Cuts()
    cuts.sources[:0] = [s for s in ready if s.script is None or s.problem]
    if texts:
        cuts.told.append(f"what is said in {len(texts)} recordings was written down by a machine: read transcripts.md")
    return cuts


def _with_text(source: Source, text: Path | str, variant: str) -> Source:
    """A recording with what was written down of it, or why that was not."""
    if isinstance(text, str):
        return replace(source, problem=text)
    if text.suffix == ".srt":
        return replace(source, script=text, long=f"longer than {LONG:g} s, and written down by a machine")
    said = " ".join(files.read_text(text, "Write the words of the recording there").split())
    words = tuple(word for word, _ in spoken_words(said, variant))
    return replace(source, text=said, words=words) if words else replace(source, problem=f"{text.name} holds no word")

"""Footage: corpora that were prepared, and first looks at recordings."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from dnnvss import files
from dnnvss.corpus import CorpusInfo
from dnnvss.records import read_record
from dnnvss.studio.areas.area import Area, Item, Link
from dnnvss.studio.areas.documents import documents, there
from dnnvss.studio.areas.places import Thing, found

LOOK, REPORT, INFO, STATES = "look.html", "report.md", "corpus.json", "report.jsonl"
_LINKS = {LOOK: Link("First look", LOOK), REPORT: Link("Report of the preparation", REPORT, "text")}
_REMEDY = "Prepare the corpus again"


def footage(folders: Sequence[Path]) -> Area:
    """The area of the corpora in some folders."""
    return Area(
        "footage", "Footage",
        "A first look tells in under a minute what recordings are worth; preparing makes a corpus of them.",
        {"Look at recordings first": "dnnvss prepare corpus=folder corpus.raw=FOLDER corpus.name=NAME look=true",
         "Make a corpus of them": "dnnvss prepare corpus=folder corpus.raw=FOLDER corpus.name=NAME",
         "Make the built-in talker's": "dnnvss prepare corpus=demo"},
        lambda: found(folders, (INFO, LOOK)), _item, lambda thing: documents(thing.folder, tuple(_LINKS)))


def _item(thing: Thing) -> Item:
    links = tuple(_LINKS[name] for name in there(thing.folder, tuple(_LINKS)))
    if not (thing.folder / INFO).is_file():
        return Item(thing.name, thing.name, str(thing.folder), {"corpus": "not prepared yet"}, links, "first look")
    info = read_record(CorpusInfo, thing.folder / INFO, _REMEDY)
    size = f"{info.size[0]} x {info.size[1]}, {info.rate} a second" if all(info.size) else "without pictures"
    facts = {"pictures": size} | _states(thing.folder)
    return Item(thing.name, info.name, str(thing.folder), facts, links, "prepared")


def _states(folder: Path) -> dict[str, str]:
    """How many recordings were kept, repaired and dropped."""
    if not (folder / STATES).is_file():
        return {}
    lines = files.read_text(folder / STATES, _REMEDY).splitlines()
    read = files.read(folder / STATES, lambda path: [json.loads(line) for line in lines], _REMEDY)
    states = Counter(str(line["status"]) for line in read if isinstance(line, dict) and "status" in line)
    return {"recordings": ", ".join(f"{count} {state}" for state, count in states.most_common())}

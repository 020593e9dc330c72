"""The content of every utterance's files as a short digest in its record, so that a corpus knows when they change."""

import hashlib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from data_prep.stages import FOLDER, Workshop
from dnnvss import files
from dnnvss.corpus import Utterance


def with_digests(shop: Workshop, utterances: Iterable[Utterance]) -> list[Utterance]:
    """Return the utterances with the digest of their video, sound and landmarks in ``shop.out``.

    Files are read again only where their size or time of change is new.

    Raises:
        DnnvssError: a file is missing.
    """
    rows = list(utterances)
    made = {u.id: [p for p in (u.video, u.audio, u.landmarks) if p is not None] for u in rows}
    tasks = {name: {"made": [files.inside(shop.out, p) for p in paths]} for name, paths in made.items()}
    found = shop.run("digest", digested, tasks)
    return [replace(u, digest=found[u.id]["digest"]) for u in rows]


def digested(name: str, out: Path, made: list[Path]) -> dict[str, Any]:
    """Return the digest of what is in an utterance's files, wherever they lie; ``name`` is not used."""
    whole = hashlib.sha256()
    for path in made:
        whole.update(files.read(path, _digest, f"Delete {out / FOLDER} and prepare the corpus again"))
    return {"digest": whole.hexdigest()[:16]}


def _digest(path: Path) -> bytes:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").digest()

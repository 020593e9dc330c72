"""A corpus on disk: its fingerprint follows what is in it, its splits keep utterances apart."""

import json
from pathlib import Path

import pytest

from data_prep.digests import with_digests
from data_prep.stages import Workshop
from dnnvss import files
from dnnvss.corpus import Corpus, CorpusInfo, Utterance
from dnnvss.errors import DnnvssError
from dnnvss.timing import Alignment, Tier

INFO = CorpusInfo("toy", (64, 48), "25", {"lips_outer": (0, 4)})
SPLITS = {"train": ["a", "b 2"], "val": ["c"], "test": ["d"]}


def written(root: Path, text: str = "ah", splits: dict[str, list[str]] | None = None) -> Corpus:
    """Write a corpus of four utterances whose files hold a few letters, and open it."""
    tiers = Alignment([Tier("phones", [(0, 1, "AA")]), Tier("words", [(0, 1, "ah")])])
    rows = []
    for name in ("a", "b 2", "c", "d"):
        paths = {kind: f"{kind}/{name}" for kind in ("video", "audio", "landmarks")}
        for path in paths.values():
            if not (root / path).is_file():
                files.write_text(root / path, name)
        rows.append(Utterance(name, text, tiers, **paths, frames=25))
    Corpus.write(root, INFO, with_digests(Workshop(root, jobs=1), rows), splits or SPLITS)
    return Corpus.open(root)


def test_the_fingerprint_follows_files_records_and_splits(tmp_path: Path) -> None:
    first = written(tmp_path).fingerprint
    assert written(tmp_path).fingerprint == written(tmp_path / "elsewhere").fingerprint == first
    found = {first}
    for kind in ("video", "audio", "landmarks"):
        files.write_text(tmp_path / kind / "c", f"new {kind}")
        found.add(written(tmp_path).fingerprint)
    found.add(written(tmp_path, "oh").fingerprint)
    found.add(written(tmp_path, "oh", {**SPLITS, "val": ["d"], "test": ["c"]}).fingerprint)
    assert len(found) == 6


def test_a_corpus_that_was_prepared_before_there_were_digests_is_read(tmp_path: Path) -> None:
    new = written(tmp_path, "one\u2028two")
    rows = [{k: v for k, v in u.to_json().items() if k != "digest"} for u in new.utterances.values()]
    files.write_text(tmp_path / "utterances.jsonl", "".join(json.dumps(r, ensure_ascii=False) + "\n" for r in rows))
    old = Corpus.open(tmp_path)
    assert {u.digest for u in old.utterances.values()} == {""} and "digest" not in old.utterances["a"].to_json()
    assert len({u.digest for u in new.utterances.values()}) == 4
    assert old.utterances["a"].text == "one\u2028two"


def test_splits_that_share_utterances_are_refused(tmp_path: Path) -> None:
    corpus = written(tmp_path, splits={**SPLITS, "unseen_train": ["c"], "unseen_test": ["a"]})
    assert [u.id for u in corpus.split("train")] == ["a", "b 2"]
    assert [u.id for u in corpus.split("test", "unseen")] == ["a"]
    with pytest.raises(DnnvssError, match="train and test both name b 2"):
        written(tmp_path, splits={**SPLITS, "test": ["b 2", "d"]})
    files.write_text(tmp_path / "splits" / "test.txt", "d\na\nc\n")
    for name in ("train", "test"):
        with pytest.raises(DnnvssError, match="test and train both name a\\. Let each utterance be in one of them"):
            corpus.split(name)
    assert [u.id for u in corpus.split("train", "unseen")] == ["c"]  # another variant

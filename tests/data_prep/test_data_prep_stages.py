"""Stages resume, are redone when their input changes, and leave nothing half-written."""

import errno
import json
from pathlib import Path

import numpy as np
import pytest

from data_prep.splits import completed, draw, lacking, read_splits
from data_prep.stages import Workshop, fingerprint
from dnnvss import files
from dnnvss.errors import DnnvssError


def count(name, out, value, source=None):
    """Work that leaves a trace of how often it ran."""
    trace = out / f"{name}.count"
    trace.write_text(str(int(trace.read_text()) + 1 if trace.exists() else 1))
    return {"doubled": 2 * value}


def runs(out, name):
    return int((out / f"{name}.count").read_text())


@pytest.fixture
def shop(tmp_path):
    (tmp_path / "out").mkdir()
    return Workshop(tmp_path / "out", jobs=1)


def test_results_are_kept_and_only_what_changed_is_redone(shop, tmp_path):
    source = tmp_path / "a.wav"
    source.write_text("one")
    tasks = {"a": {"value": 1, "source": source}, "b": {"value": 2}}
    assert shop.run("stage", count, tasks) == {"a": {"doubled": 2}, "b": {"doubled": 4}}
    assert shop.run("stage", count, tasks) == {"a": {"doubled": 2}, "b": {"doubled": 4}}
    assert (runs(shop.out, "a"), runs(shop.out, "b")) == (1, 1)
    tasks["b"]["value"] = 5
    assert shop.run("stage", count, tasks)["b"] == {"doubled": 10}
    assert (runs(shop.out, "a"), runs(shop.out, "b")) == (1, 2)
    source.write_text("longer")
    shop.run("stage", count, tasks)
    assert (runs(shop.out, "a"), runs(shop.out, "b")) == (2, 2)
    shop.run("stage", count, tasks, "other settings")
    assert (runs(shop.out, "a"), runs(shop.out, "b")) == (3, 3)


def test_a_corpus_that_is_being_changed_cannot_be_opened(shop):
    (shop.out / "corpus.json").write_text("{}")
    shop.run("stage", count, {"a": {"value": 1}})
    assert not (shop.out / "corpus.json").exists()
    (shop.out / "corpus.json").write_text("{}")
    shop.run("stage", count, {"a": {"value": 1}})
    assert (shop.out / "corpus.json").exists()


@pytest.mark.parametrize("damaged", ['{"key": ', "[]", "null", '{"key": "KEY"}', '{"key": "KEY", "result": 3}'])
def test_a_damaged_result_is_made_again(damaged, shop):
    shop.run("stage", count, {"a": {"value": 1}})
    path = shop.out / ".stages" / "stage" / "a.json"
    path.write_text(damaged.replace("KEY", json.loads(path.read_text())["key"]))
    assert shop.run("stage", count, {"a": {"value": 1}}) == {"a": {"doubled": 2}}


def test_arrays_that_somebody_removed_say_how_they_are_made_again(shop):
    with pytest.raises(DnnvssError, match=r"media/a\.npz: no such file\. Delete .*\.stages/media and run the same"):
        shop.arrays("media", "a")


def refuse(name, out):
    raise DnnvssError("is no video", file=f"/raw/{name}.mp4", utterance=name, remedy="Convert it")


def full(name, out):
    with files.replacing(out / "audio" / f"{name}.wav") as temporary:
        temporary.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")


def interrupt(name, out):
    with files.replacing(out / "audio" / f"{name}.wav") as temporary:
        temporary.write_bytes(b"half")
        if name == "b":
            raise KeyboardInterrupt
    return {"ok": name}


def test_a_bad_utterance_is_dropped_with_its_reason(shop):
    result = shop.run("stage", refuse, {"a": {}})
    assert result == {"a": {"dropped": "/raw/a.mp4: utterance a: is no video. Convert it."}}


def test_a_full_disk_ends_the_run_and_leaves_nothing_behind(shop):
    with pytest.raises(DnnvssError, match=r"a\.wav: cannot be written \(No space left on device\).*resumes"):
        shop.run("stage", full, {"a": {}})
    assert [p for p in shop.out.rglob("*") if p.is_file()] == []


def test_ctrl_c_leaves_whole_files_and_the_next_run_resumes(shop):
    tasks = {name: {} for name in "abc"}
    with pytest.raises(KeyboardInterrupt):
        shop.run("stage", interrupt, tasks)
    assert [p.name for p in sorted((shop.out / "audio").iterdir())] == ["a.wav"]
    assert json.loads((shop.out / ".stages/stage/a.json").read_text())["result"] == {"ok": "a"}
    assert shop.run("stage", lambda name, out: {"ok": "again"}, tasks) == {
        "a": {"ok": "a"}, "b": {"ok": "again"}, "c": {"ok": "again"}}


def test_sweep_removes_what_killed_workers_left(shop):
    (shop.out / "audio").mkdir()
    (shop.out / "audio" / ".a.k3_x81bq.part.wav").write_text("half")
    (shop.out / "audio" / "a.wav").write_text("whole")
    shop.sweep()
    assert [p.name for p in (shop.out / "audio").iterdir()] == ["a.wav"]


def test_fingerprint_sees_files_in_a_folder(tmp_path):
    first = fingerprint({"landmarks": tmp_path})
    (tmp_path / "a.pts").write_text("1 2")
    assert fingerprint({"landmarks": tmp_path}) != first
    assert fingerprint(Path("/nowhere")) == fingerprint(Path("/nowhere"))


def test_results_do_not_depend_on_the_number_of_processes(tmp_path):
    tasks = {f"u{k}": {"value": k} for k in range(6)}
    results = []
    for jobs in (1, 2):
        out = tmp_path / str(jobs)
        out.mkdir()
        results.append(Workshop(out, jobs, "threading").run("stage", count, tasks))
    assert results[0] == results[1] == {f"u{k}": {"doubled": 2 * k} for k in range(6)}


def test_drawn_splits_cover_everything_once_and_spread_over_strata():
    ids = [f"{letter}{k}" for letter in "abcdefghij" for k in range(20)]
    splits = draw(ids, val=0.1, test=0.05, stratum=lambda i: i[0])
    assert [len(splits[n]) for n in ("train", "val", "test")] == [170, 20, 10]
    assert sorted(i for part in splits.values() for i in part) == sorted(ids)
    assert {i[0] for i in splits["test"]} == set("abcdefghij")
    assert np.bincount([ord(i[0]) - ord("a") for i in splits["val"]]).tolist() == [2] * 10
    assert draw(reversed_ids := list(reversed(ids)), 0.1, 0.05, lambda i: i[0]) == splits
    assert len(reversed_ids) == 200


def test_small_corpora_get_one_utterance_in_each_split():
    splits = draw(["a", "b", "c"], val=0.05, test=0.05)
    assert [len(splits[n]) for n in ("train", "val", "test")] == [1, 1, 1]
    with pytest.raises(DnnvssError, match="2 utterances cannot be split"):
        draw(["a", "b"], 0.05, 0.05)


def test_splits_are_read_from_files_an_id_a_line(tmp_path):
    for name, text in (("train", "a\nclip 2 \n"), ("val", "c"), ("test", "d\n\n"), ("unseen_test", "a\r\nclip\r\n")):
        (tmp_path / f"{name}.txt").write_text(text, newline="")
    (tmp_path / "._train.txt").write_text("what a file manager left")
    splits = read_splits(tmp_path)
    assert splits == {"train": ["a", "clip 2"], "val": ["c"], "test": ["d"], "unseen_test": ["a", "clip"]}
    assert lacking(splits, {"a", "c", "d"}) == () and lacking(splits, {"a", "clip", "c"}) == ("test",)
    assert read_splits(tmp_path / "none") == {}
    (tmp_path / "val.txt").write_text("c\nclip 2\n")
    with pytest.raises(DnnvssError, match="train and val both name clip 2"):
        read_splits(tmp_path)


def test_only_splits_that_are_not_given_are_drawn_from_what_the_others_leave():
    kept = [f"u{k:02}" for k in range(20)]
    given = {"test": ["u03", "u04"], "val": ["dropped"], "unseen_test": ["u05"]}
    splits = completed(given, kept, 0.1, 0.1)
    assert splits["test"] == ["u03", "u04"] and splits["unseen_test"] == ["u05"]
    assert len(splits["val"]) == 2 and len(splits["train"]) == 16
    assert sorted(splits["train"] + splits["val"] + splits["test"]) == kept
    whole = {"train": kept[:18], "val": kept[18:19], "test": kept[19:]}
    assert completed(whole, kept, 0.1, 0.1) == whole
    spare = completed({"train": kept[:18]}, kept, 0.5, 0.5)
    assert spare["train"] == kept[:18] and sorted(spare["val"] + spare["test"]) == kept[18:]
    assert completed({}, kept, 0.1, 0.1) == draw(kept, 0.1, 0.1)
    with pytest.raises(DnnvssError, match=r"too few utterances are left for val and test: .* all but 1 of 20"):
        completed({"train": kept[:19]}, kept, 0.1, 0.1)

"""Takes read back: ours, those of the app, and what is damaged; and the command that plays them."""

import json
import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dnnvss.commands.rig import main
from dnnvss.errors import DnnvssError
from dnnvss.export.take import Take, write_take
from dnnvss.export.take_read import at_rate, read_take
from dnnvss.export.timecode import TimeCode
from dnnvss.face.mesh import packaged_head
from dnnvss.formats.curves import read_curves
from dnnvss.media import video_info
from dnnvss.timing import FrameClock

DATA = Path(os.environ.get("DNNVSS_LIVE_LINK", "/work/shared/data/livelink/range_of_motion.csv"))


@pytest.fixture
def take() -> Take:
    """Two seconds of a mouth that opens and closes."""
    opened = 0.5 - 0.5 * np.cos(np.arange(60) / 6)
    return Take(
        {"jawOpen": opened, "eyeBlinkLeft": opened / 2}, FrameClock(30), TimeCode(1, 2, 3, 4)
    )


@pytest.mark.parametrize("suffix", ["csv", "json"])
def test_a_take_comes_back(tmp_path, take, suffix):
    read = read_take(write_take(tmp_path / f"take.{suffix}", take))
    own = {name.lower(): track for name, track in read.curves.items()}
    for name, track in take.curves.items():
        np.testing.assert_allclose(own[name.lower()], track, atol=1e-9)
    assert read.clock == take.clock and read.start == take.start


@pytest.mark.parametrize("start", ["01:02:03:04", "00:59:59;28"])
def test_columns_keep_their_time_code_beside_their_times(tmp_path, start):
    clock, first = FrameClock("29.97"), TimeCode.from_setting(start, "start")
    path = write_take(tmp_path / "take.csv", Take({"open": np.arange(50.0), "jawOpen": np.zeros(50)}, clock, first))
    read = read_take(path)
    assert list(read.curves) == ["open", "jawOpen"] and read.clock == clock and str(read.start) == start
    half = read_take(path, FrameClock("59.94"))
    assert half.start == TimeCode(first.hours, first.minutes, first.seconds, 2 * first.frame, first.drop)


@pytest.mark.parametrize("rate", ["23.976", "29.97", "59.94"])
def test_frames_that_time_code_counts_to_a_whole_number_are_kept_at_the_true_rate(tmp_path, rate):
    clock, track = FrameClock(rate), np.random.default_rng(0).random(2500)
    path = write_take(tmp_path / "take.csv", Take({"jawOpen": track}, clock, TimeCode(1, 2, 3, 4)))
    read = read_take(path, clock)
    np.testing.assert_allclose(read.curves["JawOpen"], track, atol=1e-9)
    assert read.clock == clock and read.start == TimeCode(1, 2, 3, 4)
    assert read_take(path, made_at=clock).clock == clock and read_take(path).clock == FrameClock(round(float(rate)))


@pytest.mark.parametrize("rate", ["29.97", "59.94"])
@pytest.mark.parametrize("start", ["00:00:50;00", "01:08:59;27", "23:59:58;05"])
def test_drop_frame_codes_lose_no_frame_and_begin_where_they_began(tmp_path, rate, start):
    clock, track = FrameClock(rate), np.random.default_rng(0).random(700)
    first = TimeCode.from_setting(start, "start")
    path = write_take(tmp_path / "take.csv", Take({"jawOpen": track}, clock, first))
    for read in (read_take(path), read_take(path, clock), read_take(path, made_at=clock)):
        np.testing.assert_allclose(read.curves["JawOpen"], track, atol=1e-9)
        assert read.clock == clock and read.start == first and str(read.start) == start
    assert read_take(path, FrameClock(25)).start.drop is False


def test_drop_frame_codes_by_hand(tmp_path):
    codes = TimeCode(0, 0, 59, 28, drop=True).codes(4, FrameClock("29.97"))
    assert codes == ["00:00:59;28", "00:00:59;29", "00:01:00;02", "00:01:00;03"]
    assert TimeCode(0, 9, 59, 29, drop=True).codes(2, FrameClock("29.97"))[1] == "00:10:00;00"
    assert TimeCode(0, 0, 59, 59, drop=True).codes(2, FrameClock("59.94"))[1] == "00:01:00;04"
    hour = TimeCode(drop=True).codes(107_893, FrameClock("29.97"))
    assert len(set(hour)) == 107_893 and hour[-1] == "01:00:00;00"  # 3600 s of the clock hold 107,892 frames
    for rate, code, said in (("25", "01:00:00;00", "25 frames a second do not have"),
                             ("30", "01:00:00;00", "30 frames a second do not have"),
                             ("29.97", "01:01:00;01", "leaves out")):
        with pytest.raises(DnnvssError, match=said):
            TimeCode.from_setting(code, "start").base(FrameClock(rate))


def test_semicolons_of_codes_that_leave_nothing_out_mean_nothing(tmp_path):
    path = write_take(tmp_path / "take.csv", Take({"jawOpen": np.zeros(200)}, FrameClock(30), TimeCode(0, 0, 58)))
    lines = [line[:8] + ";" + line[9:] if line[0] == "0" else line for line in path.read_text().splitlines()]
    path.write_text("\n".join(lines))
    assert read_take(path).clock == FrameClock(30) and read_take(path).start == TimeCode(0, 0, 58)


def test_times_before_nought_are_before_midnight(tmp_path):
    (path := tmp_path / "early.csv").write_text("Time,JawOpen\n-0.5,0\n-0.4666667,0.5\n-0.4333333,1\n")
    assert read_take(path).start == TimeCode(23, 59, 59, 15)


def test_another_rate_lies_on_the_lines_between(take):
    slow = at_rate(take, FrameClock(15))
    np.testing.assert_allclose(slow.curves["jawOpen"], take.curves["jawOpen"][::2], atol=1e-12)
    fast = at_rate(take, FrameClock(60))
    np.testing.assert_allclose(fast.curves["jawOpen"][1], take.curves["jawOpen"][:2].mean())


def test_a_frame_that_was_dropped_is_filled_and_the_others_stay(tmp_path, take):
    path = write_take(tmp_path / "take.csv", take)
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:20] + lines[21:]) + "\n")
    read = read_take(path)
    kept = np.delete(np.arange(60), 19)
    assert read.frames == 60
    np.testing.assert_allclose(
        read.curves["JawOpen"][kept], take.curves["jawOpen"][kept], atol=1e-9
    )
    np.testing.assert_allclose(
        read.curves["JawOpen"][19], take.curves["jawOpen"][[18, 20]].mean(), atol=1e-9
    )


@pytest.mark.parametrize("text", ["{}", "[]", '{"format": "dnnvss-take", "version": 1}', "{", ""])
def test_a_damaged_json_is_an_error_of_ours(tmp_path, text):
    path = tmp_path / "take.json"
    path.write_text(text)
    with pytest.raises(DnnvssError):
        read_take(path)


def test_a_frame_that_lacks_a_curve_or_a_rate_beyond_all_is_told(tmp_path, take):
    path = write_take(tmp_path / "take.json", take)
    held = json.loads(path.read_text())
    held["frames"][3] = [0.1]
    path.write_text(json.dumps(held))
    with pytest.raises(DnnvssError, match="lacks a curve"):
        read_take(path)
    with pytest.raises(DnnvssError, match="too many"):
        at_rate(replace(take, clock=FrameClock("1/20")), FrameClock(1_000_000))
    with pytest.raises(DnnvssError, match=r"not read from \.fbx"):
        read_take(tmp_path / "take.fbx")


def test_a_table_without_times_needs_a_rate(tmp_path):
    path = tmp_path / "plain.csv"
    path.write_text("jawOpen,smile\n0.5,0\n0.25,1\n")
    with pytest.raises(DnnvssError, match="has no times"):
        read_take(path)
    np.testing.assert_array_equal(read_take(path, FrameClock(25)).curves["jawOpen"], [0.5, 0.25])


def test_the_command_plays_and_writes_a_take(tmp_path, take, capsys):
    source = write_take(tmp_path / "take.json", at_rate(take, FrameClock(6)))
    outs = [tmp_path / name for name in ("a.mp4", "a.glb", "a.json")]
    assert main([str(source), "--height", "64", "--turn", "20", "--out", *map(str, outs)]) == 0
    assert video_info(outs[0]).rate == 6 and all(path.is_file() for path in outs)
    assert "from 01:02:03:" in capsys.readouterr().out
    assert main(["--names"]) == 0 and "lips_outer01" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ([], "needs a take"),
        (["x.csv", "--out", "a.fbx"], r"cannot be written as \.fbx\. Name it \.mp4, \.csv"),
        (["x.csv", "--out", "a.mp4", "--height", "3"], "no size"),
    ],
)
def test_mistakes_on_the_command_line_are_told(words, told):
    with pytest.raises(DnnvssError, match=told):
        main(words)


def test_curves_that_move_nothing_are_told(tmp_path, take):
    source = write_take(tmp_path / "t.json", Take({"ctrl_12": np.zeros(3)}, take.clock))
    with pytest.raises(DnnvssError, match="is a shape of the head"):
        main([str(source), "--out", str(tmp_path / "a.glb")])


def test_the_given_take_of_the_app_comes_back_and_moves_the_head(tmp_path):
    if not DATA.is_file():
        pytest.skip(f"no take of Live Link Face at {DATA} (DNNVSS_LIVE_LINK)")
    given = read_curves(DATA)
    back = read_curves(write_take(tmp_path / "back.csv", read_take(DATA)))
    steps = np.diff(given.times) / np.median(np.diff(given.times))
    at = np.concatenate([[0], np.cumsum(np.round(steps).astype(int))])
    assert back.names == given.names
    np.testing.assert_array_equal(back.values[at], given.values)
    weights = packaged_head().weights(dict(zip(given.names, given.values.T, strict=True)))
    assert weights.shape == (len(given.values), 52) and weights.max() > 0.5


def test_frames_too_far_apart_are_told(tmp_path):
    path = tmp_path / "take.csv"
    path.write_text("time,JawOpen\n0,0.1\n1e9,0.2\n")
    with pytest.raises(DnnvssError, match=r"frames lie 1e\+09 s apart"):
        read_take(path)


@pytest.mark.parametrize("suffix", ["csv", "json"])
@pytest.mark.parametrize("source, wanted, frames", [
    ("30", "24", 78), ("30", "60", 196), ("60", "30", 49), ("60", "24", 39), ("24", "30", 123), ("25", "50", 196),
])
def test_a_take_at_another_rate_lasts_as_long_and_begins_when_it_began(tmp_path, suffix, source, wanted, frames):
    """98 frames: as many of the other rate as fill their time, and a half second of time code stays a half second."""
    clock, other, half = FrameClock(source), FrameClock(wanted), int(source) // 2
    path = write_take(tmp_path / f"take.{suffix}", Take({"jawOpen": np.arange(98.0)}, clock, TimeCode(1, 2, 3, half)))
    read = read_take(path, other)
    assert read.frames == frames == math.floor(98 * other.rate / clock.rate + 1 / 2)
    assert read.start == TimeCode(1, 2, 3, half * int(wanted) // int(source))
    track = {name.lower(): values for name, values in read.curves.items()}["jawopen"]
    np.testing.assert_allclose(track, np.minimum(np.arange(frames) * float(clock.rate / other.rate), 97), atol=1e-9)


def test_a_first_frame_keeps_its_moment_at_another_drop_frame_rate():
    start, film, fast = TimeCode(0, 1, 0, 2, drop=True), FrameClock("29.97"), FrameClock("59.94")
    assert start.counted(film, fast) == TimeCode(0, 1, 0, 4, drop=True)
    assert start.counted(film, fast).counted(fast, film) == start
    assert start.counted(film, FrameClock(24)) == TimeCode(0, 1, 0, 1)


def test_codes_that_pass_no_second_count_to_the_rate_that_is_given(tmp_path):
    track = np.linspace(0, 1, 20)
    path = write_take(tmp_path / "take.csv", Take({"jawOpen": track}, FrameClock(60), TimeCode(0, 0, 7, 5)))
    with pytest.raises(DnnvssError, match=r"go to frame 24 and pass no second.*Give the frame rate"):
        read_take(path)
    with pytest.raises(DnnvssError, match="pass no second"):
        read_take(path, FrameClock(24))
    for read in (read_take(path, FrameClock(60)), read_take(path, made_at=FrameClock(60))):
        np.testing.assert_allclose(read.curves["JawOpen"], track, atol=1e-9)
        assert read.clock == FrameClock(60) and read.start == TimeCode(0, 0, 7, 5)

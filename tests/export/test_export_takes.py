"""Takes for animators' programs: time codes, Live Link Face, JSON, glTF, and lists of visemes."""

import json

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.export.live_link import SHAPES, TURNS
from dnnvss.export.take import Take, write_take
from dnnvss.export.timecode import TimeCode
from dnnvss.export.visemes import oculus_curves, viseme_cues, write_cues
from dnnvss.face.mesh import packaged_head
from dnnvss.face.mesh.gltf_read import read_gltf
from dnnvss.face.mesh.tongue import speaking_head
from dnnvss.formats.curves import read_curves
from dnnvss.phones import PHONES
from dnnvss.phones.viseme_lists import OCULUS, VISEMES
from dnnvss.timing import FrameClock, Tier

PAPA = Tier(
    "phones",
    [
        (1.0, 1.2, "sil"),
        (1.2, 1.3, "P"),
        (1.3, 1.5, "AY"),
        (1.5, 1.6, "P"),
        (1.6, 1.7, "B"),
        (1.7, 2.0, "sil"),
    ],
)


def arkit(frames: int) -> dict[str, np.ndarray]:
    """A curve for each shape of the packaged head."""
    draw = np.random.default_rng(0)
    return {name: draw.random(frames) for name in packaged_head().names}


def test_time_codes_count_frames_in_the_whole_number_nearest_to_the_rate():
    assert TimeCode(1, 2, 3, 24).codes(3, FrameClock(25)) == [
        "01:02:03:24",
        "01:02:04:00",
        "01:02:04:01",
    ]
    assert TimeCode(23, 59, 59, 29).codes(2, FrameClock("29.97")) == ["23:59:59:29", "00:00:00:00"]
    assert TimeCode().codes(101, FrameClock(240))[100] == "00:00:00:100"
    assert str(TimeCode.from_setting("10:00:00;05", "x")) == "10:00:00;05"


@pytest.mark.parametrize("text", ["", "1:2:3", "24:00:00:00", "00:60:00:00", "00:00:00:-1", 7])
def test_what_is_no_time_code_is_told(text):
    with pytest.raises(DnnvssError, match="no time code"):
        TimeCode.from_setting(text, "rig_timecode")


def test_a_first_frame_beyond_the_rate_is_told():
    with pytest.raises(DnnvssError, match="begins with frame 25"):
        TimeCode(0, 0, 0, 25).codes(1, FrameClock(25))


@pytest.mark.parametrize("rate", ["24", "25", "30", "60"])
def test_live_link_files_come_back_equal(tmp_path, rate):
    curves, clock = arkit(130), FrameClock(rate)
    path = write_take(tmp_path / "take.csv", Take(curves, clock, TimeCode(23, 59, 58)))
    read = read_curves(path)
    assert read.names == (*SHAPES, *TURNS)
    own = {name.lower(): track for name, track in curves.items()}
    for name, track in zip(read.names, read.values.T, strict=True):
        np.testing.assert_allclose(track, own.get(name.lower(), np.zeros(130)), atol=1e-10)
    np.testing.assert_allclose(np.diff(read.times), 1 / int(rate), atol=1e-9)


def test_the_order_is_that_of_the_app():
    assert len(SHAPES) == 52 and len(TURNS) == 9
    assert SHAPES[:3] == ("EyeBlinkLeft", "EyeLookDownLeft", "EyeLookInLeft")
    assert {name.lower() for name in SHAPES} == {name.lower() for name in packaged_head().names}


def test_curves_of_other_names_become_columns_and_json(tmp_path):
    take = Take({"open": np.array([0, 0.5]), "jaw": np.array([0.1, 0.2])}, FrameClock(25))
    rows = write_take(tmp_path / "take.csv", take).read_text().splitlines()
    assert (
        rows[0] == "frame,seconds,timecode,open,jaw" and rows[2] == "1,0.040000,00:00:00:01,0.5,0.2"
    )
    held = json.loads(write_take(tmp_path / "take.json", take).read_text())
    assert held["names"] == ["open", "jaw"] and held["frames"] == [[0, 0.1], [0.5, 0.2]]
    assert held["rate"] == "25" and held["timecodes"][1] == "00:00:00:01"


def test_no_curve_is_lost_beside_those_of_arkit(tmp_path):
    """The file of the app has ARKit's names alone, and the packaged head has two of the tongue besides."""
    beside = Take(arkit(3) | {"open": np.array([0, 0.25, 0.5])}, FrameClock(25))
    assert write_take(tmp_path / "take.csv", beside).read_text().splitlines()[2].endswith(",0.25")
    spoken = Take(dict.fromkeys(speaking_head().names, np.zeros(3)), FrameClock(25))
    assert write_take(tmp_path / "take.csv", spoken).read_text().startswith("Timecode,BlendShapeCount,EyeBlinkLeft")


def test_a_glb_needs_a_head_and_holds_its_shapes(tmp_path):
    take = Take(arkit(12), FrameClock(25), head=packaged_head())
    assert read_gltf(write_take(tmp_path / "take.glb", take)).names == packaged_head().names
    with pytest.raises(DnnvssError, match="no head is moved"):
        write_take(tmp_path / "take.glb", Take({"open": np.zeros(2)}, FrameClock(25)))
    with pytest.raises(DnnvssError, match=r"cannot be written as \.fbx"):
        write_take(tmp_path / "take.fbx", take)


@pytest.mark.parametrize("name", list(VISEMES))
def test_every_phone_has_a_viseme_and_closed_lips_share_one(name):
    table = VISEMES[name]
    assert set(table) == set(PHONES) and all(table.values())
    assert table["P"] == table["B"] == table["M"] and table["F"] == table["V"]
    assert len({table["P"], table["F"], table["AA"], table["sil"], table["UW"]}) == 5


def test_cues_begin_at_the_first_phone_and_join_where_they_are_one():
    cues = viseme_cues(PAPA, "rhubarb")
    assert [c.viseme for c in cues] == ["X", "A", "D", "B", "A", "X"]
    assert [round(c.start, 6) for c in cues] == [0, 0.2, 0.3, 0.4, 0.5, 0.7] and cues[-1].end == 1.0


def test_files_of_cues(tmp_path):
    assert write_cues(tmp_path / "a.tsv", PAPA, "rhubarb").read_text().splitlines() == [
        "0.00\tX",
        "0.20\tA",
        "0.30\tD",
        "0.40\tB",
        "0.50\tA",
        "0.70\tX",
        "1.00\tX",
    ]
    mouth = json.loads(write_cues(tmp_path / "a.json", PAPA, "rhubarb", "a.wav").read_text())
    assert mouth["metadata"] == {"soundFile": "a.wav", "duration": 1.0}
    assert mouth["mouthCues"][1] == {"start": 0.2, "end": 0.3, "value": "A"}
    azure = json.loads(write_cues(tmp_path / "b.json", PAPA, "azure").read_text())
    assert azure[1] == {"audioOffset": 2_000_000, "visemeId": 21}
    with pytest.raises(DnnvssError, match=r"visemes of azure are not written as \.tsv"):
        write_cues(tmp_path / "b.tsv", PAPA, "azure")


def test_oculus_curves_add_up_to_one_and_peak_in_their_phones():
    clock = FrameClock(100)
    curves = oculus_curves(PAPA, clock, 100)
    assert tuple(curves) == OCULUS
    np.testing.assert_allclose(sum(curves.values()), 1)
    assert (
        curves["PP"][25] > 0.99
        and curves["aa"][34] > 0.9
        and curves["ih"][46] > 0.9
        and curves["sil"][5] == 1
    )

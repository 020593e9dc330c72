"""A rig's parameters are its curves: names, ranges, gauges, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from face.rig_cases import CURVES, GROUPS, clips, values

from dnnvss.errors import DnnvssError
from dnnvss.face.base import moving
from dnnvss.face.rig import RigFace, RigSettings, encode_rig, fit_rig
from dnnvss.render.bars import Bars


def face() -> RigFace:
    return fit_rig(clips(), GROUPS)


def test_parameters_are_the_curves_that_move() -> None:
    rig, code = face(), encode_rig(face(), clips(1)[0])
    assert rig.names == ("JawOpen", "MouthClose", "HeadYaw") and rig.all_curves == CURVES
    assert code.parameters == pytest.approx(values(0)[:, [0, 1, 3]], abs=1e-6) and code.valid.all()
    assert rig.curves(code.parameters) == pytest.approx(values(0), abs=1e-6)


def test_ranges_are_the_usual_ones_or_what_training_shows() -> None:
    rig = face()
    low = min(c.landmarks()[0][:, 3].min() for c in clips())
    assert rig.ranges[:2].tolist() == [[0, 1], [0, 1]] and rig.ranges[2, 0] == pytest.approx(low)
    given = fit_rig(clips(), GROUPS, RigSettings(ranges={"HeadYaw": (-2.0, 2.0)}))
    assert given.ranges[2].tolist() == [-2, 2]
    assert rig.curves(np.array([5.0, -5.0, 0.0])).tolist() == [1, 0, 0.25, 0]


def test_gauges_are_curves_by_name_and_sums_of_them() -> None:
    gauges, row = face().gauges, np.array([0.75, 0.25, 0.1])
    assert {"JawOpen", "MouthClose", "HeadYaw", "aperture"} == set(gauges)
    assert gauges["JawOpen"](row) == 0.75 and gauges["aperture"](row) == 0.5
    still = fit_rig(
        clips(), GROUPS, RigSettings(gauges={"up": {"BrowInnerUp": 2.0, "JawOpen": 1.0}})
    )
    assert still.gauges["up"](row) == pytest.approx(1.25) and "aperture" not in still.gauges


def test_what_is_no_rig_is_refused() -> None:
    with pytest.raises(DnnvssError, match="holds points"):
        fit_rig(clips(), {"lips": (0, 4)})
    with pytest.raises(DnnvssError, match="'Nose', which is no curve"):
        fit_rig(clips(), GROUPS, RigSettings(ranges={"Nose": (0.0, 1.0)}))
    with pytest.raises(DnnvssError, match="is 1 to 0"):
        RigSettings(ranges={"JawOpen": (1.0, 0.0)})
    with pytest.raises(DnnvssError, match="needed"):
        fit_rig(clips(), {f"curve{i}": (i, i + 1) for i in range(9)})


def test_a_damaged_file_is_told(tmp_path: Path) -> None:
    path = face().save(tmp_path / "face.npz")
    arrays = dict(np.load(path))
    np.savez(path, **{**arrays, "moving": np.ones(4, bool)})
    with pytest.raises(DnnvssError, match="not those of its parameters"):
        RigFace.load(path)


def test_bars_are_as_long_as_their_curves() -> None:
    bars = Bars(face())
    empty, full = bars.frames(np.array([[0.0, 0.0, 0.0], [1.0, 0.5, 0.0]]))
    changed = (empty != full).any(axis=2).sum(axis=1)
    lengths = [int(n) for n in np.unique(changed) if n]
    assert lengths == pytest.approx([(bars.size[0] - 202) / 2, bars.size[0] - 202], abs=2)
    assert empty.shape == (bars.size[1], bars.size[0], 3)


def test_curves_that_stand_still_are_exactly_still() -> None:
    rig, x = face(), np.zeros((6, 3))
    x[:, 0], x[:, 1] = np.arange(6) / 10, 1e-5 * np.arange(6)
    frames = np.array([True] * 4 + [False] * 2)
    found = moving(rig, x, frames)
    assert np.array_equal(found[:, 0], x[:, 0]) and np.ptp(found[:, 1:], axis=0).max() == 0
    assert found[0, 1] == pytest.approx(1.5e-5) and moving(None, x, frames) is x

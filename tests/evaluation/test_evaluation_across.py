"""Runs of different faces in one table: what their faces share is compared, each against its own truth."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from evaluation.test_evaluation_comparison import CLOCK, bench, mouth, system
from face.face_cases import LinearFace, rig

from dnnvss.errors import DnnvssError
from dnnvss.evaluation.across import GaugeFace, Side, compare_faces, shared_gauges
from dnnvss.evaluation.bench import Bench
from dnnvss.evaluation.page import write_page
from dnnvss.face.base import Gauge

MIX = np.array([[0.0, 2.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 5.0]])
"""Parameters of the other face are those of the first times this."""


def other_face() -> LinearFace:
    """The same mouth with its parameters in another order and of another size."""
    face = mouth()
    inverse = np.linalg.inv(MIX)
    gauges = {n: Gauge(n, inverse @ g.vector, g.constant) for n, g in face.gauges.items()}
    return LinearFace(face.mean, np.tensordot(inverse, face.modes, axes=1), gauges)


def sides() -> dict[str, Side]:
    first = bench()
    sentences = tuple(replace(s, reference=s.reference @ MIX) for s in first.sentences)
    second = Bench(sentences, CLOCK, other_face(), first=2)
    good = system(first, 0.4)
    return {"aam": Side(first, {"one": good}),
            "points": Side(second, {"two": {i: x @ MIX for i, x in good.items()}, "three": system(second, 2.0)})}


def test_the_same_movement_of_two_faces_is_judged_alike_by_gauges() -> None:
    result, _ = compare_faces(sides())
    assert result.systems == ("one", "two", "three")
    assert list(result.pairs)[:3] == ["one", "two", "three"] and "truth (points)" in result.pairs
    names = [m.name for m in result.measures]
    assert names[:4] == ["correlation", "aperture_correlation", "lower_lip_correlation", "width_correlation"]
    assert "landmarks" not in names and "rmse" not in names
    for name in names[1:]:
        assert result.pairs["two"][name] == pytest.approx(result.pairs["one"][name], abs=1e-9), name
    assert result.estimate("three", "aperture_correlation").value < result.estimate("two", "aperture_correlation").value
    assert result.estimate("truth (aam)", "aperture_correlation").value == pytest.approx(1)
    assert result.pairs["two"]["correlation"] == pytest.approx(result.pairs["one"]["correlation"])  # 1, 2 are 2, 1


def test_the_table_says_that_correlations_are_each_face_s_own() -> None:
    text = compare_faces(sides())[0].markdown()
    assert "| system | correlation, own | aperture r |" in text
    assert "compare it between systems of one face only" in text


@pytest.mark.parametrize("poor", ["aam", "points"])
def test_what_one_of_the_faces_lacks_is_left_out_for_all(poor: str, tmp_path: Path) -> None:
    """Whichever of them it is: a rig may have no curve for the lower lip."""
    both = sides()
    face = both[poor].bench.face
    assert isinstance(face, LinearFace)
    gauges = {name: gauge for name, gauge in face.gauges.items() if name != "lower_lip"}
    both[poor] = replace(both[poor], bench=replace(both[poor].bench, face=replace(face, gauges=gauges)))
    result, shown = compare_faces(both)
    text = result.markdown()
    assert "f v contact recall (lower_lip), lower lip on f v (px) (lower_lip)" in result.gaps[0]
    assert result.gaps[0] in text
    assert "closure_recall" in result.to_json()["values"]["two"]
    assert "lower lip" not in write_page(tmp_path / "page.html", result, shown.bench, shown.systems).read_text()


def test_the_correlation_of_a_gauge_is_that_of_its_values() -> None:
    both = sides()
    result, _ = compare_faces(both)
    first = both["aam"].bench
    s = first.sentences[0]
    truth, own = (first.gauge("width")(x[s.spoken]) for x in (s.reference, both["aam"].systems["one"][s.id]))
    assert result.pairs["one"]["width_correlation"][0] == pytest.approx([np.corrcoef(truth, own)[0, 1], 1])


def test_all_systems_are_shown_as_gauges(tmp_path: Path) -> None:
    both = sides()
    result, shown = compare_faces(both)
    assert list(shown.systems) == ["one", "two", "three"]
    s = both["points"].bench.sentences[1]
    wanted = both["points"].bench.gauge("lower_lip")(both["points"].systems["three"][s.id])
    assert shown.systems["three"][s.id][:, 1] == pytest.approx(wanted)
    page = write_page(tmp_path / "page.html", result, shown.bench, shown.systems).read_text()
    assert "correlation, own" in page and "aperture (px)" in page


def test_faces_that_share_nothing_are_refused() -> None:
    first = bench()
    with pytest.raises(DnnvssError, match="aam, rig share no gauge"):
        shared_gauges({"aam": Side(first, {}), "rig": Side(replace(first, face=rig(3)), {})})
    deep = replace(other_face(), unit="mm")
    with pytest.raises(DnnvssError, match="measure in mm and px"):
        shared_gauges({"aam": Side(first, {}), "deep": Side(replace(first, face=deep), {})})


def test_a_face_of_gauges_is_saved_and_loaded(tmp_path: Path) -> None:
    face = GaugeFace(("aperture", "width"), np.array([1.0, 2.0]), "mm")
    again = GaugeFace.load(face.save(tmp_path / "face.npz"))
    assert again.names == face.names and again.unit == "mm"
    assert again.gauges["width"](np.array([[3.0, 4.0]])) == pytest.approx([4.0])

"""Anchors, all metrics together, phone classes, tables and the page."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from face.face_cases import LinearFace, rig
from scipy.ndimage import gaussian_filter1d

from dnnvss import DnnvssError
from dnnvss.evaluation.anchors import anchors, delayed
from dnnvss.evaluation.bench import Bench, Sentence
from dnnvss.evaluation.comparison import CLASSES, compare, phone_class
from dnnvss.evaluation.measures import MEASURES
from dnnvss.evaluation.page import write_page
from dnnvss.face.base import APERTURE, LOWER_LIP, WIDTH, Face, Gauge
from dnnvss.phones import PHONES
from dnnvss.timing import FrameClock, Tier

CLOCK = FrameClock(100)


def mouth() -> LinearFace:
    """Two lips: the first coefficient opens them, the second spreads the corners, the third does nothing."""
    mean = np.array([[-20.0, 0], [0, -1.5], [20, 0], [0, 1.5]])
    modes = np.zeros((3, 4, 2))
    modes[0, 1, 1], modes[0, 3, 1], modes[1, 0, 0], modes[1, 2, 0] = -0.5, 0.5, -1, 1
    gauges = [Gauge(APERTURE, np.array([1.0, 0, 0]), 3.0), Gauge(LOWER_LIP, np.array([0.5, 0, 0]), 0.0),
              Gauge(WIDTH, np.array([0.0, 2, 0]), 40.0)]
    return LinearFace(mean, modes, {g.name: g for g in gauges})


MOUTH = mouth()


def bench(count: int = 6, face: Face | None = MOUTH) -> Bench:
    """Sentences sil AA B AA F AA sil with a closure on every B."""
    rng = np.random.default_rng(0)
    sentences = []
    for n in range(count):
        edges = np.cumsum([0, 0.3, 0.3, 0.08, 0.3 + 0.02 * n, 0.1, 0.3, 0.4])
        tier = Tier("phones", zip(edges[:-1], edges[1:], ["sil", "AA", "B", "AA", "F", "AA", "sil"], strict=True))
        frames = int(tier.frame_edges(CLOCK)[-1])
        x = gaussian_filter1d(rng.normal(size=(frames, 3)), 5, axis=0)
        x = x / x.std(axis=0)
        x[:, 0] += 2
        x[62:66, 0] = -3.0
        speech = np.zeros(frames, bool)
        speech[30 : int(tier.frame_edges(CLOCK)[-2])] = True
        sentences.append(Sentence(f"s{n}", x, tier, speech, np.ones(frames, bool)))
    return Bench(tuple(sentences), CLOCK, face, first=2)


def system(b: Bench, noise: float, gain: float = 1.0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(1)
    return {s.id: gain * s.reference + noise * gaussian_filter1d(rng.normal(size=s.reference.shape), 3, axis=0)
            for s in b.sentences}


def test_a_delay_holds_the_first_frame_and_may_be_fractional():
    x = np.array([[0.0], [2.0], [4.0]])
    assert delayed(x, 1).ravel().tolist() == [0, 0, 2] and delayed(x, 0.5).ravel().tolist() == [0, 1, 3]


def test_anchors_are_what_their_names_say():
    b = bench()
    null = anchors(b)
    assert list(null) == ["mean", "another sentence", "truth + 40 ms", "truth + 80 ms", "truth"]
    assert all((x == 0).all() for x in null["mean"].values())
    assert np.array_equal(null["truth + 40 ms"]["s0"][4:], b.sentences[0].reference[:-4])
    for s in b.sentences:
        x = null["another sentence"][s.id]
        assert x.shape == s.reference.shape and np.abs(x - s.reference).mean() > 0.1
        assert np.abs(x[62:66, 0] + 3).min() < 0.6  # speech falls on speech: the other's closure is there too
    assert list(anchors(bench(1))) == ["mean", "truth + 40 ms", "truth + 80 ms", "truth"]


def test_known_systems_get_known_values():
    b = bench()
    result = compare(b, {"half": system(b, 0.0, 0.5), "noisy": system(b, 1.0)})
    value = {s: {m.name: result.estimate(s, m.name).value for m in result.measures} for s in result.pairs}
    assert value["truth"]["correlation"] == pytest.approx(1) and value["truth"]["landmarks"] == 0
    assert value["half"]["correlation"] == pytest.approx(1) and value["half"]["gv_ratio"] == pytest.approx(0.25)
    assert value["truth"]["closure_recall"] == value["truth"]["closure_precision"] == 1
    assert value["half"]["closure_recall"] == 0 and value["mean"]["correlation"] == 0
    assert value["truth + 40 ms"]["lag"] == pytest.approx(40, abs=1)
    assert value["truth + 40 ms"]["closure_late"] == pytest.approx(40)
    assert value["half"]["jerk"] == pytest.approx(value["truth"]["jerk"] / 2)
    assert value["half"]["high_power"] == pytest.approx(value["truth"]["high_power"])
    assert value["mean"]["silence"] == 0 and value["half"]["silence"] == pytest.approx(value["truth"]["silence"] / 2)
    assert value["truth + 80 ms"]["dtw"] < value["another sentence"]["dtw"]
    share = 100 * value["noisy"]["landmarks"] / b.mouth
    assert value["noisy"]["landmark_share"] == pytest.approx(share)
    (first, second, d, _), = result.tests["correlation"]
    assert (first, second) == ("half", "noisy") and d.value < 0 and d.p < 0.1


def test_tracked_landmarks_show_what_the_face_cannot_express():
    b = bench(2)
    tracked = tuple(replace(s, landmarks=b.face.points(s.reference) + np.array([0.3, 0.4])) for s in b.sentences)
    result = compare(replace(b, sentences=tracked), {"x": system(b, 0.0)})
    assert result.estimate("truth", "landmarks").value == pytest.approx(0.5)


def test_frames_that_were_not_measured_do_not_count():
    b = bench(2)
    broken = []
    for s in b.sentences:
        valid = s.valid.copy()
        valid[40:50] = False
        broken.append(replace(s, valid=valid))
    wild = {s.id: np.where(np.isin(np.arange(len(s.reference)), range(40, 50))[:, None], 99.0, s.reference)
            for s in broken}
    result = compare(replace(b, sentences=tuple(broken)), {"wild": wild})
    assert result.estimate("wild", "rmse").value == 0 and result.estimate("wild", "landmarks").value == 0


def test_without_a_face_the_metrics_that_need_one_are_left_out():
    b = bench(2, None)
    result = compare(b, {"x": system(b, 0.5)})
    assert {m.name for m in result.measures} == {m.name for m in MEASURES if not m.needs}
    assert np.isfinite(result.estimate("x", "silence").value)


def test_a_face_is_measured_by_what_it_has_and_in_its_unit():
    b = bench(2)
    whole = compare(b, {"x": system(b, 0.5)})
    bare = compare(bench(2, rig(3)), {"x": system(b, 0.5)})
    assert {m.name for m in bare.measures} == {m.name for m in MEASURES if not m.needs}
    assert set(bare.classes["x"]["vowel"]) == {"rmse"}
    lips = replace(MOUTH, gauges={n: g for n, g in MOUTH.gauges.items() if n != LOWER_LIP}, unit="mm")
    result = compare(bench(2, lips), {"x": system(b, 0.5)})
    left = {m.name for m in whole.measures} - {m.name for m in result.measures}
    assert left == {"contact_recall", "contact_place"}
    assert set(result.lacking.values()) == {"lower_lip"} and "f v contact recall (lower_lip)" in result.markdown()
    assert not whole.lacking and set(bare.lacking.values()) == {"aperture", "lower_lip", "points", "points, width"}
    assert result.estimate("x", "lag").value == whole.estimate("x", "lag").value
    assert "landmarks (mm)" in result.markdown() and "in mm of the reference frame" in result.markdown()
    assert "UNIT" not in result.markdown() + whole.markdown() + json.dumps(whole.to_json())


def test_every_phone_has_a_class_and_errors_are_counted_in_it():
    assert {phone_class(p) for p in PHONES} == set(CLASSES)
    b = bench(2)
    off = {}
    for s in b.sentences:
        x = s.reference.copy()
        first, last = s.tier.frame_edges(CLOCK)[2:4]
        x[first:last, 0] += 2.0
        off[s.id] = x
    by = compare(b, {"x": off}).classes["x"]
    pooled = {c: m["aperture"].sum(axis=0) for c, m in by.items()}
    assert pooled["bilabial"][0] / pooled["bilabial"][1] == pytest.approx(2.0)
    assert pooled["vowel"][0] == 0 and pooled["silence"][1] > 0
    rmse = by["bilabial"]["rmse"].sum(axis=0)
    assert rmse[0] / rmse[1] == pytest.approx(np.sqrt((2.0 / b.scale[0]) ** 2 / 2))


def test_reports(tmp_path):
    b = bench(8)
    systems = {"a & <b>": system(b, 0.5), "other": system(b, 1.0)}
    result = compare(b, systems)
    text = result.markdown()
    assert [m.name for m in result.measures] == [m.name for m in MEASURES]
    for m in result.measures:
        assert m.title in text and m.definition in text
    assert "Paired differences" in text and "other less a & <b>" in text and "truth + 80 ms" in text
    data = json.loads(json.dumps(result.to_json(), allow_nan=False))
    assert data["values"]["truth"]["correlation"]["value"] == 1.0 and len(data["pairs"]["other"]["rmse"]) == 8
    assert data["phone_classes"]["truth"]["vowel"]["rmse"] == 0
    assert "closure recall" in result.table()
    (tmp_path / "run" / "videos").mkdir(parents=True)
    (tmp_path / "run" / "videos" / "s1.mp4").write_bytes(b"")
    page = write_page(tmp_path / "out" / "e.html", result, b, systems, {"other": tmp_path / "run"}).read_text("utf-8")
    assert "a &amp; &lt;b&gt;" in page and "<b>" not in page.replace("a & <b>", "")
    assert page.count("<details open>") == 1 and page.count("<details>") >= 6  # one sentence is open, the rest folded
    assert not re.search(r'(src|href)="(https?:)?//', page)  # nothing is fetched
    embedded = json.loads(re.search(r'id="data">(.*?)</script>', page).group(1))
    assert len(embedded) == 3 and len(embedded[0]["faces"]) == 3
    shown = np.array(embedded[0]["faces"][0])
    assert shown.shape == (embedded[0]["frames"], 8)
    if 's1.mp4"' in page:
        assert 'src="../run/videos/s1.mp4"' in page
    assert page.count("<canvas") == 9 and page.count('class="cursor"') == 6


@pytest.mark.parametrize("count, title", [(4, "Evaluation: s0, s1, s2, s3"), (5, "Evaluation: 5 systems")])
def test_the_title_names_a_few_systems_and_counts_many(tmp_path, count, title):
    b = bench(3)
    systems = {f"s{k}": system(b, 0.5) for k in range(count)}
    page = write_page(tmp_path / "e.html", compare(b, systems), b, systems).read_text("utf-8")
    assert f"<title>{title}</title>" in page


def test_systems_that_predict_the_same_are_named(tmp_path):
    """A sweep over labels with a system that reads the phones themselves says so, and not only equal numbers."""
    b = bench(6)
    systems = {"kernel ph": system(b, 0.5), "other": system(b, 1.0)}
    systems["kernel ph_a"] = {i: x.copy() for i, x in systems["kernel ph"].items()}
    result = compare(b, systems)
    told = "kernel ph and kernel ph_a predict the same in every frame"
    assert result.twins == (("kernel ph", "kernel ph_a"),)
    page = write_page(tmp_path / "e.html", result, b, systems).read_text("utf-8")
    assert told in result.markdown() and told in result.table() and told in page
    assert not compare(b, {"one": system(b, 0.5), "two": system(b, 1.0)}).same


def test_every_one_of_many_systems_has_a_line_of_its_own(tmp_path):
    b = bench(3)
    systems = {f"s{k}": system(b, 0.5) for k in range(15)}
    page = write_page(tmp_path / "e.html", compare(b, systems, with_anchors=False), b, systems).read_text("utf-8")
    plots = [plot for plot in re.findall(r"<svg viewBox=.*?</svg>", page) if "polyline" in plot]
    lines = [re.findall(r'<polyline points="[^"]*" fill="none" ([^/]*)/>', plot) for plot in plots]
    assert len(lines) == 6 and all(len(set(own)) == len(own) == 16 for own in lines)
    assert all(len(re.findall(rf"</svg> {name}</span>", page)) == 3 for name in systems)


def test_systems_of_different_inputs_are_told_apart(tmp_path):
    b = bench(8)
    systems = {"one": system(b, 0.5), "two": system(b, 1.0), "three": system(b, 1.5)}
    result = compare(b, systems).with_inputs({"one": "voice", "two": "text", "three": "voice"})
    assert result.systems == ("two", "one", "three") and list(result.pairs)[:3] == ["two", "one", "three"]
    text = result.markdown()
    assert "| system | driven by |" in text and "| two | text |" in text and "no ranking of each other" in text
    assert "one [voice] less two [text]" in text and "three less one" in text
    assert "one [voice] less two [text]" in write_page(tmp_path / "e.html", result, b, systems).read_text("utf-8")
    assert result.to_json()["driven_by"]["two"] == "text" and "driven by" in result.table()
    alike = result.with_inputs(dict.fromkeys(systems, "text"))
    assert not alike.rivals and "[text]" not in alike.markdown()
    assert not compare(b, systems).rivals and "driven by" not in compare(b, systems).markdown()


def test_what_does_not_fit_is_named():
    b = bench(2)
    with pytest.raises(DnnvssError, match="utterance s1: system 'x' has no prediction"):
        compare(b, {"x": {"s0": b.sentences[0].reference}})
    with pytest.raises(DnnvssError, match=r"utterance s0: system 'x' predicts \(5, 3\)"):
        compare(b, {"x": {"s0": np.zeros((5, 3)), "s1": b.sentences[1].reference}})
    with pytest.raises(DnnvssError, match="nothing to compare"):
        compare(b, {})


def test_what_cannot_say_anything_is_left_out():
    b = bench(8)
    same = compare(b, {"one": system(b, 0.5), "again": system(b, 0.5)})
    kept, without = same.telling()
    found = [d for m in same.measures for _, _, d, _ in same.tests[m.name]]
    assert not kept and without == sum(not np.isnan(d.value) for d in found)
    assert f"{without} differences are left out" in same.markdown() and "1.0000" not in same.markdown()
    few = bench(5)
    result = compare(few, {"one": system(few, 0.5), "two": system(few, 1.0)})
    assert np.isnan(result.estimate("one", "rmse").low) and result.telling()[0] == []
    assert "5 sentences are too few for an interval or a test" in result.markdown()
    assert not compare(b, {"one": system(b, 0.5)}).few


def test_systems_of_two_styles_are_tested_within_a_style_and_within_a_run():
    b = bench(8)
    styles = {"": "plain", ", loud": "loud"}
    origins = {f"{run}{end}": (run, style) for end, style in styles.items() for run in ("one", "two")}
    systems = {name: system(b, noise) for name, noise in zip(origins, (0.1, 0.4, 0.2, 0.5), strict=True)}
    result = compare(b, systems).with_inputs(dict.fromkeys(systems, "text"), origins)
    assert [(first, second) for first, second, _, _ in result.tests["rmse"]] == [
        ("one", "two"), ("one", "one, loud"), ("two", "two, loud"), ("one, loud", "two, loud")]
    assert "for the 4 of its metric" in result.markdown()

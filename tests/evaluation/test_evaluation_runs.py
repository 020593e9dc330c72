"""From a run folder on disk to the report: the toy talker of the appearance model's tests."""

import json
import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, open_browser
from conftest import composed, run_command
from face.aam_cases import CONFIG, clip_arrays, corpus

from dnnvss import DnnvssError, files
from dnnvss.archives import read_arrays
from dnnvss.commands.train_settings import run_settings
from dnnvss.curves import resample
from dnnvss.evaluation import figure
from dnnvss.evaluation.runs import make_bench, on_one_clock, open_corpus, read_run
from dnnvss.face.aam import encode_clip, fit_aam
from dnnvss.face.clips import Clip
from dnnvss.media import write_video
from dnnvss.runs.files import RunFiles
from dnnvss.timing import FrameClock


def toys(data):
    """Return name and clip of each sentence of the toy corpus, as its landmarks are on disk."""
    def images(seed):
        return clip_arrays(seed, move=(0.3 * seed, 0.2 * seed))[0]

    return [(u.id, Clip(u.id, 25.0, partial(data.landmarks, u), partial(images, seed)))
            for seed, u in enumerate(data.utterances.values())]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run of the toy corpus whose prediction is the truth, half as far from the mean."""
    tmp_path = tmp_path_factory.mktemp("toy")
    data = corpus(tmp_path / "corpus", 3)
    model = fit_aam([c for _, c in toys(data)], data.info.landmark_groups, CONFIG, progress=False)
    folder = tmp_path / "run"
    model.save(RunFiles(folder).face)
    cache = tmp_path / "corpus" / "face" / "key"
    model.save(cache / "face.npz")
    files.write_json(cache / "report.json", {"face": "aam", "dropped": {}})
    reference = {}
    for name, clip in toys(data):
        code = encode_clip(model, clip.images(), *clip.landmarks(), 25.0)
        code.save(cache / "codes" / f"{name}.npz")
        reference[name] = resample(code.parameters, FrameClock(25), FrameClock(100))
    speech = {i: np.arange(len(x)) >= 20 for i, x in reference.items()}
    arrays = {"reference": reference, "predicted": {i: 0.5 * x for i, x in reference.items()}, "speech": speech,
              "valid": {i: np.ones(len(x), bool) for i, x in reference.items()}}
    for kind, values in arrays.items():
        files.write_arrays(folder / "predictions" / f"{kind}.npz", **values)
    run_settings(composed("train", "model=feedforward", f"corpus.out={tmp_path}/corpus")).write(folder)
    files.write_json(folder / "run.json", {"corpus": data.fingerprint})
    return folder


def test_landmarks_are_tracked_and_in_the_frame_of_the_face(run):
    bench = make_bench([read_run(run)])
    assert [s.id for s in bench.sentences] == ["toy0", "toy1", "toy2"] and bench.clock == FrameClock(100)
    for s in bench.sentences:
        expressed = bench.face.points(s.reference)
        assert s.landmarks.shape == expressed.shape
        assert np.abs(s.landmarks - expressed).mean() < 0.5  # pixels: what the six modes leave out
    x = bench.sentences[0].reference
    assert bench.gauge("aperture")(x).std() > 0.5
    moved = np.corrcoef(bench.gauge("aperture")(x), bench.gauge("lower_lip")(x))[0, 1]
    assert moved > 0.9  # the toy talker opens with the lower lip


def test_the_command_writes_three_reports(run, tmp_path, capsys):
    assert run_command("compare", str(run), "--out", str(tmp_path / "out"), "--first", "2") == 0
    result = json.loads((tmp_path / "out" / "evaluation.json").read_text())
    assert result["values"]["run"]["gv_ratio"]["value"] == pytest.approx(0.25, abs=1e-4)
    assert result["values"]["run"]["correlation"]["value"] == pytest.approx(1.0)
    assert result["values"]["truth"]["landmarks"]["value"] > 0
    assert "truth + 80 ms" in (tmp_path / "out" / "evaluation.md").read_text()
    assert (tmp_path / "out" / "evaluation.html").stat().st_size > 20_000
    assert str(tmp_path / "out") in capsys.readouterr().out.splitlines()[-1]


def test_another_corpus_is_refused(run, tmp_path, capsys):
    stale = Path(shutil.copytree(run, tmp_path / "stale"))
    files.write_json(stale / "run.json", {"corpus": "somethingelse"})
    assert run_command("compare", str(stale)) == 1
    assert "was trained on the corpus somethingelse" in capsys.readouterr().err
    assert not (stale / "evaluation").exists()


def test_a_corpus_that_was_moved_with_its_runs_is_found_and_one_that_is_gone_is_told(run, tmp_path):
    home = tmp_path / "new home"
    moved = Path(shutil.copytree(run, home / "runs" / "toy"))
    gone = tmp_path / "gone" / "corpus"
    settings = (moved / "config.yaml").read_text().replace(str(run.parent / "corpus"), str(gone))
    files.write_text(moved / "config.yaml", settings)
    with pytest.raises(DnnvssError, match=f"which is not there.*ln -s WHERE {gone}"):
        open_corpus(moved, gone)
    shutil.copytree(run.parent / "corpus", home / "data" / "corpus")
    assert open_corpus(moved, gone).root == home / "data" / "corpus"


def test_runs_that_do_not_fit_are_refused(run, tmp_path, capsys):
    assert run_command("compare", str(tmp_path / "nothing")) == 1
    assert "no such file" in capsys.readouterr().err
    assert run_command("compare", str(run), str(run)) == 1
    assert "named twice" in capsys.readouterr().err
    other = tmp_path / "other"
    for name in ("config.yaml", "run.json"):
        files.write_text(other / name, (run / name).read_text())
    for kind in ("predicted", "speech", "valid", "reference"):
        arrays = read_arrays(run / "predictions" / f"{kind}.npz")
        files.write_arrays(other / "predictions" / f"{kind}.npz", **{k: v for k, v in arrays.items() if k != "toy1"})
    with pytest.raises(DnnvssError, match="other sentences"):
        make_bench([read_run(run), read_run(other)])


def at_rate(run, folder, rate):
    """The run as it would be at another rate: curves from the video to that clock, half as far from the mean."""
    clock, lead = FrameClock(rate), read_run(run).arrays
    folder.mkdir()
    for name in ("run.json", "face.npz"):
        shutil.copyfile(run / name, folder / name)
    codes = {i: np.load(run.parent / "corpus" / "face" / "key" / "codes" / f"{i}.npz")["parameters"]
             for i in lead["reference"]}
    reference = {i: resample(x.astype(float), FrameClock(25), clock) for i, x in codes.items()}
    arrays = {"reference": reference, "predicted": {i: 0.5 * x for i, x in reference.items()},
              "speech": {i: np.ones(len(x), bool) for i, x in reference.items()},
              "valid": {i: np.ones(len(x), bool) for i, x in reference.items()}}
    for kind, values in arrays.items():
        files.write_arrays(folder / "predictions" / f"{kind}.npz", **values)
    text = (run / "config.yaml").read_text()
    files.write_text(folder / "config.yaml", text.replace("rate: 100", f"rate: {rate}"))
    return folder


def test_runs_of_other_rates_are_measured_on_the_finest_clock(run, tmp_path, capsys):
    slow = at_rate(run, tmp_path / "slow", 50)
    lead = read_run(run)
    told = on_one_clock({"slow": read_run(slow), "fast": lead})
    assert told["slow"].clock == FrameClock(100) and told["fast"] is lead
    for i, x in told["slow"].arrays["predicted"].items():
        assert x.shape == lead.arrays["reference"][i].shape
        np.testing.assert_array_equal(told["slow"].arrays["reference"][i], lead.arrays["reference"][i])
        np.testing.assert_array_equal(told["slow"].arrays["speech"][i], lead.arrays["speech"][i])
        np.testing.assert_allclose(x, 0.5 * lead.arrays["reference"][i], atol=0.05 * np.abs(x).max())
    assert run_command("compare", str(slow), str(run), "--out", str(tmp_path / "out"), "--first", "2") == 0
    values = json.loads((tmp_path / "out" / "evaluation.json").read_text())["values"]
    assert values["slow"]["correlation"]["value"] == pytest.approx(values["run"]["correlation"]["value"], abs=0.01)
    page = (tmp_path / "out" / "evaluation.md").read_text()
    assert "All were measured at 100 frames a second" in page and "| slow | 50 |" in page
    capsys.readouterr()


def test_runs_of_one_clock_stand_as_they_are(run):
    own = read_run(run)
    assert on_one_clock({"a": own, "b": own}) == {"a": own, "b": own}


def test_another_rate_with_another_face_is_refused(run, tmp_path):
    slow = at_rate(run, tmp_path / "slow", 50)
    (slow / "face.npz").write_bytes(b"another")
    with pytest.raises(DnnvssError, match="has 50 frames a second, and no run of the finest rate has its face"):
        on_one_clock({"slow": read_run(slow), "fast": read_run(run)})


@pytest.mark.skipif(not CHROMIUM, reason="needs the program chromium to open the report")
def test_the_report_opens_from_disk_in_a_browser_and_its_video_plays(run, tmp_path):
    grey = [np.full((64, 96, 3), 10 * (i % 20), dtype=np.uint8) for i in range(50)]
    for i in range(3):
        write_video(run / "videos" / f"toy{i}.mp4", grey, 25, np.zeros(32000), 16000)
    files.write_arrays(run / "predictions" / "predicted_lively.npz",
                       **read_arrays(run / "predictions" / "reference.npz"))
    assert run_command("compare", str(run), "--out", str(run / "evaluation"), "--first", "2") == 0
    page = run / "evaluation" / "evaluation.html"
    assert "run, lively" in page.read_text()
    with open_browser(tmp_path / "profile") as browser:
        browser.call("Page.navigate", url=page.as_uri())
        browser.wait("document.readyState === 'complete' && !!document.querySelector('.sentence button')")
        browser.ask("window.faults = []; addEventListener('error', e => faults.push(e.message))")
        browser.ask("document.querySelector('.sentence button').click()")
        browser.wait("document.querySelector('video').currentTime > 0.2")
        browser.wait("document.querySelector('.sentence output').textContent > '0.00 s'")
        assert browser.ask("document.querySelector('video').videoWidth") == 96
        assert browser.ask("faults.join()") == ""


def test_coefficients_are_drawn_by_name_and_number(run, tmp_path, monkeypatch, capsys):
    panels = {}
    real = figure.plot_panels
    monkeypatch.setattr(figure, "plot_panels", lambda p, given, *rest: panels.update(given) or real(p, given, *rest))
    assert run_command("figure", run, "--coefficient", "aam01", "2", "--out", tmp_path / "two.png") == 0
    arrays = read_run(run).arrays
    first = next(iter(arrays["reference"]))
    assert list(panels) == ["aam01", "coefficient 2"] and (tmp_path / "two.png").stat().st_size > 10_000
    np.testing.assert_array_equal(panels["aam01"]["reference"], arrays["reference"][first][:, 0])
    np.testing.assert_array_equal(panels["coefficient 2"]["ph_class"], arrays["predicted"][first][:, 1])
    for wrong in ("0", "mouth"):
        assert run_command("figure", run, "--coefficient", wrong) == 1
        assert f"no coefficient {wrong}" in capsys.readouterr().err

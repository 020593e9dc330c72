"""Where a synthesis is drawn: a video with its landmarks beside it as footage, at another frame rate, side by side."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from face.aam_cases import CONFIG, GROUPS, SIZE, clip_arrays, clips

from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.errors import DnnvssError
from dnnvss.face.aam import fit_aam
from dnnvss.media import write_video
from dnnvss.synthesis.footage import footage_files, read_footage
from dnnvss.synthesis.request import Scene
from dnnvss.synthesis.stage import Stage, open_stage
from dnnvss.timing import FrameClock


@pytest.fixture(scope="module")
def run() -> SimpleNamespace:
    """What of a run is needed here: its face."""
    return SimpleNamespace(face=fit_aam(clips(5), GROUPS, CONFIG, progress=False))


@pytest.fixture
def film(tmp_path: Path) -> Path:
    images, points, valid = clip_arrays(50)
    valid[0] = False
    files.write_arrays(tmp_path / "film.npz", points=points, valid=valid)
    return write_video(tmp_path / "film.mp4", images, 25, quality=1)


def opened(film: Path, run: SimpleNamespace, seconds: float, rate: float | None = None) -> Stage:
    footage = read_footage(run, str(film))  # type: ignore[arg-type]
    scene = Scene(("reference", "face"), footage, rate=None if rate is None else FrameClock(rate))
    return open_stage(run, scene, seconds)  # type: ignore[arg-type]


def test_a_video_with_landmarks_beside_it_is_footage(run: SimpleNamespace, film: Path) -> None:
    stage = opened(film, run, 2.0, 50)
    assert stage.clock.rate == 50 and stage.notes["footage_frames"] == [1, 20] and stage.notes["of"] == 20
    said = "\n".join(stage.remarks)
    assert "frames 1 to 19 of 20" in said and "0.8 s for 2.0 s of speech: played back and forth" in said
    pictures = list(stage.frames(np.zeros((100, run.face.size))))
    assert len(pictures) == 100 and pictures[0].shape == (SIZE[0] + 28, 2 * SIZE[1], 3)
    recorded = np.stack(pictures)[:, 28:, :SIZE[1]].astype(int)
    footage = read_footage(run, str(film)).images  # type: ignore[arg-type]
    assert (recorded[:2] == footage[1]).all() and (recorded[2:4] == footage[2]).all()  # each frame twice: 50 from 25
    assert opened(film, run, 0.4).clock.rate == 25


def test_landmarks_that_do_not_belong_to_the_video_are_refused(run: SimpleNamespace, film: Path) -> None:
    arrays = read_arrays(film.with_suffix(".npz"))
    files.write_arrays(film.with_suffix(".npz"), points=arrays["points"][:9], valid=arrays["valid"][:9])
    with pytest.raises(DnnvssError, match=r"film\.mp4: has 20 pictures and 9 frames of landmarks"):
        read_footage(run, str(film))  # type: ignore[arg-type]
    film.with_suffix(".npz").unlink()
    with pytest.raises(DnnvssError, match=r"film\.npz: no such file, .*landmarks there\. .*of the same kind"):
        read_footage(run, str(film))  # type: ignore[arg-type]


def test_landmarks_that_nets_find_need_not_lie_beside_the_video(
        run: SimpleNamespace, film: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The nets are played here: what they are asked for are the pictures of the film."""
    given = read_footage(run, str(film)).code  # type: ignore[arg-type]
    arrays = read_arrays(film.with_suffix(".npz"))
    film.with_suffix(".npz").unlink()
    monkeypatch.setattr("dnnvss.synthesis.footage.mesh_groups", lambda: GROUPS)

    def lacking() -> Path:
        raise DnnvssError("the nets are not here", remedy="Install them so")

    monkeypatch.setattr("dnnvss.synthesis.footage.find_task", lacking)
    with pytest.raises(DnnvssError, match=r"film\.npz: no such file, and the nets are not here\. Install them so"):
        read_footage(run, str(film))  # type: ignore[arg-type]
    monkeypatch.setattr("dnnvss.synthesis.footage.find_task", lambda: film)
    monkeypatch.setattr("dnnvss.synthesis.footage.Landmarker", lambda task: task)
    monkeypatch.setattr("dnnvss.synthesis.footage.follow", lambda nets, pictures: ([None], len(list(pictures))))
    monkeypatch.setattr("dnnvss.synthesis.footage.talker", lambda tracks, frames, loud: (0, ""))
    monkeypatch.setattr("dnnvss.synthesis.footage.as_arrays",
                        lambda track, frames: (arrays["points"][:frames], arrays["valid"][:frames]))
    code = read_footage(run, str(film)).code  # type: ignore[arg-type]
    assert (code.valid == given.valid).all() and (code.pose == given.pose).all()
    monkeypatch.setattr("dnnvss.synthesis.footage.follow", lambda nets, pictures: ([], len(list(pictures))))
    with pytest.raises(DnnvssError, match=r"film\.mp4: shows no face"):
        read_footage(run, str(film))  # type: ignore[arg-type]


def test_landmarks_beside_a_video_are_divided_by_their_scale(run: SimpleNamespace, film: Path) -> None:
    plain = read_footage(run, str(film)).code  # type: ignore[arg-type]
    arrays = read_arrays(film.with_suffix(".npz"))
    files.write_arrays(film.with_suffix(".npz"), points=(4 * arrays["points"]), valid=arrays["valid"])
    with pytest.raises(DnnvssError, match=r"film\.npz: its landmarks reach .* have 96 x 80 pixels\. .*scale"):
        read_footage(run, str(film))  # type: ignore[arg-type]
    files.write_json(film.parent / "landmarks.json", {"groups": GROUPS, "scale": 4})
    code = read_footage(run, str(film)).code  # type: ignore[arg-type]
    assert (code.valid == plain.valid).all() and code.pose == pytest.approx(plain.pose, abs=1e-3)
    for wrong, message in (({"scale": 0}, "scale=0 is too little"), ([4], r"\[4\] is no table")):
        files.write_json(film.parent / "landmarks.json", wrong)
        with pytest.raises(DnnvssError, match=rf"landmarks\.json: {message}"):
            read_footage(run, str(film))  # type: ignore[arg-type]


def test_footage_that_cannot_be_used_names_its_file(run: SimpleNamespace, film: Path) -> None:
    arrays = read_arrays(film.with_suffix(".npz"))
    for points, valid, message in ((arrays["points"], arrays["valid"] & False, "no frame has usable landmarks"),
                                   (arrays["points"][:, :12], arrays["valid"], "has 12 landmarks a frame")):
        files.write_arrays(film.with_suffix(".npz"), points=points, valid=valid)
        with pytest.raises(DnnvssError, match=rf"film\.npz: {message}") as caught:
            read_footage(run, str(film))  # type: ignore[arg-type]
        assert "rack the video" in str(caught.value) and "utterance" not in str(caught.value)


def test_an_utterance_is_no_file_that_is_read(film: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert footage_files("film") == [] and footage_files("film.mp4") == [Path("film.mp4"), Path("film.npz")]

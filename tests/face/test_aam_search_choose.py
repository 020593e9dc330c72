"""The choice of frames to label: spread over what is seen, the same every time, never broken or blurred."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from face import search_cases as cases

from dnnvss.errors import DnnvssError
from dnnvss.face.aam.search.choose import choose_frames, farthest, spread_out
from dnnvss.media import write_video


def test_the_farthest_rows_of_a_line_are_its_ends() -> None:
    line = np.linspace(0, 10, 11)[:, None] * [1.0, 0.0]
    assert set(farthest(line, 3).tolist()) == {5, 0, 10}


def test_rare_kinds_weigh_as_much_as_frequent_ones() -> None:
    random = np.random.default_rng(0)
    centres = np.array([(0, 0), (10, 0), (0, 10), (10, 10)], float)
    sizes = (300, 20, 20, 5)
    features = np.concatenate([c + random.normal(0, 0.3, (n, 2)) for c, n in zip(centres, sizes, strict=True)])
    kinds = np.repeat(np.arange(4), sizes)
    assert set(kinds[spread_out(features, 4)].tolist()) == {0, 1, 2, 3}


@pytest.fixture(scope="module")
def videos(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return two videos of the built-in talker; in the second, frames 8 to 11 are blurred and 20 to 21 are noise."""
    folder = tmp_path_factory.mktemp("videos")
    first, second = (cases.clip(n)[0].copy() for n in (0, 1))
    second[8:12] = [cv2.GaussianBlur(f, (0, 0), 4) for f in second[8:12]]
    second[20:22] = np.random.default_rng(0).integers(0, 255, second[20:22].shape)
    return [write_video(folder / f"{i}.mp4", v, 25, quality=14) for i, v in enumerate((first, second))]


def test_frames_are_chosen_once_and_for_all(videos: list[Path]) -> None:
    chosen = choose_frames(videos, 10, seed=3)
    assert len(set(chosen)) == 10 and chosen == choose_frames(videos, 10, seed=3)
    assert {c.video for c in chosen} == set(videos)


def test_chosen_mouths_are_more_different_than_every_nth(videos: list[Path]) -> None:
    points = {v: cases.clip(i)[1] for i, v in enumerate(videos)}
    every = np.concatenate([p - p.mean(axis=1, keepdims=True) for p in points.values()]).reshape(80, -1)
    rows = {(v, f): every[40 * i + f] for i, v in enumerate(videos) for f in range(40)}

    def reach(several: np.ndarray) -> float:
        return float(np.linalg.norm(every[:, None] - several[None], axis=2).min(axis=1).max())

    assert reach(np.stack([rows[c.video, c.frame] for c in choose_frames(videos, 8)])) < reach(every[::10])


def test_blurred_and_broken_frames_are_left_out(videos: list[Path]) -> None:
    chosen = {c.frame for c in choose_frames(videos, 30) if c.video == videos[1]}
    assert not chosen & {8, 9, 10, 11, 20, 21}


def test_a_video_that_cannot_be_read_is_named_and_left_out(videos: list[Path], tmp_path: Path,
                                                          capsys: pytest.CaptureFixture[str]) -> None:
    torn = tmp_path / "torn.mp4"
    torn.write_bytes(videos[0].read_bytes()[:2000])
    assert {c.video for c in choose_frames([torn, *videos], 10)} == set(videos)
    assert "left out" in (said := capsys.readouterr().out) and "torn.mp4" in said
    with pytest.raises(DnnvssError, match=r"torn\.mp4"):
        choose_frames([torn], 10)


def test_too_few_frames_are_an_error(videos: list[Path]) -> None:
    with pytest.raises(DnnvssError, match="are usable and 200 are to be chosen"):
        choose_frames(videos, 200)
    with pytest.raises(DnnvssError, match="no video"):
        choose_frames([], 3)

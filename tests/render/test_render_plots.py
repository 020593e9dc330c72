"""Plots hold what they were given."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.render import plots
from dnnvss.timing import Tier

PHONES = Tier("phones", [(0, 0.2, "sil"), (0.2, 0.35, "B"), (0.35, 0.6, "IY"), (0.6, 1.0, "sil")])


def test_trajectories_boundaries_and_labels_are_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    figures = []
    real = plots.save_figure
    monkeypatch.setattr(plots, "save_figure", lambda figure, path: figures.append(figure) or real(figure, path))
    reference, predicted = np.sin(np.arange(25) / 4), np.cos(np.arange(50) / 8)
    series = {"reference": reference, "predicted": predicted}
    path = plots.plot_trajectories(tmp_path / "a.png", series, 25, PHONES, "see")
    axes = figures[0].axes[0]
    curves = {line.get_label(): line.get_xydata() for line in axes.lines if len(line.get_xdata()) > 2}
    assert curves["reference"] == pytest.approx(np.column_stack([(np.arange(25) + 0.5) / 25, reference]))
    assert len(curves["predicted"]) == 50
    assert [t.get_text() for t in axes.texts] == ["sil", "B", "IY", "sil"]
    edges, = axes.collections
    assert [line.tolist() for line in edges.get_segments()] == [[[x, 0], [x, 1]] for x in (0, 0.2, 0.35, 0.6, 1.0)]
    assert cv2.imread(str(path)).std() > 5


@pytest.mark.parametrize("name", ["", "a", "a.foo"])
def test_a_name_that_is_no_picture_s_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(DnnvssError, match=r"cannot be written under this name\. Name it \.png"):
        plots.plot_trajectories(tmp_path / name, {"x": np.zeros(25)}, 25, PHONES)
    assert not list(tmp_path.iterdir())


def test_nothing_to_plot_says_so(tmp_path: Path) -> None:
    with pytest.raises(DnnvssError, match="nothing to plot"):
        plots.plot_trajectories(tmp_path / "a.png", {}, 25, PHONES)
    with pytest.raises(DnnvssError, match="not finite"):
        plots.plot_trajectories(tmp_path / "a.png", {"x": np.array([0.0, np.nan])}, 25, PHONES)
    assert not list(tmp_path.iterdir())


def long_tier(count: int) -> Tier:
    labels = ["sil", "B", "IY", "T", "AH", "NG"]
    return Tier("phones", [(i * 0.08, (i + 1) * 0.08, labels[i % 6]) for i in range(count)])


def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Figures that are written from now on."""
    figures: list[Any] = []
    real = plots.save_figure
    monkeypatch.setattr(plots, "save_figure", lambda figure, path: figures.append(figure) or real(figure, path))
    return figures


@pytest.mark.parametrize("count, lines", [(100, 1), (101, 2), (501, 6)])
def test_a_long_plot_goes_on_in_lines_below(
    count: int, lines: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figures, phones = drawn(monkeypatch), long_tier(count)
    values = np.sin(np.arange(2 * count) / 4)
    path = plots.plot_trajectories(tmp_path / "a.png", {"reference": values}, 25, phones, "long")
    height, width = cv2.imread(str(path)).shape[:2]
    assert width <= 25 * 150 and max(height, width) < 2**16
    axes = figures[0].axes
    assert len(axes) == lines
    assert sum(len(each.texts) for each in axes) == count
    assert [each.get_xlim()[0] for each in axes[1:]] == [each.get_xlim()[1] for each in axes[:-1]]
    assert {each.get_ylim() for each in axes} == {axes[0].get_ylim()}
    ends = (axes[0].get_xlim()[0], axes[-1].get_xlim()[1])
    assert ends == pytest.approx((phones.start, phones.end))


def test_a_plot_of_very_many_phones_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    figures, phones = drawn(monkeypatch), long_tier(7000)
    monkeypatch.setattr(plots, "save_figure", lambda figure, path: figures.append(figure) or path)
    ones = np.ones(2 * 7000)
    plots.plot_residual(tmp_path / "a.png", {"a": ones, "b": ones}, 25, ones > 0, phones)
    width, height = figures[0].get_size_inches() * 150
    assert max(width, height) < 2**16 and len(figures[0].axes) == 60
    assert sum(len(each.texts) for each in figures[0].axes) == 0


def test_residuals_go_on_in_lines_below_and_shade_what_is_not_valid(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figures, phones = drawn(monkeypatch), long_tier(250)
    frames = 250 * 2
    valid = np.ones(frames, bool)
    valid[100:140] = False
    series = {"points (px)": np.abs(np.sin(np.arange(frames) / 9)), "texture": np.arange(frames) / 50}
    path = plots.plot_residual(tmp_path / "a.png", series, 25, valid, phones, "long")
    assert cv2.imread(str(path)).shape[1] <= 25 * 150
    axes = figures[0].axes
    assert len(axes) == 3 * 2 and sum(len(each.texts) for each in axes) == 250
    assert {each.get_ylim() for each in axes[1::2]} == {axes[1].get_ylim()}
    assert [[round(p.get_x(), 6), round(p.get_width(), 6)] for p in axes[0].patches] == [[4.0, 1.6]]

"""Plots hold what they were given."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.render import plots
from dnnvss.timing import Tier

PHONES = Tier("phones", [(0, 0.2, "sil"), (0.2, 0.35, "B"), (0.35, 0.6, "IY"), (0.6, 1.0, "sil")])


def test_trajectories_boundaries_and_labels_are_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    figures = []
    real = plots._save
    monkeypatch.setattr(plots, "_save", lambda figure, path: figures.append(figure) or real(figure, path))
    reference, predicted = np.sin(np.arange(25) / 4), np.cos(np.arange(50) / 8)
    series = {"reference": reference, "predicted": predicted}
    path = plots.plot_trajectories(tmp_path / "a.png", series, 25, PHONES, "see")
    axes = figures[0].axes[0]
    curves = {line.get_label(): line.get_xydata() for line in axes.lines if len(line.get_xdata()) > 2}
    assert curves["reference"] == pytest.approx(np.column_stack([(np.arange(25) + 0.5) / 25, reference]))
    assert len(curves["predicted"]) == 50
    assert [t.get_text() for t in axes.texts] == ["sil", "B", "IY", "sil"]
    edges = [line.get_xdata()[0] for line in axes.lines if len(line.get_xdata()) == 2]
    assert edges == [0, 0.2, 0.35, 0.6, 1.0]
    assert cv2.imread(str(path)).std() > 5


def test_nothing_to_plot_says_so(tmp_path: Path) -> None:
    with pytest.raises(DnnvssError, match="nothing to plot"):
        plots.plot_trajectories(tmp_path / "a.png", {}, 25, PHONES)
    with pytest.raises(DnnvssError, match="not finite"):
        plots.plot_trajectories(tmp_path / "a.png", {"x": np.array([0.0, np.nan])}, 25, PHONES)
    assert not list(tmp_path.iterdir())

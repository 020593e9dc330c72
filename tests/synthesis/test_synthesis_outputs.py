"""What lies beside a video: the plot of a long text is of what can be read of it."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from dnnvss.render import plots
from dnnvss.synthesis import outputs
from dnnvss.synthesis.speak import Spoken
from dnnvss.timing import FrameClock, Tier


@pytest.mark.parametrize("extra", [0, 1, 5000])
def test_the_plot_of_a_long_text_is_its_first_page(extra: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[tuple[Any, ...]] = []
    monkeypatch.setattr(plots, "plot_trajectories", lambda path, *what: drawn.append(what) or path)
    count, clock = plots.PAGE + extra, FrameClock(100)
    tier = Tier("phones", [(0.08 * k, 0.08 * (k + 1), "AA") for k in range(count)])
    x = np.arange(16 * count).reshape(-1, 2)
    plan = SimpleNamespace(tier=tier, text="some words " * count)
    outputs.draw(tmp_path / "a.png", cast(Spoken, SimpleNamespace(trajectory=x, plan=plan, clock=clock)))
    (series, rate, shown, title), = drawn
    assert rate == 100 and len(shown) == plots.PAGE and len(title) < 260
    np.testing.assert_array_equal(series["coefficient 2"], x[: 8 * plots.PAGE, 1])
    told = f"the first 80 seconds of {0.08 * count / 60:.0f} minutes: some words"
    assert title.startswith(told if extra else "some words")


@pytest.mark.parametrize("recorded, told", [(["a blink"], [0.5]), ([], None)])
def test_blinks_are_reported_where_landmarks_tell_them(recorded: list[str], told: list[float] | None) -> None:
    spoken = SimpleNamespace(
        moves=SimpleNamespace(blinks=np.array([15.0] * len(recorded))), stage=SimpleNamespace(clock=FrameClock(30)),
        request=SimpleNamespace(style=SimpleNamespace(life=1, seed=7)),
        run=SimpleNamespace(life=SimpleNamespace(tracks=SimpleNamespace(recorded=recorded))))
    assert outputs._life(cast(Spoken, spoken)) == {"life": {"share": 1, "seed": 7, "blinks": told}}

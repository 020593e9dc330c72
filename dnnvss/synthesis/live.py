"""A face that moves while somebody speaks: from samples to pictures' parameters, a bounded time later."""

from dataclasses import dataclass

import numpy as np

from dnnvss.curves import Stream
from dnnvss.features.stream import FeatureStream, heard_ahead, reach
from dnnvss.runs.run import Run
from dnnvss.systems.examples import Task
from dnnvss.timing import FrameClock

SETTLING = 3.0
"""Seconds over which the centre of the movement is forgotten, about which the dial scales."""


@dataclass(frozen=True)
class LiveSettings:
    """How a face follows a voice.

    Args:
        smoothing: seconds that parameter generation waits for; at least as long as its windows
            need.
        articulation: the dial, as in a style; None leaves the movement as it is generated.
        pictures: the clock of what comes out; the talker's own where None.
    """

    smoothing: float = 0.04
    articulation: float | None = 1.0
    pictures: FrameClock | None = None


class LiveFace:
    """Parameters of a face, a row for each picture, while samples arrive.

    Features, network, parameter generation with a fixed lag, dial and resampling, all of them
    causal: what comes out does not depend on how the sound is cut into pieces.

    Args:
        run: of a system that streams and labels that read the sound alone by causal analyses.
        settings: of the movement.

    Raises:
        DnnvssError: the run looks at the whole utterance, or reads what nobody knows in time.
    """

    def __init__(self, run: Run, settings: LiveSettings | None = None) -> None:
        self.run, self.settings = run, settings or LiveSettings()
        task, size = run.task, len(run.face.names)
        self.features = FeatureStream(task.table, task.clock)
        self.system = run.model.stream()
        self.curves = Stream(size, waited(task, self.settings.smoothing), task.windows)
        self.clock = self.settings.pictures or FrameClock(run.voice.rate)
        self.dial = LiveDial(gains(run, self.settings.articulation), task.clock)
        self.pictures = LiveResampling(task.clock, self.clock, size)

    @property
    def lag(self) -> float:
        """Seconds at most from the middle of a picture's time to the sample that settles it."""
        parts = self.parts
        return sum(parts.values())

    @property
    def parts(self) -> dict[str, float]:
        """The lag by its causes, in seconds."""
        seconds = self.run.task.clock.seconds
        table = self.run.task.table
        return {"features": seconds(1) / 2 + seconds(reach(table)[1]) + heard_ahead(table),
                "network": seconds(self.run.model.lookahead or 0),
                "smoothing": seconds(self.curves.lag), "pictures": seconds(1)}

    def push(self, samples: np.ndarray) -> np.ndarray:
        """Parameters (n, D) of the pictures that are settled once these samples came in.

        Args:
            samples: (m,) in [-1, 1], at :data:`~dnnvss.acoustics.RATE`.
        """
        return self._shown(self._generated(*self.features.push(samples)))

    def finish(self) -> np.ndarray:
        """Parameters (n, D) of the pictures that were held back: the sound has ended."""
        first = self._generated(*self.features.finish())
        held = self.system.finish()
        rows = [first, self._smoothed(held.mean, held.variance), self.curves.finish()]
        shown = [self._shown(np.concatenate(rows)), self.pictures.finish()]
        return np.concatenate(shown)

    def _generated(self, active: np.ndarray, numeric: np.ndarray) -> np.ndarray:
        prediction = self.system.push(active, numeric)
        return self._smoothed(prediction.mean, prediction.variance)

    def _smoothed(self, mean: np.ndarray, variance: np.ndarray) -> np.ndarray:
        return self.curves.push(mean, variance) if len(mean) else np.zeros((0, self.curves.columns))

    def _shown(self, rows: np.ndarray) -> np.ndarray:
        return self.pictures.push(self.dial(rows))


def waited(task: Task, seconds: float) -> int:
    """Frames that parameter generation waits for: so many seconds, or what its windows need."""
    return max(2 * task.windows.reach, round(seconds * float(task.clock.rate)))


def gains(run: Run, articulation: float | None) -> np.ndarray:
    """What the dial multiplies the movement of each coefficient by (D,)."""
    talker = run.generator.talker
    if articulation is None:
        return np.ones(len(talker.natural))
    own = talker.natural if talker.own is None else talker.own
    return articulation * np.sqrt(talker.natural / own)


class LiveDial:
    """Scales movement about its slow mean, which begins at the parameters' own zero.

    ``x + (g - 1) (x - c)``, with ``c`` an exponential average over :data:`SETTLING` seconds. A
    clip's own mean, about which :func:`~dnnvss.curves.articulate` scales, is not known before its
    end; parameters are measured from the mean of each clip, so that zero is near it.

    Args:
        gains: g (D,).
        clock: of the rows.
    """

    def __init__(self, gains: np.ndarray, clock: FrameClock) -> None:
        self.gains, self.centre = gains, np.zeros(len(gains))
        self.share = min(1.0, 1 / (SETTLING * float(clock.rate)))

    def __call__(self, rows: np.ndarray) -> np.ndarray:
        """The next rows (n, D), scaled."""
        out = np.empty_like(rows)
        for i, row in enumerate(rows):
            self.centre += self.share * (row - self.centre)
            out[i] = row + (self.gains - 1) * (row - self.centre)
        return out


class LiveResampling:
    """From one clock to another while rows arrive: on the line between the two nearest centres.

    Args:
        source, target: the clocks.
        columns: D.
    """

    def __init__(self, source: FrameClock, target: FrameClock, columns: int) -> None:
        self.source, self.target = source, target
        self.rows, self.first, self.given = np.zeros((0, columns)), 0, 0

    def push(self, rows: np.ndarray) -> np.ndarray:
        """The rows (n, D) at the target's centres that lie between rows at hand."""
        self.rows = np.concatenate([self.rows, rows])
        return self._given(self.first + len(self.rows) - 1)

    def finish(self) -> np.ndarray:
        """The rows of what is left of the time; the last row is held."""
        if not len(self.rows):
            return self.rows
        count = self.first + len(self.rows)
        whole = max(1, self.target.edge(self.source.seconds(count)))
        return self._given(np.inf, whole)

    def _given(self, last: float, most: int | None = None) -> np.ndarray:
        """Rows at the next centres up to source frame ``last``, or up to so many target frames."""
        ratio, out = self.source.rate / self.target.rate, []
        while most is None or self.given < most:
            at = float((2 * self.given + 1) * ratio / 2) - 0.5
            if most is None and at > last:
                break
            at = min(max(at - self.first, 0.0), len(self.rows) - 1.0)
            low = int(at)
            high = min(low + 1, len(self.rows) - 1)
            out.append(self.rows[low] + (at - low) * (self.rows[high] - self.rows[low]))
            self.given += 1
        spent = max(int((2 * self.given + 1) * ratio / 2 - 0.5) - self.first, 0)
        spent = min(spent, max(len(self.rows) - 1, 0))
        self.rows, self.first = self.rows[spent:], self.first + spent
        return np.array(out).reshape(-1, self.rows.shape[1])

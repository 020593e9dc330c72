"""Feature columns while the sound arrives: what causal systems read."""

import numpy as np

from dnnvss.acoustics import AcousticStream, EncoderStream
from dnnvss.errors import DnnvssError
from dnnvss.features.block import Settings
from dnnvss.features.codes import FrameCodes
from dnnvss.features.sources.encoder import ENCODER_SOURCE
from dnnvss.features.sources.sound import SOUND_SOURCES, analysis_of, offsets_of
from dnnvss.features.table import FeatureTable
from dnnvss.timing import FrameClock


class FeatureStream:
    """Columns of frames while samples arrive; the same as those of the whole sound.

    Args:
        table: of blocks that read the sound alone, by causal analyses.
        clock: of the frames.

    Raises:
        DnnvssError: a block reads something else, or an analysis looks behind its frame.
    """

    def __init__(self, table: FeatureTable, clock: FrameClock) -> None:
        if unknown := [name for name in table.sources if name not in _HEARD]:
            raise DnnvssError(f"{table.title} reads {unknown[0]}, which nobody knows as the sound comes",
                              remedy="Take a run whose labels read the sound alone, with causal "
                              "analyses: labels=mel labels.logmel.causal=true")
        self.table, self.clock = table, clock
        self.before, self.ahead = reach(table)
        self.streams = {name: _stream(table.settings, name, clock) for name in table.sources}
        self.rows = {name: stream.push(np.zeros(0)).astype(np.float32) for name, stream in self.streams.items()}
        self.first = 0  # the frame of the first row that is kept
        self.given = 0  # frames that were given out

    def push(self, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Active columns (n, A) and numbers (n, N) of the frames that are settled once these came in.

        Args:
            samples: (m,) in [-1, 1], at :data:`~dnnvss.acoustics.RATE`.
        """
        return self._settled({name: s.push(samples) for name, s in self.streams.items()}, False)

    def finish(self) -> tuple[np.ndarray, np.ndarray]:
        """Those of the frames that were held back."""
        return self._settled({name: s.finish() for name, s in self.streams.items()}, True)

    def _settled(self, new: dict[str, np.ndarray], last: bool) -> tuple[np.ndarray, np.ndarray]:
        self.rows = {name: np.concatenate([rows, new[name].astype(np.float32)])
                     for name, rows in self.rows.items()}
        count = self.first + min(map(len, self.rows.values()))
        ready = max(count - (0 if last else self.ahead), self.given)
        if ready == self.given:
            return np.zeros((0, 0), np.int32), np.zeros((0, self.table.numeric_width), np.float32)
        here = {"utterance_start": np.zeros(1, np.int64), "utterance_frames": np.array([count - self.first])}
        codes = FrameCodes(self.table, {**here, **_arrays(self.rows)}, str(self.clock))
        frames = np.arange(self.given, ready) - self.first
        made = codes.active(frames), codes.numeric(frames)
        self._forget(ready)
        return made

    def _forget(self, ready: int) -> None:
        """Keep what the next frames look back at."""
        self.given, first = ready, max(ready - self.before, 0)
        self.rows = {name: rows[first - self.first :] for name, rows in self.rows.items()}
        self.first = first


_HEARD = frozenset(source.name for source in (*SOUND_SOURCES, ENCODER_SOURCE))
"""Sources that read the sound alone."""


def _stream(settings: Settings, name: str, clock: FrameClock) -> AcousticStream | EncoderStream:
    if (norm := settings.sound_norm) not in ("none", "running"):
        raise DnnvssError(f"labels.sound_norm={norm} looks at whole recordings, so it cannot be worked out "
                          "as the sound comes", remedy="Train with labels.sound_norm=running or none")
    running = norm == "running"
    if name == ENCODER_SOURCE.name:
        return EncoderStream(settings.encoder, clock, running)
    return AcousticStream(analysis_of(settings, name), clock, running)


def _arrays(rows: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The arrays of the sources; the encoder's outputs lie on the frames here, not between them."""
    if (outputs := rows.get(ENCODER_SOURCE.name)) is None:
        return rows
    places = np.arange(len(outputs))
    return {**rows, "encoder": np.concatenate([outputs, outputs[-1:]]), "encoder_before": places,
            "encoder_share": np.zeros(len(outputs), np.float32)}


def reach(table: FeatureTable) -> tuple[int, int]:
    """Frames before and after its own that the columns of a frame are put together from."""
    windows = [name.removesuffix("_window") for name in table.names if name.endswith("_window")]
    offsets = [o for name in windows if name in _HEARD for o in _offsets(table.settings, name)]
    return -min([0, *offsets]), max([0, *offsets])


def _offsets(settings: Settings, name: str) -> tuple[int, ...]:
    return settings.encoder_offsets if name == ENCODER_SOURCE.name else offsets_of(settings, name)


def heard_ahead(table: FeatureTable) -> float:
    """Seconds of sound behind a frame's end that its source hears; the frames ahead not counted."""
    ahead = table.settings.encoder.lookahead if ENCODER_SOURCE.name in table.sources else 0.0
    return ahead or 0.0

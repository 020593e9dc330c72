"""Speech and appearance in clusters, part by part of a face."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter1d

from dnnvss.curves import STATIC_DELTA_DELTA2, derivatives
from dnnvss.face.base import Face
from dnnvss.features import FeatureTable
from dnnvss.settings import check_settings, setting
from dnnvss.systems.base import READABLE, Example, Prediction, VisualModel
from dnnvss.systems.canonical import Moments
from dnnvss.systems.cluster_node import CHOICES, ESTIMATES, ClusteredNode, fit_node
from dnnvss.systems.context import inputs, offsets
from dnnvss.systems.hierarchy import ROOT, Appearance, Part, Region, appearance, joined, regions
from dnnvss.systems.voice_space import VOICES, VoiceSpace
from dnnvss.timing import FrameClock


@dataclass(frozen=True)
class ClusterSettings:
    """The settings of :class:`SpeechAppearanceClusters`."""

    nodes: tuple[Part, ...] = setting((), doc="parts of the face with clusters of their own, beside the whole")
    clusters: int = setting(60, least=1, doc="of each part's appearance (k)")
    starts: int = setting(10, least=1, doc="of k-means; the best is kept")
    context: int = setting(0, least=0, doc="frames on each side that are heard too")
    step: float = setting(0.04, above=0, doc="seconds from one frame of context to the next")
    sound: float = setting(0.99, above=0, most=1, doc="share of the sound's variance that its components explain")
    appearance: float = setting(0.99, above=0, most=1, doc="the same of each part's appearance")
    estimate: str = setting("projection", choices=ESTIMATES, doc="how a cluster infers appearance from sound")
    choice: str = setting("nearest", choices=CHOICES, doc="of the cluster")
    weight: float = setting(0.3, above=0, doc="of the sound against steps between clusters, where a chain chooses")
    smoothing: float = setting(0.09, least=0, doc="seconds that are averaged; 0 for none")
    precedence: float = setting(1.0, above=0, doc="weight of a lower part against the rest of its parent")
    voice: str = setting("as_is", choices=VOICES, doc="how a voice is moved towards that of the training")

    def __post_init__(self) -> None:
        check_settings(self, "model")


class SpeechAppearanceClusters(VisualModel):
    """Clusters of appearance for the whole face and each of its parts, chosen and led by the sound.

    The appearance of a part (its points and texture) is divided by k-means; each cluster is a linear model of sound
    and appearance together. A frame's sound chooses the cluster and, in it, the appearance; parts are joined to
    the whole through the parent's model, and the result is smoothed a little.

    Beyond the paper, as it proposes: a cluster may be chosen by a hidden Markov model over clusters, and a new voice
    moved towards the training voice. Unlike in the paper the face stays one model of ``face``: a part's texture is what
    that model shows there, so that shape too is joined through the parent. Colour is the face's matter (``aam=c04``).

    **Source**: Cosker, Marshall, Rosin and Hicks 2004, sections 4, 5 and 7.

    Args:
        table: the feature table of the labels; all its columns are used.
        clock: the trajectory clock.
        settings: see :class:`ClusterSettings`.
    """

    system = "clusters"
    reads = READABLE
    Settings = ClusterSettings
    settings: ClusterSettings

    def __init__(self, table: FeatureTable, clock: FrameClock, settings: ClusterSettings | None = None) -> None:
        super().__init__(table, clock, settings)
        self.places = offsets(self.settings.context, self.settings.step, clock)
        self.regions_: dict[str, Region] = {}

    def take_face(self, face: Face) -> None:
        """Find the parts of the face.

        Raises:
            DnnvssError: a part that it does not have.
        """
        self.regions_ = regions(face, self.settings.nodes)

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Cluster each part over the training frames; ``val`` measures the error."""
        s = self.settings
        measured = [(inputs(e.codes, self.places)[e.measured[1]], e.measured[0][e.measured[1], 0].astype(np.float64))
                    for e in train]
        self.space_ = VoiceSpace.fit([x for x, _ in measured], s.sound)
        moments = Moments.of(y for _, y in measured)
        self.mean_ = moments.mean
        if not self.regions_:
            self.regions_ = {ROOT: Region("", np.eye(len(self.mean_)))}
        sound = [self.space_(x) for x, _ in measured]
        self.shown_ = {name: appearance(r.form, moments.covariance, 1.0 if name == ROOT else s.appearance)
                       for name, r in self.regions_.items()}
        self.nodes_ = {name: fit_node([(y - self.mean_) @ a.read.T for _, y in measured], sound, s.clusters, s.starts,
                                      s.estimate) for name, a in self.shown_.items()}
        streams = train[0].measured[0].shape[1]
        errors = [(self._streams(e, streams) - targets)[valid]
                  for e, (targets, valid) in ((e, e.measured) for e in val)]
        self.variance_ = np.concatenate(errors).astype(np.float64).var(axis=0) + 1e-12

    def predict(self, example: Example) -> Prediction:
        """The smoothed trajectory with its derivatives, and the error variance on the validation frames."""
        mean = self._streams(example, len(self.variance_))
        return Prediction(mean, np.broadcast_to(self.variance_, mean.shape))

    def state(self) -> dict[str, Any]:
        """The space of the sound, the parts with their clusters, mean and error variance."""
        parts = {name: {"parent": self.regions_[name].parent, "form": self.regions_[name].form,
                        "read": self.shown_[name].read,
                        "show": self.shown_[name].show,
                        "clusters": node.state()} for name, node in self.nodes_.items()}
        return {"space": self.space_.state(), "parts": parts, "mean": self.mean_,
                "variance": self.variance_}

    def load_state(self, state: dict[str, Any]) -> None:
        """Take over what :meth:`state` gave."""
        self.space_ = VoiceSpace.from_state(state["space"])
        parts = state["parts"]
        self.regions_ = {name: Region(p["parent"], p["form"]) for name, p in parts.items()}
        self.shown_ = {name: Appearance(p["read"], p["show"]) for name, p in parts.items()}
        self.nodes_ = {name: ClusteredNode.from_state(p["clusters"]) for name, p in parts.items()}
        self.mean_, self.variance_ = state["mean"], state["variance"]

    def _streams(self, example: Example, streams: int) -> np.ndarray:
        """The prediction (T, W, D)."""
        s = self.settings
        sound = self.space_(inputs(example.codes, self.places), s.voice)
        said = {name: node(sound, s.choice, s.weight) for name, node in self.nodes_.items()}
        static = self.mean_ + joined(self.regions_, self.shown_, said, s.precedence)
        frames = round(s.smoothing * float(self.clock.rate))
        if frames > 1:
            static = uniform_filter1d(static, frames, axis=0, mode="nearest")
        return derivatives(static, STATIC_DELTA_DELTA2.first(streams))

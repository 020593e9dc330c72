"""Kernel regression against its equation, and an ensemble against its parts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import CLOCK, TABLE, make_example
from face.face_cases import LinearFace
from scipy.spatial.distance import cdist

from dnnvss.curves import derivatives, mlpg
from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable, encode
from dnnvss.phones import PHONES
from dnnvss.systems import Example
from dnnvss.systems.ensemble import Ensemble, EnsembleSettings, trajectory
from dnnvss.systems.kernel import KernelRegression, KernelSettings, described, typical_distance
from dnnvss.timing import Alignment, Tier


def test_the_prediction_is_that_of_the_equation(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    model = KernelRegression(TABLE, CLOCK, KernelSettings(rate=100, noise=0.5))
    model.fit(examples["train"], examples["val"], tmp_path)
    seen = np.concatenate([model.seen(e) for e in examples["train"]]).astype(np.float32)
    said = np.concatenate([e.measured[0][:, 0] for e in examples["train"]]).astype(float)

    def kernel(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.exp(-(cdist(a, b) ** 2) / (2 * model.width_**2))

    centre = said.mean(0)
    weights = np.linalg.inv(kernel(seen, seen) + 0.5 * np.eye(len(seen))) @ (said - centre)
    for example in examples["test"]:
        static = centre + kernel(model.seen(example), seen) @ weights
        np.testing.assert_allclose(model.predict(example).mean, derivatives(static), atol=1e-5)


def test_noise_draws_to_the_mean_and_too_many_frames_are_thinned(examples: dict[str, list[Example]],
                                                                tmp_path: Path) -> None:
    still = KernelRegression(TABLE, CLOCK, KernelSettings(noise=1e9))
    still.fit(examples["train"], examples["val"], tmp_path)
    static = still.predict(examples["test"][0]).mean[:, 0]
    np.testing.assert_allclose(static, np.broadcast_to(still.mean_, static.shape), atol=1e-5)
    few = KernelRegression(TABLE, CLOCK, KernelSettings(most=50))
    few.fit(examples["train"], examples["val"], tmp_path)
    assert 25 < len(few.seen_) <= 50


def test_the_width_of_recordings_that_are_mostly_silence_is_that_of_what_differs(tmp_path: Path) -> None:
    """Of twenty rows fifteen are alike: most distances are 0, and the others decide."""
    rows = np.zeros((20, 2))
    rows[15:, 0] = 3.0
    assert typical_distance(rows) == 3.0
    rows[18:] = [[0, 5], [0, 5]]
    apart = cdist(rows, rows)[np.triu_indices(20, 1)]
    assert np.median(apart) == 0 and typical_distance(rows) == np.median(apart[apart > 0])
    assert typical_distance(np.ones((20, 2))) == 1.0
    waits = [padded(make_example(f"wait{k}", np.random.default_rng(k)), 4.0) for k in range(4)]
    model = KernelRegression(TABLE, CLOCK)
    model.fit(waits[:3], waits[3:], tmp_path)
    assert model.width_ > 0 and np.isfinite(model.predict(waits[3]).mean).all()


def padded(e: Example, seconds: float) -> Example:
    """An utterance with more silence before it, in which the face holds still."""
    tiers, more = [], round(seconds * 100)
    for name, label in (("phones", "sil"), ("words", "")):
        later = ((s.start + seconds, s.end + seconds, s.label) for s in e.alignment[name])
        tiers.append(Tier(name, [(0, seconds, label), *later]))
    alignment, (targets, valid) = Alignment(tiers), e.measured
    static = np.pad(targets[:, 0], ((more, 0), (0, 0)), "edge")
    codes = encode(alignment, "word", TABLE, CLOCK)
    known = np.pad(valid, (more, 0), constant_values=True)
    return Example(e.id, alignment, codes, derivatives(static).astype(np.float32), known)


def test_phones_are_as_near_as_they_are_made() -> None:
    rows = described(0.5, 1.0)
    far = cdist(rows, rows)
    p, b, aa, sil = (PHONES.index(name) for name in ("P", "B", "AA", "sil"))
    assert far[p, b] < far[p, aa] and far[p, b] < far[p, sil] and far[p, b] > 0


def test_places_without_a_weight_are_refused() -> None:
    with pytest.raises(DnnvssError, match="have 2, 7 and 7 values"):
        KernelSettings(places=(0.0, 0.1))


def test_an_ensemble_says_the_mean_of_what_its_systems_say(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    model = Ensemble(TABLE, CLOCK, EnsembleSettings({"phone_mean": {}, "kernel": {"noise": 1.0}}))
    model.fit(examples["train"], examples["val"], tmp_path)
    example = examples["test"][0]
    parts = [mlpg(p.mean, p.variance) for p in (s.predict(example) for s in model.systems.values())]
    np.testing.assert_allclose(model.predict(example).mean[:, 0], np.mean(parts, axis=0), atol=1e-6)
    assert model.phone_durations(example) is None
    with pytest.raises(DnnvssError, match=r"model\.systems\.kernel\.nose is no setting"):
        EnsembleSettings({"kernel": {"nose": 1.0}})


def test_systems_of_an_ensemble_know_the_face(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    whole = {"system": "clusters", "clusters": 8, "starts": 2}
    parts = {**whole, "nodes": [{"name": "mouth", "groups": ["lips"]}]}
    model = Ensemble(TABLE, CLOCK, EnsembleSettings({"whole": whole, "parts": parts}))
    modes = np.random.default_rng(0).normal(size=(3, 4, 2))
    model.take_face(LinearFace(np.zeros((4, 2)), modes, contours={"lips": [0, 1]}))
    model.fit(examples["train"], examples["val"], tmp_path)
    said = [system.predict(examples["test"][0]).mean for system in model.systems.values()]
    assert np.abs(said[0] - said[1]).max() > 1e-3


def test_a_system_of_an_ensemble_sees_the_blocks_that_are_named(examples: dict[str, list[Example]],
                                                                tmp_path: Path) -> None:
    network = {"system": "network", "network": {"kind": "feedforward", "hidden": [8]},
               "fit": {"epochs": 1, "progress": False, "accelerator": "cpu", "figure_every": 0, "batch_size": 32}}
    blocks = {"narrow": ("centre_phone",)}
    model = Ensemble(TABLE, CLOCK, EnsembleSettings({"narrow": network, "wide": network}, blocks))
    model.fit(examples["train"], examples["val"], tmp_path)
    assert [system.table.names for system in model.systems.values()] == [("centre_phone",), TABLE.names]
    example = examples["test"][0]
    narrowed = replace(example, codes=example.codes.with_table(FeatureTable(("centre_phone",))))
    parts = [trajectory(s, e) for s, e in zip(model.systems.values(), (narrowed, example), strict=True)]
    np.testing.assert_allclose(model.predict(example).mean[:, 0], np.mean(parts, axis=0), atol=1e-6)
    with pytest.raises(DnnvssError, match=r"model\.blocks\.narrow names 'acoustic_class', which .* does not have"):
        Ensemble(TABLE, CLOCK, EnsembleSettings({"narrow": network}, {"narrow": ("acoustic_class",)}))
    with pytest.raises(DnnvssError, match=r"model\.blocks\.another is of no system"):
        EnsembleSettings({"narrow": network}, {"another": ("centre_phone",)})

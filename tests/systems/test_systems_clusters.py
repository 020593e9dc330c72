"""Clusters of speech and appearance: known clusters come back, chains against all paths, parts joined."""

from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import CLOCK, TABLE

from dnnvss.errors import DnnvssError
from dnnvss.systems import Example
from dnnvss.systems.cluster_choice import posteriors, transitions, viterbi
from dnnvss.systems.cluster_node import fit_node
from dnnvss.systems.clusters import ClusterSettings, SpeechAppearanceClusters
from dnnvss.systems.hierarchy import Appearance, Part, appearance, joined, regions
from dnnvss.systems.voice_space import VoiceSpace


def drawn(seed: int, frames: int = 2000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Appearance (n, 3) and sound (n, 2) of frames from five clusters, each a line of its own, and their cluster."""
    fixed, rng = np.random.default_rng(0), np.random.default_rng(seed)
    seen, heard = 40 * fixed.normal(size=(5, 3)), 40 * fixed.normal(size=(5, 2))
    along, told = fixed.normal(size=(5, 3)), fixed.normal(size=(5, 2))
    own, d = np.repeat(rng.integers(0, 5, frames // 10), 10), rng.normal(size=(frames, 1))
    return seen[own] + d * along[own], heard[own] + d * told[own], own


@pytest.mark.parametrize("estimate", ["projection", "regression"])
@pytest.mark.parametrize("choice", ["nearest", "viterbi", "posterior"])
def test_data_of_known_clusters_comes_back(estimate: str, choice: str) -> None:
    (seen, heard, own), (other, sound, _) = drawn(1), drawn(2)
    centres = seen.mean(0), heard.mean(0)
    node = fit_node([seen - centres[0]], [heard - centres[1]], 5, 10, estimate)
    assert len(node.appearance) == 5
    for k in range(5):  # each true cluster has a centre of its own
        gaps = np.linalg.norm(node.appearance + centres[0] - seen[own == k].mean(0), axis=1)
        assert gaps.min() < 0.2
    said = node(sound - centres[1], choice, 1.0) + centres[0]
    error = np.linalg.norm(said - other, axis=1)
    bare = np.linalg.norm(np.stack([seen[own == k].mean(0) for k in drawn(2)[2]]) - other, axis=1)
    assert np.median(error) < 0.3 * np.median(bare) if estimate == "regression" else np.median(error) < np.median(bare)


def test_within_three_deviations() -> None:
    seen, heard, _ = drawn(1)
    node = fit_node([seen - seen.mean(0)], [heard - heard.mean(0)], 1, 1)
    far = node(np.array([[1e6, -1e6]]), "nearest", 1.0)
    reached = np.abs(node.appearance_modes[0]).T @ node.limits[0]
    assert (np.abs(far[0] - node.appearance[0]) <= reached + 1e-9).all()


def test_chains_against_all_paths() -> None:
    rng = np.random.default_rng(0)
    scores, start = rng.normal(size=(5, 3)), np.log(rng.dirichlet(np.ones(3)))
    steps = np.log(rng.dirichlet(np.ones(3), 3))
    paths = list(product(range(3), repeat=5))
    worth = np.array([start[p[0]] + sum(steps[a, b] for a, b in pairwise(p))
                      + sum(scores[t, k] for t, k in enumerate(p)) for p in paths])
    assert viterbi(scores, start, steps).tolist() == list(paths[worth.argmax()])
    shares = np.exp(worth) / np.exp(worth).sum()
    expected = [[sum(w for p, w in zip(paths, shares, strict=True) if p[t] == k) for k in range(3)] for t in range(5)]
    np.testing.assert_allclose(posteriors(scores, start, steps), expected, atol=1e-12)
    assert np.isfinite(posteriors(scores - 1e6 * np.arange(3), start, steps)).all()


def test_transitions_count_steps() -> None:
    start, steps = transitions([np.array([0, 0, 1]), np.array([1, 1])], 2)
    np.testing.assert_allclose(np.exp(steps), np.array([[1.1, 1.1], [0.1, 1.1]]) / [[2.2], [1.2]])
    np.testing.assert_allclose(np.exp(start), np.array([2.1, 3.1]) / 5.2)


def test_another_voice_is_moved_towards_that_of_the_training() -> None:
    rng = np.random.default_rng(0)
    train = [rng.normal(size=(50, 4)) @ rng.normal(size=(4, 4)) + 3 for _ in range(3)]
    space = VoiceSpace.fit(train, 1.0)
    given = space(train[0])
    kept = (given - given.mean(0)) * space.spread / given.std(0) + space.centre
    turn = space.components / space.deviation[:, None]
    other = train[0] + np.linalg.solve(turn.T, rng.normal(size=4))
    np.testing.assert_allclose(space(other, "offset"), given - given.mean(0) + space.centre, atol=1e-8)
    wider = (space(train[0]) * [2, 3, 0.5, 1.5] + 7) @ np.linalg.inv(turn) + space.mean
    np.testing.assert_allclose(space(wider, "offset_and_scale"), kept, atol=1e-8)
    assert VoiceSpace.fit(train, 0.5).components.shape[1] < 4


def face(points: int = 6, size: int = 8) -> SimpleNamespace:
    """A face of points whose first three are the mouth and the first two of these the lips."""
    rng = np.random.default_rng(0)
    moves = np.linalg.qr(rng.normal(size=(2 * points, size)))[0].T.reshape(size, points, 2)
    return SimpleNamespace(names=tuple(f"p{k}" for k in range(size)), jacobian=lambda: moves,
                           contours={"lips": [0, 1], "chin": [2], "rest": [3, 4, 5]})


def test_a_part_as_its_parents_parameters_show_it() -> None:
    known = face()
    found = regions(known, [Part("mouth", ("lips", "chin"))])
    moves, rng = known.jacobian(), np.random.default_rng(1)
    change = rng.normal(size=8)
    moved = np.tensordot(change, moves, 1)
    assert change @ found["mouth"].form @ change == pytest.approx((moved[:3] ** 2).sum())
    assert change @ found["face"].form @ change == pytest.approx((moved**2).sum())
    shown = appearance(found["mouth"].form, np.eye(8), 1.0)
    assert shown.read.shape == (6, 8)  # three points move in six ways
    np.testing.assert_allclose(np.tensordot(shown.show @ shown.read @ change, moves, 1)[:3], moved[:3], atol=1e-9)


def test_what_agrees_is_joined_as_it_is_and_precedence_is_the_lower_parts() -> None:
    known, rng = face(), np.random.default_rng(2)
    found = regions(known, [Part("mouth", ("lips", "chin")), Part("lips", ("lips",), "mouth")])
    shown = {name: appearance(r.form, np.eye(8), 1.0) for name, r in found.items()}
    truth, wrong = rng.normal(size=(4, 8)), rng.normal(size=(4, 8))
    same = {name: truth @ a.read.T for name, a in shown.items()}
    np.testing.assert_allclose(joined(found, shown, same, 1.0), truth, atol=1e-9)
    said = {**same, "lips": wrong @ shown["lips"].read.T}
    moves = known.jacobian()
    wanted = np.tensordot(wrong, moves, 1)[:, :2]
    errors = [np.abs(np.tensordot(joined(found, shown, said, p), moves, 1)[:, :2] - wanted).max()
              for p in (1.0, 10.0, 1e6)]
    assert errors[0] > errors[1] > errors[2] and errors[2] < 1e-3


def test_with_equal_weight_the_join_is_the_projection_of_the_composed_face() -> None:
    """By hand: compose all movements, the mouth's in their place, projected on the parent's orthonormal modes."""
    known, rng = face(), np.random.default_rng(3)
    found = regions(known, [Part("mouth", ("lips", "chin"))])
    shown = {"face": Appearance(np.eye(8), np.eye(8)), "mouth": appearance(found["mouth"].form, np.eye(8), 1.0)}
    whole, mouth = rng.normal(size=(2, 8)), rng.normal(size=(2, 8))
    moves = known.jacobian()
    composed = np.tensordot(whole, moves, 1)
    composed[:, :3] = np.tensordot(mouth, moves, 1)[:, :3]
    expected = composed.reshape(2, -1) @ moves.reshape(8, -1).T
    said = {"face": whole, "mouth": mouth @ shown["mouth"].read.T}
    np.testing.assert_allclose(joined(found, shown, said, 1.0), expected, atol=1e-9)


@pytest.mark.parametrize("parts, message", [
    ([Part("mouth", ("beak",))], "no group 'beak'"),
    ([Part("lips", ("lips",), "mouth")], "not inside mouth"),
    ([Part("mouth", ("lips", "chin")), Part("jaw", ("chin", "rest"))], "overlaps"),
    ([Part("chin", ("chin",)), Part("lips", ("lips",), "chin")], "not inside chin")])
def test_parts_that_a_face_cannot_have(parts: list[Part], message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        regions(face(), parts)


def test_parts_are_kept_with_what_was_learnt(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    settings = ClusterSettings(nodes=(Part("mouth", ("lips",)),), clusters=8, starts=2)
    known = face(size=3)
    model = SpeechAppearanceClusters(TABLE, CLOCK, settings)
    model.take_face(known)
    model.fit(examples["train"], examples["val"], tmp_path)
    again = SpeechAppearanceClusters(TABLE, CLOCK, settings)
    again.load_state(model.state())
    found = model.predict(examples["test"][0]).mean
    np.testing.assert_array_equal(again.predict(examples["test"][0]).mean, found)
    whole = SpeechAppearanceClusters(TABLE, CLOCK, replace(settings, nodes=()))
    whole.take_face(known)
    whole.fit(examples["train"], examples["val"], tmp_path)
    assert set(model.nodes_) == {"face", "mouth"}
    assert np.abs(whole.predict(examples["test"][0]).mean - found).max() > 1e-3


def test_settings_out_of_range() -> None:
    for wrong in ({"clusters": 0}, {"starts": 0}, {"sound": 0.0}, {"choice": "any"}, {"voice": "hers"}):
        with pytest.raises(DnnvssError, match=f"model.{next(iter(wrong))}="):
            ClusterSettings(**wrong)
    with pytest.raises(DnnvssError, match="no name of its own or no groups"):
        Part("mouth", ())

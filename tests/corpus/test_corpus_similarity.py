"""Known transforms in space are found again."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dnnvss.corpus.similarity import fit_similarity


@pytest.mark.parametrize("rigid", [False, True])
def test_a_known_similarity_is_found(rigid: bool) -> None:
    rng = np.random.default_rng(0)
    face = rng.normal(0, 40, (12, 3))
    turn = Rotation.random(5, random_state=0).as_matrix()
    scale = np.ones(5) if rigid else rng.uniform(0.5, 2, 5)
    centre = rng.normal(0, 500, (5, 3))
    seen = (face - face.mean(axis=0)) @ np.swapaxes(turn, 1, 2) * scale[:, None, None] + centre[:, None]
    found = fit_similarity(seen, face, rigid)
    assert found.turn == pytest.approx(turn, abs=1e-9)
    assert found.scale == pytest.approx(scale, abs=1e-9)
    assert found.centre == pytest.approx(centre, abs=1e-9)
    assert found.back(seen, face.mean(axis=0)) == pytest.approx(np.broadcast_to(face, seen.shape), abs=1e-9)
    assert found.onto(np.broadcast_to(face, seen.shape), face.mean(axis=0)) == pytest.approx(seen, abs=1e-9)


def test_a_mirrored_face_is_turned_not_mirrored() -> None:
    face = np.random.default_rng(1).normal(0, 40, (12, 3))
    turn = fit_similarity((face * [-1, 1, 1])[None], face).turn[0]
    assert np.linalg.det(turn) == pytest.approx(1)

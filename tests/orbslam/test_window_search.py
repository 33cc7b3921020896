"""The feature most alike in a window, against all pairs compared one by one; each feature answers once."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref import _kernels
from vslam_ref.features.orb import OrbFeatures
from vslam_ref.systems.orbslam.window_search import Answers, Places, assigned, search_windows


def drawn(seed: int) -> tuple[Places, OrbFeatures]:
    """Whole pixels and few bits, so that edges of windows are met and distances tie."""
    rng = np.random.default_rng(seed)
    features = OrbFeatures(
        rng.integers(0, 40, (60, 2)).astype(float),
        rng.integers(0, 4, 60),
        np.zeros(60),
        np.ones(60),
        np.concatenate([rng.integers(0, 4, (60, 1)), np.zeros((60, 31))], 1).astype(np.uint8),
    )
    low = rng.integers(-1, 3, 25)
    descriptor = np.concatenate([rng.integers(0, 4, (25, 1)), np.zeros((25, 31))], 1).astype(np.uint8)
    places = Places(
        rng.integers(0, 40, (25, 2)).astype(float),
        rng.integers(0, 9, 25).astype(float),
        low,
        low + 2,
        descriptor,
    )
    return places, features


@pytest.mark.parametrize("backend", _kernels.available())
@pytest.mark.parametrize("seed", range(4))
def test_the_answer_is_the_first_of_the_nearest(seed: int, backend: str) -> None:
    places, features = drawn(seed)
    with _kernels.use_backend(backend):
        got = search_windows(places, features)
    for i in range(25):
        inside = [
            (bin(int(places.descriptor[i, 0]) ^ int(features.descriptor[j, 0])).count("1"), j)
            for j in range(60)
            if max(abs(features.uv[j] - places.uv[i])) <= places.radius[i]
            and places.low[i] <= features.octave[j] <= places.high[i]
        ]
        if not inside:
            assert (got.feature[i], got.distance[i], got.second[i]) == (-1, 257, 257)
            continue
        d, j = min(inside)
        assert (got.feature[i], got.distance[i]) == (j, d)
        rivals = [e for e, k in inside if k != j and features.octave[k] == features.octave[j]]
        assert got.second[i] == min(rivals, default=257)


def test_a_feature_answers_the_nearest_place_only() -> None:
    """Places 0 to 2 want feature 4, the second is nearest; 3 is too far, 4 not clear, 5 has none."""
    answers = Answers(
        np.array([4, 4, 4, 1, 2, -1]),
        np.array([30, 20, 20, 120, 40, 257]),
        np.array([257, 257, 257, 257, 45, 257]),
    )
    assert assigned(answers, limit=100, ratio=0.8, room=5).tolist() == [-1, 4, -1, -1, -1, -1]
    assert assigned(answers, limit=120, ratio=1.0, room=5).tolist() == [-1, 4, -1, 1, 2, -1]


def test_nothing_is_found_among_nothing() -> None:
    places, features = drawn(0)
    none = OrbFeatures(*(values[:0] for values in features))
    assert (search_windows(places, none).feature == -1).all()
    empty = Places(*(values[:0] for values in places))
    assert len(search_windows(empty, features).feature) == 0

"""Places, matches and tracks as an input: unbiased places, two rules for matches, consistent tracks."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.datasets import matching
from vslam_ref.datasets.matching import Features


def picture_of_blobs(centres: np.ndarray, sigma: float = 3.0) -> np.ndarray:
    v, u = np.mgrid[:240, :320].astype(float)
    image = np.full(u.shape, 30.0)
    for x, y in centres:
        image += 150 * np.exp(-((u - x) ** 2 + (v - y) ** 2) / (2 * sigma**2))
    return np.clip(np.round(image), 0, 255).astype(np.uint8)


def test_places_have_no_bias_against_pixel_centres() -> None:
    """Blobs whose middles are known: without the precise doubling each place is off by a quarter pixel."""
    centres = np.array([[60.0, 50.0], [150.5, 60.25], [240.25, 90.75], [90.0, 170.5], [200.75, 180.0]])
    found = matching.detect(picture_of_blobs(centres)).uv
    nearest = [found[np.argmin(np.linalg.norm(found - c, axis=1))] - c for c in centres]
    # grey values are rounded to 1 of 150, the parabola through three samples is good to some hundredths
    np.testing.assert_allclose(nearest, 0.0, atol=0.05)
    assert np.abs(np.mean(nearest, axis=0)).max() < 0.02


def noisy(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    rough = rng.uniform(0, 255, (40, 50))
    return np.kron(rough, np.ones((6, 6))).astype(np.uint8)


def test_a_shifted_picture_matches_by_the_shift() -> None:
    image = noisy(0)
    a, b = matching.detect(image[:, :280]), matching.detect(image[:, 12:292])
    pairs = matching.match(a, b)
    shift = a.uv[pairs[:, 0]] - b.uv[pairs[:, 1]]
    assert len(pairs) > 30
    right = np.abs(shift - [12.0, 0.0]).max(axis=1) < 0.2
    assert right.mean() > 0.97
    np.testing.assert_array_equal(pairs, matching.match(a, b))  # the same every time
    np.testing.assert_array_equal(np.sort(pairs, axis=0), np.sort(matching.match(b, a)[:, ::-1], axis=0))


def features(*descriptors: list[float], place: list[int] | None = None) -> Features:
    d = np.zeros((len(descriptors), 128), np.float32)
    d[:, :2] = descriptors
    at = np.arange(len(d)) if place is None else np.array(place)
    return Features(
        np.c_[np.arange(at.max() + 1), np.zeros(at.max() + 1)].astype(float), d, at.astype(np.int64)
    )


def test_the_two_rules() -> None:
    b = features([0.0, 0.0], [100.0, 0.0], [100.0, 10.0])
    one = features([3.0, 0.0], [150.0, 0.0])
    assert matching.match(one, b).tolist() == [[0, 0]]
    # the second of a is nearest to the second of b, at 50, and the third lies at 51: the ratio test
    assert matching.match(one, b, ratio=1.0).tolist() == [[0, 0], [1, 1]]
    two = features([3.0, 0.0], [1.0, 0.0])  # both nearest to the first of b: cross-check and ratio
    assert matching.match(two, b, ratio=1.0).tolist() == [[1, 0]]
    # two descriptors of one place do not compete
    same = features([0.0, 0.0], [0.0, 1.0], [100.0, 0.0], place=[0, 0, 1])
    assert matching.match(features([0.0, 0.45], [100.0, 2.0]), same).tolist() == [[0, 0], [1, 1]]
    with pytest.raises(ValueError, match=r"ratio=0: must lie in \(0, 1\]"):
        matching.match(one, b, ratio=0)


def test_tracks_join_pairs_and_leave_contradictions_out() -> None:
    f = [features(*[[0.0, 0.0]] * 4) for _ in range(3)]
    pairs = {
        (0, 1): np.array([[0, 0], [1, 1], [3, 3]]),
        (1, 2): np.array([[0, 2], [1, 1]]),
        (0, 2): np.array([[2, 1]]),  # picture 0: places 1 and 2 are one point? wrong somewhere
    }
    found = matching.tracks(f, pairs)
    assert found.mask.tolist() == [[True, True, True], [True, True, False]]
    assert found.uv[0].tolist() == [[0.0, 0.0], [0.0, 0.0], [2.0, 0.0]]
    assert found.uv[1].tolist() == [[3.0, 0.0], [3.0, 0.0], [0.0, 0.0]]
    assert matching.tracks(f, {}).mask.shape == (0, 3)


def test_pictures_without_places() -> None:
    empty = matching.detect(np.full((60, 80), 90, np.uint8))
    assert empty.uv.shape == (0, 2)
    assert matching.match(empty, matching.detect(noisy(1))).shape == (0, 2)
    with pytest.raises(ValueError, match="need uint8 of"):
        matching.detect(np.zeros((60, 80, 3), np.uint8))
    with pytest.raises(ValueError, match="float64"):
        matching.detect(np.zeros((60, 80)))

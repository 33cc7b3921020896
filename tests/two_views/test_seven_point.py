"""Seven pairs: the true matrix is among the answers, all answers fit, and wrong pairs do no harm."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from vslam_ref.geometry.multiview import two_views
from vslam_ref.geometry.multiview.two_views import fundamental_consensus, seven_point_fundamentals

K = np.array([[420.0, 0, 255.5], [0, 430.0, 191.5], [0, 0, 1]])
Views = tuple[np.ndarray, np.ndarray, np.ndarray]


def views(rng: np.random.Generator, n: int) -> Views:
    """Pixels (n, 2) of two pictures, and their fundamental matrix of norm 1."""
    R = cv2.Rodrigues(rng.normal(0, 0.15, 3))[0]
    t = rng.normal(0, 1, 3)
    X = rng.uniform([-2, -2, 4], [2, 2, 9], (n, 3))
    a, b = X @ K.T, (X @ R.T + t) @ K.T
    tx = np.array([[0, -t[2], t[1]], [t[2], 0, -t[0]], [-t[1], t[0], 0]])
    F = np.linalg.inv(K).T @ tx @ R @ np.linalg.inv(K)
    return a[:, :2] / a[:, 2:], b[:, :2] / b[:, 2:], F / np.linalg.norm(F)


def test_the_true_matrix_is_one_of_the_answers() -> None:
    rng = np.random.default_rng(0)
    far = []
    for _ in range(60):
        a, b, F = views(rng, 7)
        found = seven_point_fundamentals(a, b)
        some = found.F[found.valid]
        assert len(some) in (1, 3)
        far.append(min(min(np.abs(one - F).max(), np.abs(one + F).max()) for one in some))
        # every one of them meets all seven pairs, and has rank two
        ones = np.ones((7, 1))
        value = np.einsum("ni,kij,nj->kn", np.hstack([b, ones]), some, np.hstack([a, ones]))
        assert np.abs(value).max() < 1e-9  # 1e5 px^2 times eps, with room for the roots
        assert np.abs(np.linalg.svd(some)[1][:, 2]).max() < 1e-12
    # a sample's condition scatters over orders: half of them are good to 1e-10
    assert np.median(far) < 1e-10
    assert np.max(far) < 1e-5


def test_answers_are_those_of_opencv() -> None:
    """OpenCV makes positions single precision, unscaled: both get such ones, in focal lengths."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        a, b = (((uv - K[:2, 2]) / 420).astype(np.float32).astype(float) for uv in views(rng, 7)[:2])
        theirs = cv2.findFundamentalMat(a, b, cv2.FM_7POINT)[0].reshape(-1, 3, 3)
        found = seven_point_fundamentals(a, b)
        ours = found.F[found.valid]
        assert len(ours) == len(theirs)
        for one in theirs / np.linalg.norm(theirs, axis=(1, 2), keepdims=True):
            # conditions reach 1e5, and a double root doubles the digits that are lost
            assert min(min(np.abs(one - F).max(), np.abs(one + F).max()) for F in ours) < 1e-6


def test_many_samples_at_once_are_the_same() -> None:
    rng = np.random.default_rng(2)
    pairs = [views(rng, 7) for _ in range(5)]
    a, b = (np.stack([pair[k] for pair in pairs]) for k in (0, 1))
    together = seven_point_fundamentals(a, b)
    for k in range(5):
        alone = seven_point_fundamentals(a[k], b[k])
        np.testing.assert_allclose(np.abs(together.F[k]), np.abs(alone.F), atol=1e-9)


@pytest.mark.parametrize("wrong", [0.0, 0.3, 0.5])
def test_the_inliers_are_the_right_pairs(wrong: float) -> None:
    rng = np.random.default_rng(int(10 * wrong))
    a, b, _ = views(rng, 200)
    b = b + rng.normal(0, 0.5, b.shape)
    count = int(200 * wrong)
    b[:count] = rng.uniform([0, 0], [512, 384], (count, 2))
    found = fundamental_consensus(a, b, rng, sigma=1.0)
    assert found.reason == ""
    assert found.inliers[count:].mean() > 0.9  # noise of half of what sigma says
    assert found.inliers[:count].sum() < 0.08 * 200  # within two pixels of a line by chance


def test_too_few_pairs_are_a_reason_and_wrong_shapes_an_error() -> None:
    rng = np.random.default_rng(3)
    found = two_views.fundamental_consensus(np.zeros((6, 2)), np.zeros((6, 2)), rng, sigma=1.0)
    assert "at least 7" in found.reason
    with pytest.raises(ValueError, match="exactly 7"):
        seven_point_fundamentals(np.zeros((8, 2)), np.zeros((8, 2)))

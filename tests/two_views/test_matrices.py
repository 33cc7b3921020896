"""Eight points, five points, homography: the truth is among the answers, and OpenCV finds the same."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.multiview import essential_from_motion, two_views

EPS = float(np.finfo(float).eps)


def nearest(E: np.ndarray, truth: np.ndarray) -> float:
    """Distance of the nearest of the matrices, up to sign, all of norm sqrt(2)."""
    E, truth = E.reshape(-1, 3, 3), truth * np.sqrt(2) / np.linalg.norm(truth)
    return float(min(np.abs(E - truth).max(axis=(1, 2)).min(), np.abs(E + truth).max(axis=(1, 2)).min()))


@pytest.mark.parametrize("kind", ["space", "plane", "far"])
def test_five_points_find_the_true_matrix_in_every_scene(pair, kind: str) -> None:
    rng = np.random.default_rng(5)
    scenes = [pair(rng, 5, kind) for _ in range(300)]
    if kind == "far":  # five far points are a pure rotation: no direction of motion is in them
        scenes = [s for s in scenes if np.count_nonzero(s.X_a[:, 2] > 100) < 5]
    found = two_views.five_point_essentials([s.a for s in scenes], [s.b for s in scenes])
    errors = [
        nearest(E[v], essential_from_motion(s.T_b_a))
        for E, v, s in zip(found.E, found.valid, scenes, strict=True)
    ]
    # eps times the condition of the five equations and of the root, 1e6 in 300 scenes; four far points lose
    # their parallax of 1e-3 twice more
    assert np.median(errors) < 1e-12
    assert max(errors) < (1e-6 if kind == "far" else 1e-9)


def test_every_answer_is_essential_and_fits_its_five_pairs(pair) -> None:
    scenes = [pair(np.random.default_rng(k), 5) for k in range(100)]
    a, b = np.array([s.a for s in scenes]), np.array([s.b for s in scenes])
    found = two_views.five_point_essentials(a, b)
    sample = np.nonzero(found.valid)[0]
    E = found.E[found.valid]
    singular = np.linalg.svd(E, compute_uv=False)
    # SOLVED = 1e-9 in the equations of norm 1; singular values move by its root only at a double one
    np.testing.assert_allclose(singular, np.broadcast_to([1.0, 1.0, 0.0], singular.shape), atol=1e-6)
    assert np.abs(two_views.essential_sampson(E, a[sample], b[sample])).max() < 1e-12
    assert found.valid.sum(axis=1).max() <= 10
    assert len(E) > 3 * len(scenes)  # about 4.6 on average, many more than one


def test_five_points_agree_with_opencv(pair) -> None:
    """OpenCV's five-point method (a polynomial of degree ten) finds the same matrices."""
    rng = np.random.default_rng(2)
    same = 0
    for _ in range(40):
        s = pair(rng, 5)
        theirs, _ = cv2.findEssentialMat(s.a, s.b, np.eye(3), method=cv2.RANSAC, threshold=1e-9)
        ours = two_views.five_point_essentials([s.a], [s.b])
        if theirs is None:
            continue
        for E in theirs.reshape(-1, 3, 3):
            # some of its roots keep four digits only: their two singular values tell how many
            own = np.linalg.svd(E / np.linalg.norm(E) * np.sqrt(2), compute_uv=False)
            assert nearest(ours.E[ours.valid], E) < 10 * (own[0] - own[1]) + 1e-6
            same += 1
    assert same > 40


def test_two_equal_pairs_have_no_answer_and_others_keep_theirs(pair) -> None:
    s = pair(np.random.default_rng(0), 5)
    twice_a, twice_b = s.a.copy(), s.b.copy()
    twice_a[4], twice_b[4] = twice_a[3], twice_b[3]
    found = two_views.five_point_essentials([twice_a, s.a], [twice_b, s.b])
    assert not found.valid[0].any()
    assert found.rank[0] < 1e-12
    assert found.valid[1].any()


@pytest.mark.parametrize("points", [5, 8])
def test_bad_input_is_told(points: int) -> None:
    function = two_views.five_point_essentials if points == 5 else two_views.linear_essential
    with pytest.raises(ValueError, match="need"):
        function(np.zeros((1, 3, 2)), np.zeros((1, 3, 2)))
    with pytest.raises(ValueError, match="need"):
        function(np.zeros((1, points, 2)), np.zeros((1, points + 1, 2)))
    bad = np.zeros((1, points, 2))
    bad[0, 2, 1] = np.nan
    with pytest.raises(ValueError, match=r"pair \[0, 2\].*finite"):
        function(bad, np.zeros((1, points, 2)))


def test_eight_points_find_the_matrix_and_name_a_plane(pair) -> None:
    rng = np.random.default_rng(8)
    for _ in range(30):
        s = pair(rng, 12)
        found = two_views.linear_essential(s.a, s.b)
        # eps times the condition of the equations, up to 1e5 for a dozen random points
        assert nearest(found.E, essential_from_motion(s.T_b_a)) < 1e-10
        assert found.unique
        assert found.gap < 1e-8
    flat = pair(rng, 12, "plane")
    assert not two_views.linear_essential(flat.a, flat.b).unique


def test_normalisation_makes_the_fundamental_matrix_better(pair) -> None:
    """Pixels without normalisation: columns of 1e5 and 1 in one system."""
    rng = np.random.default_rng(4)
    K = np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]])
    ours, plain = [], []
    for _ in range(20):
        s = pair(rng, 40, sigma_px=0.5)
        uv_a, uv_b = (x @ K[:2, :2].T + K[:2, 2] for x in (s.a, s.b))
        exact = [X[:, :2] / X[:, 2:] for X in (s.X_a, se3.act(s.T_b_a, s.X_a))]
        true_a, true_b = (x @ K[:2, :2].T + K[:2, 2] for x in exact)
        rows = np.einsum("ni,nj->nij", homogeneous(uv_b), homogeneous(uv_a)).reshape(-1, 9)
        U, d, Vt = np.linalg.svd(np.linalg.svd(rows)[2][-1].reshape(3, 3))
        F_plain = U @ np.diag([d[0], d[1], 0]) @ Vt
        for F, into in ((two_views.linear_fundamental(uv_a, uv_b), ours), (F_plain, plain)):
            into.append(np.sqrt(np.mean(two_views.essential_sampson(F, true_a, true_b) ** 2)))
    # eight numbers from 40 pairs: the noise of one coordinate times sqrt(8 / 40), 0.22 px; 30 % for 20 scenes
    assert np.median(ours) < 0.3
    assert np.median(plain) > 1.5 * np.median(ours)


def homogeneous(x: np.ndarray) -> np.ndarray:
    return np.concatenate([x, np.ones((len(x), 1))], axis=1)


def test_linear_fundamental_agrees_with_opencv(pair) -> None:
    s = pair(np.random.default_rng(6), 30, sigma_px=0.5)
    uv_a, uv_b = 500 * s.a + [320, 240], 500 * s.b + [320, 240]
    theirs, _ = cv2.findFundamentalMat(uv_a, uv_b, cv2.FM_8POINT)
    ours = two_views.linear_fundamental(uv_a, uv_b)
    theirs = theirs / np.linalg.norm(theirs) * np.sign(np.sum(theirs * ours))
    # the same equations and the same normalisation, in double precision: condition times eps
    assert np.abs(ours - theirs).max() < 1e-7


@pytest.mark.parametrize("points", [4, 9, 40])
def test_homography_is_exact_and_agrees_with_opencv(pair, points: int) -> None:
    rng = np.random.default_rng(points)
    s = pair(rng, points, "plane")
    H = two_views.fit_homography(s.a, s.b)
    # n . X = 5 with the normal of the scene's plane, up to its length
    n = np.array([-0.4, 0.2, 1.0])
    truth = s.T_b_a[:3, :3] + np.outer(s.T_b_a[:3, 3], n / 5.0)
    np.testing.assert_allclose(H, truth / np.linalg.norm(truth), atol=1e-9)
    noisy = s.b + rng.normal(0, 1e-3, s.b.shape)
    theirs, _ = cv2.findHomography(s.a, noisy, 0)
    ours = two_views.fit_homography(s.a, noisy)
    theirs = theirs * np.sign(np.sum(theirs * ours)) / np.linalg.norm(theirs)
    # OpenCV minimises the distance in picture b, the linear equations an algebraic one: the difference is
    # of the order of the noise over the extent of the points, 1e-3; for four points it
    # is where OpenCV's iteration stops
    assert np.abs(ours - theirs).max() < (1e-5 if points == 4 else 3e-3)


def test_batches_are_single_results(pair) -> None:
    scenes = [pair(np.random.default_rng(k), 9, "plane") for k in range(6)]
    a, b = (np.array([getattr(s, x) for s in scenes]).reshape(2, 3, 9, 2) for x in "ab")
    H = two_views.fit_homography(a, b)
    np.testing.assert_allclose(H[1, 2], two_views.fit_homography(a[1, 2], b[1, 2]), atol=1e-12)


@given(st.integers(0, 10**6))
def test_nearest_essential_is_essential_and_a_fixed_point(seed: int) -> None:
    rng = np.random.default_rng(seed)
    E = two_views.nearest_essential(rng.normal(size=(3, 3)))
    np.testing.assert_allclose(np.linalg.svd(E, compute_uv=False), [1, 1, 0], atol=10 * EPS)
    np.testing.assert_allclose(two_views.nearest_essential(E), E, atol=20 * EPS)
    T = se3.from_rt(so3.random(rng), [0.6, 0.0, 0.8])
    np.testing.assert_allclose(
        two_views.nearest_essential(3.0 * essential_from_motion(T)), essential_from_motion(T), atol=20 * EPS
    )

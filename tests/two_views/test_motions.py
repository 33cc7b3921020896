"""From the matrix to the motion: four and two answers, which of them is in front, and far points."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.multiview import essential_from_motion, two_views


def test_the_true_motion_is_one_of_four_and_alone_in_front(pair) -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        s = pair(rng, 8)
        motions = two_views.essential_motions(rng.choice([-1, 2.5]) * essential_from_motion(s.T_b_a))
        np.testing.assert_allclose(np.linalg.det(motions[:, :3, :3]), 1.0, atol=1e-14)
        errors = np.abs(motions - s.T_b_a).max(axis=(1, 2))
        assert errors.min() < 1e-13  # a few roundings of a 3 x 3 decomposition
        front = two_views.cheirality(motions, s.a, s.b).front.sum(axis=1)
        assert int(np.argmax(front)) == int(np.argmin(errors))
        assert sorted(front)[:3] == [0, 0, 0] or sorted(front)[2] < 8


def test_recover_pose_of_opencv_agrees(pair) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        s = pair(rng, 30)
        E = essential_from_motion(s.T_b_a)
        _, R, t, _ = cv2.recoverPose(E, s.a, s.b, np.eye(3))
        motions = two_views.essential_motions(E)
        cost = two_views.cheirality(motions, s.a, s.b, 1e-3).squared.sum(axis=1)
        T = motions[np.argmin(cost)]
        np.testing.assert_allclose(T[:3, :3], R, atol=1e-9)
        np.testing.assert_allclose(T[:3, 3], t[:, 0], atol=1e-9)


def test_depths_are_those_of_the_points(pair) -> None:
    s = pair(np.random.default_rng(2), 20)
    found = two_views.depths(s.T_b_a, s.a, s.b)
    np.testing.assert_allclose(found[:, 0], s.X_a[:, 2], rtol=1e-11)
    np.testing.assert_allclose(found[:, 1], se3.act(s.T_b_a, s.X_a)[:, 2], rtol=1e-11)
    away = two_views.depths(np.eye(4), s.a, s.a)
    assert np.isinf(away).all()


def test_far_points_cost_their_noise_on_either_side_of_infinity(pair) -> None:
    """Noise puts half of the far points behind: counting votes against the truth, the cost hardly changes."""
    rng = np.random.default_rng(3)
    s = pair(rng, 2000, "far", sigma_px=1.0)
    at = two_views.cheirality(s.T_b_a, s.a, s.b, 1 / 500)
    far = s.X_a[:, 2] > 2500  # parallax below a pixel's fifth
    assert 0.3 < np.mean(~at.front[far]) < 0.7
    # two constraints for points at infinity, one for those in front: chi-square means 2 and 1
    mean = at.squared[far].mean()
    assert 1.0 < mean < 2.0
    assert at.squared[~far].mean() == pytest.approx(1.0, abs=4 * np.sqrt(2 / np.sum(~far)))


def test_near_points_behind_are_dear(pair) -> None:
    s = pair(np.random.default_rng(4), 50, sigma_px=1.0)
    wrong = s.T_b_a.copy()
    wrong[:3, 3] *= -1.0  # the mirrored solution
    right = two_views.cheirality(s.T_b_a, s.a, s.b, 1 / 500)
    mirrored = two_views.cheirality(wrong, s.a, s.b, 1 / 500)
    assert np.median(mirrored.squared) > 100 * np.median(right.squared)
    assert not mirrored.front.any()


def test_both_answers_of_a_homography_are_found_and_opencv_has_the_same(pair) -> None:
    rng = np.random.default_rng(5)
    n = np.array([-0.4, 0.2, 1.0])
    ambiguous = 0
    for _ in range(40):
        s = pair(rng, 20, "plane")
        H = s.T_b_a[:3, :3] + np.outer(s.T_b_a[:3, 3], n / 5.0)
        found = two_views.homography_motions(rng.choice([-1.0, 3.0]) * H, s.a)
        scaled = s.T_b_a.copy()
        scaled[:3, 3] *= np.linalg.norm(n) / 5.0  # in units of the distance of the plane
        errors = np.abs(found.T_b_a - scaled).max(axis=(1, 2))
        best = int(np.argmin(errors))
        assert errors[best] < 1e-9  # half of the digits where both answers meet, else rounding
        assert found.possible[best]
        np.testing.assert_allclose(found.normal[best], n / np.linalg.norm(n), atol=1e-9)
        for T, normal in zip(found.T_b_a, found.normal, strict=True):
            rebuilt = T[:3, :3] + np.outer(T[:3, 3], normal)
            np.testing.assert_allclose(rebuilt / np.linalg.norm(rebuilt), H / np.linalg.norm(H), atol=1e-9)
        ambiguous += bool(found.possible.all())
        assert bool(found.reason) == bool(found.possible.all())
        _, Rs, ts, _ = cv2.decomposeHomographyMat(H, np.eye(3))
        for T in found.T_b_a:
            gaps = [
                max(np.abs(T[:3, :3] - R).max(), np.abs(T[:3, 3] - t[:, 0]).max())
                for R, t in zip(Rs, ts, strict=True)
            ]
            assert min(gaps) < 1e-6
    assert 3 < ambiguous < 40  # told apart in some scenes, refused in others


def test_a_turn_is_no_plane_and_motion_along_the_normal_has_one_answer() -> None:
    x = [[-0.3, 0.2], [0.4, -0.1], [0.1, 0.3]]
    R = so3.exp([0.1, -0.2, 0.3])
    turn = two_views.homography_motions(2.0 * R, x)
    assert "rotation" in turn.reason
    np.testing.assert_allclose(turn.T_b_a[0, :3, :3], R, atol=1e-12)
    ahead = two_views.homography_motions(R @ (np.eye(3) + np.outer([0, 0, -0.3], [0, 0, 1.0])), x)
    assert ahead.possible.all()
    assert ahead.reason == ""
    np.testing.assert_allclose(ahead.normal, [[0, 0, 1]] * 2, atol=1e-7)  # a double root: half of the digits


def test_bad_homographies_are_told() -> None:
    with pytest.raises(ValueError, match="regular"):
        two_views.homography_motions(np.diag([1.0, 1.0, 0.0]), [[0.0, 0.0]])
    with pytest.raises(ValueError, match="need"):
        two_views.homography_motions(np.eye(3), np.zeros((0, 2)))

"""Camera centre and T_cam_world, the errata of (A2.1) and (A2.5), and the motion model."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.camera_pose import (
    DecayingVelocity,
    camera_from_world,
    centre_from_pose,
    pose_from_centre,
)

EPS = float(np.finfo(float).eps)
RNG = np.random.default_rng(20)
R_CAM_WORLD = so3.random(RNG, (6,))
P_WORLD = RNG.normal(0, 4, (6, 3))
X_WORLD = RNG.normal(0, 4, (6, 3))


def test_the_two_ways_to_write_a_pose_agree() -> None:
    T = pose_from_centre(R_CAM_WORLD, P_WORLD)
    by_centre = camera_from_world(R_CAM_WORLD, P_WORLD, X_WORLD)
    np.testing.assert_allclose(se3.act(T, X_WORLD), by_centre, rtol=0, atol=16 * EPS * 20)
    np.testing.assert_allclose(centre_from_pose(T), P_WORLD, rtol=0, atol=8 * EPS * 12)
    # the centre is the point that the camera sees at its own origin, and the translation of the inverse
    np.testing.assert_allclose(camera_from_world(R_CAM_WORLD, P_WORLD, P_WORLD), 0.0, atol=0)
    np.testing.assert_allclose(se3.translation(se3.inverse(T)), P_WORLD, rtol=0, atol=8 * EPS * 12)


def test_a_camera_that_looks_along_the_worlds_x_axis() -> None:
    """By hand: camera at (2, 0, 1), z ahead is the world's x, y down is -z, x right is -y."""
    R = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    assert camera_from_world(R, [2.0, 0.0, 1.0], [5.0, 1.0, 0.0]).tolist() == [-1.0, 1.0, 3.0]
    assert pose_from_centre(R, [2.0, 0.0, 1.0])[:3, 3].tolist() == [0.0, 1.0, -2.0]


def test_the_difference_first_is_more_exact_far_from_the_origin() -> None:
    """In map coordinates of 4e6 m: R X + t is off by some eps of 4e6; R (X - p) by eps of a few metres."""
    p = np.array([4e6, -3e6, 1e6])
    X = p + np.array([1.0, 2.0, 3.0])
    R = R_CAM_WORLD[0]
    exact = [
        float(sum(Fraction(r) * (Fraction(x) - Fraction(c)) for r, x, c in zip(row, X, p, strict=True)))
        for row in R
    ]
    assert np.abs(camera_from_world(R, p, X) - exact).max() < 8 * EPS * 4
    assert np.abs(se3.act(pose_from_centre(R, p), X) - exact).max() < 16 * EPS * 4e6


def test_a_pose_is_rigid_and_not_affine() -> None:
    """The erratum of (A2.1): lengths, angles and orientation stay, and six numbers say everything."""
    T = se3.random(RNG, (10,), spread=5.0)
    X = RNG.normal(size=(10, 4, 3))
    moved = se3.act(T[:, None], X)
    gram = [np.einsum("nij,nkj->nik", d, d) for d in (X - X[:, :1], moved - moved[:, :1])]
    np.testing.assert_allclose(gram[0], gram[1], rtol=0, atol=256 * EPS * 20)
    volume = [np.linalg.det(d[:, 1:]) for d in (X - X[:, :1], moved - moved[:, :1])]
    np.testing.assert_allclose(volume[0], volume[1], rtol=0, atol=256 * EPS * 20)
    assert np.linalg.matrix_rank(se3.act_with_jacobians(T[0], X[0]).J_pose.reshape(12, 6)) == 6
    shear = np.eye(4)
    shear[0, 1] = 0.3  # affine, with determinant 1
    sheared = X @ shear[:3, :3].T
    assert np.abs(np.linalg.norm(sheared, axis=-1) - np.linalg.norm(X, axis=-1)).max() > 0.01


def test_the_motion_is_from_frame_to_frame() -> None:
    """The erratum of (A2.5): all frames' mu in turn lead from keyframe to keyframe, none does alone."""
    keyframe = se3.random(RNG)
    mus = RNG.normal(0, 0.1, (8, 6))
    poses = [keyframe]
    for mu in mus:
        poses.append(se3.perturb(poses[-1], mu))
    between_keyframes = se3.log(se3.compose(poses[-1], se3.inverse(keyframe)))
    product = np.eye(4)
    for mu in mus:
        product = se3.exp(mu) @ product  # the newest on the left
    np.testing.assert_allclose(product @ keyframe, poses[-1], rtol=0, atol=64 * EPS * 4)
    assert np.linalg.norm(between_keyframes - mus[-1]) > 0.1
    assert np.linalg.norm(between_keyframes - mus.sum(0)) > 1e-3  # nor do they add up


def test_an_unmeasured_camera_slows_down_and_stops() -> None:
    model = DecayingVelocity(np.array([0.1, 0.0, 0.2, 0.0, 0.05, 0.0]), decay=0.8)
    T, first = se3.random(RNG), model.velocity
    for frame in range(1, 40):
        T_next = model.predict(T)
        model, T = model.update(T, T_next), T_next
        np.testing.assert_allclose(model.velocity, 0.8**frame * first, rtol=0, atol=64 * EPS * frame)


def test_a_steady_camera_is_met_halfway_every_frame() -> None:
    """Without decay the velocity goes to the true one, its error halved by each frame."""
    true = np.array([0.02, -0.1, 0.05, 0.3, -0.1, 0.2])
    model = DecayingVelocity(np.zeros(6), decay=1.0)
    T = se3.random(RNG)
    for frame in range(1, 20):
        T_next = se3.perturb(T, true)
        model, T = model.update(T, T_next), T_next
        np.testing.assert_allclose(model.velocity, (1 - 0.5**frame) * true, rtol=0, atol=64 * EPS * frame)
    wrong_side = se3.compose(T, se3.exp(true))
    assert np.abs(model.predict(T) - se3.perturb(T, true)).max() < 1e-5
    assert np.abs(model.predict(T) - wrong_side).max() > 1e-2


@pytest.mark.parametrize(
    ("decay", "weight"), [(1.1, 0.5), (-0.1, 0.5), (0.9, 0.0), (0.9, 1.5), (np.nan, 0.5)]
)
def test_impossible_settings_are_refused(decay: float, weight: float) -> None:
    with pytest.raises(ValueError, match="need 0 <= decay <= 1"):
        DecayingVelocity(np.zeros(6), decay, weight).update(np.eye(4), np.eye(4))

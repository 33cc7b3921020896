"""Every Jacobian of every model is the derivative, away from the axis and with a turned camera."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vslam_ref.geometry.cameras import Camera, projection
from vslam_ref.testing import check_jacobian

FieldPoints = Callable[..., np.ndarray]
XI = np.array([0.3, -0.2, 0.5, 0.4, -0.3, 0.2])


def near_exp(xi: np.ndarray) -> np.ndarray:
    """Rotation of phi, then translation of rho: Exp(xi) to first order, all that a derivative sees."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_rotvec(xi[3:]).as_matrix(), xi[:3]
    return T


@pytest.fixture
def points(camera: Camera, field_points: FieldPoints) -> np.ndarray:
    """Six points off the axis, none at the border."""
    return field_points(camera, 0.8, np.random.default_rng(8), 11)[5:]


def test_point_and_intrinsics(camera: Camera, points: np.ndarray) -> None:
    for X in points:
        at = camera.project_with_jacobians(X)
        assert at.valid
        check_jacobian(lambda v: camera.project(v).uv, X, at.J_point, roundings=1000)
        check_jacobian(
            lambda p, X=X: projection.project(p, X, lens=camera.lens).uv,
            camera.params, at.J_intrinsics, roundings=1000,
        )  # fmt: skip


def test_pose_and_world_point(camera: Camera, points: np.ndarray) -> None:
    T = near_exp(XI)
    for X_cam in points:
        X = (np.linalg.inv(T) @ [*X_cam, 1.0])[:3]
        at = camera.pixel_from_world_with_jacobians(T, X)
        assert at.valid
        near = np.abs(X_cam).max() / 8  # far points move little: keep the steps in proportion
        scale = np.repeat([near, 0.1], 3)
        check_jacobian(
            lambda d, X=X, s=scale: camera.pixel_from_world(near_exp(s * d) @ T, X).uv,
            np.zeros(6), at.J_pose * scale, roundings=1000,
        )  # fmt: skip
        check_jacobian(lambda v: camera.pixel_from_world(T, v).uv, X, at.J_point, roundings=1000)


def test_depth_does_not_matter(camera: Camera, points: np.ndarray) -> None:
    """Euler: a function of degree 0 in X has J X = 0."""
    at = camera.project_with_jacobians(points)
    along = np.einsum("nij,nj->ni", at.J_point, points)
    size = np.abs(at.J_point).max(axis=(1, 2)) * np.abs(points).max(axis=1)
    assert (np.abs(along).max(axis=1) < 1e-14 * size).all()


def test_pose_jacobian_has_the_gauge_of_a_scaled_world(camera: Camera, points: np.ndarray) -> None:
    """Moving the camera by rho is moving the point by rho."""
    at = camera.pixel_from_world_with_jacobians(np.eye(4), points)
    assert np.array_equal(at.J_pose[..., :3], at.J_point)


def test_with_jacobians_gives_the_same_pixels(camera: Camera, field_points: FieldPoints) -> None:
    X = field_points(camera, 1.2, np.random.default_rng(9), 200)
    at, plain = camera.project_with_jacobians(X), camera.project(X)
    assert np.array_equal(at.valid, plain.valid)
    assert np.abs(at.uv - plain.uv).max() < 1e-12 * np.abs(plain.uv).max()

"""PTAM's slips, kept as negative vectors: each is far outside what the tests of the right form allow."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Pinhole, pose_jacobian
from vslam_ref.geometry.cameras._series import tan_ratio

PTAM = Fov(fx=446.92, fy=447.07, cx=319.5, cy=239.5, omega=0.9333)  # a 640 x 480 camera of this kind


@pytest.mark.parametrize(("omega", "least"), [(0.9333, 0.03), (2.0, 0.2), (2.4, 0.4)])
def test_the_factor_near_the_axis_is_not_one(omega: float, least: float) -> None:
    """Factor 1 below r = 0.001 is wrong by 2 tan(omega/2)/omega - 1, and makes pixels jump at r = 0.001."""
    camera = Fov(PTAM.fx, PTAM.fy, PTAM.cx, PTAM.cy, omega)
    r = 0.000999
    right = camera.project([r, 0.0, 1.0]).uv[0]
    wrong = camera.fx * r + camera.cx
    limit = 2 * np.tan(omega / 2) / omega
    assert abs(right - wrong - camera.fx * r * (limit - 1)) < 1e-5
    assert right - wrong > least
    assert abs(float(tan_ratio(np.array(omega))) - limit) < 1e-15
    # the slope at the centre is where it hurts a solver: it is the limit, not 1
    J = camera.project_with_jacobians([0.0, 0.0, 1.0]).J_point
    assert abs(J[0, 0] / camera.fx - limit) < 1e-14


def test_a_point_behind_the_camera_is_not_mirrored(camera: Camera) -> None:
    """(A2.2) divides by z: behind the camera it draws the point upside down, in the middle of the image."""
    X = np.array([0.1, 0.2, 1.0])
    front, behind = camera.project(X), camera.project(-X)
    mirrored = camera.project_with_jacobians(X).uv  # what x/z, y/z would give for -X
    assert front.valid
    if isinstance(camera, Fisheye):  # it may see behind itself, but not there
        if behind.valid:
            assert np.abs(behind.uv - mirrored).max() > 100
    else:
        assert not behind.valid
        assert np.abs(behind.uv - mirrored).max() > 10


def test_a_pose_jacobian_of_the_right_perturbation_is_refused() -> None:
    """For T <- T Exp(xi) the columns are those of X_world, turned: not the same numbers."""
    T = np.eye(4)
    T[:3, 3] = [0.3, -0.2, 1.0]
    camera = Pinhole(500.0, 500.0, 320.0, 240.0)
    X_world = np.array([0.4, 0.1, 2.0])
    at = camera.pixel_from_world_with_jacobians(T, X_world)
    right = pose_jacobian(at.J_point, X_world)
    assert np.abs(right - at.J_pose).max() > 100

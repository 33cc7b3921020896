"""The models are OpenCV's, and the report's formulas at 50 digits."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import mpmath
import numpy as np
import pytest

from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Radtan

EPS = float(np.finfo(float).eps)
mpmath.mp.dps = 50
FieldPoints = Callable[..., np.ndarray]
Cameras = dict[str, Camera]


def pixels_by_opencv(camera: Camera, X: np.ndarray) -> np.ndarray:
    zero = np.zeros(3)
    if isinstance(camera, Fisheye):
        uv, _ = cv2.fisheye.projectPoints(X[:, None], zero, zero, camera.matrix, camera.params[4:])
    else:
        uv, _ = cv2.projectPoints(X[:, None], zero, zero, camera.matrix, camera.params[4:])
    return uv.reshape(-1, 2)


def test_projection_is_opencvs(opencv_camera: Camera, field_points: FieldPoints) -> None:
    """Both evaluate one polynomial; its terms, not its value, set the rounding: some eps of their sum."""
    camera = opencv_camera
    X = field_points(camera, 0.9, np.random.default_rng(0))
    if isinstance(camera, Fisheye):
        X = X[X[:, 2] > 0.02 * np.linalg.norm(X, axis=1)]  # OpenCV divides by z; behind, it mirrors
    found = camera.project(X)
    assert found.valid.all()
    r = np.linalg.norm(X[:, :2], axis=1) / X[:, 2]
    terms = r * (1 + np.abs(camera.params[4:]).sum() * (1 + r**6)) if not isinstance(camera, Fisheye) else 3
    tolerance = 32 * EPS * (camera.fx * terms + camera.cx)
    assert (np.abs(found.uv - pixels_by_opencv(camera, X)).max(axis=1) <= tolerance).all()


def test_intrinsics_and_pose_jacobians_are_opencvs(
    polynomial_camera: Camera, field_points: FieldPoints
) -> None:
    """OpenCV's columns at R = I: rotation vector, translation, fx, fy, cx, cy, distortion."""
    camera = polynomial_camera
    X = field_points(camera, 0.7, np.random.default_rng(1), 50)
    zero = np.zeros(3)
    _, J = cv2.projectPoints(X[:, None], zero, zero, camera.matrix, camera.params[4:])
    J = J.reshape(len(X), 2, -1)
    ours = camera.pixel_from_world_with_jacobians(np.eye(4), X)
    size = np.abs(J).max()
    # a rotation vector at zero is the left perturbation
    wanted = np.concatenate([J[..., 3:6], J[..., 0:3]], -1)
    assert np.abs(ours.J_pose - wanted).max() < 1e-13 * size
    n = len(camera.params)
    assert np.abs(ours.J_intrinsics - J[..., 6 : 6 + n]).max() < 1e-13 * size


def test_unprojection_is_opencvs(opencv_camera: Camera, field_points: FieldPoints) -> None:
    """OpenCV iterates to 1e-12 here; the rays stay where its own iteration converges."""
    camera = opencv_camera
    X = field_points(camera, 0.5, np.random.default_rng(2), 100)
    uv = camera.project(X).uv
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 1000, 1e-13)
    if isinstance(camera, Fisheye):
        X, uv = X[X[:, 2] > 0.1], uv[X[:, 2] > 0.1]
        xn = cv2.fisheye.undistortPoints(uv[:, None], camera.matrix, camera.params[4:], criteria=until)
    else:
        k = camera.params[4:] if len(camera.params) > 4 else np.zeros(4)
        xn = cv2.undistortPoints(uv[:, None], camera.matrix, k, criteria=until)
    assert np.abs(camera.unproject(uv).xn - xn.reshape(-1, 2)).max() < 1e-9


def test_fov_camera_is_the_reports_formula(fov_camera: Camera, field_points: FieldPoints) -> None:
    """(A2.2)-(A2.4) at 50 digits; tan and arctan give their roundings once each, xn and products a few."""
    camera = fov_camera
    assert isinstance(camera, Fov)
    X = field_points(camera, 1.0, np.random.default_rng(3), 100)
    for point, uv in zip(X, camera.project(X).uv, strict=True):
        x, y, z = (mpmath.mpf(float(v)) for v in point)
        r = mpmath.sqrt((x * x + y * y) / (z * z))
        w = mpmath.mpf(camera.omega)
        ratio = 1 if r == 0 or w == 0 else mpmath.atan(2 * r * mpmath.tan(w / 2)) / (w * r)
        wanted = [camera.cx + camera.fx * x / z * ratio, camera.cy + camera.fy * y / z * ratio]
        size = max(abs(float(v)) for v in wanted) + camera.cx
        assert max(abs(float(a - b)) for a, b in zip(uv, wanted, strict=True)) < 16 * EPS * size


@pytest.mark.parametrize("angle", [0.3, 1.2, np.pi / 2, 2.0, 3.0])
def test_fisheye_sees_behind_itself(cameras: Cameras, angle: float) -> None:
    """The definition: the radius is theta kappa(theta^2), at any angle inside the field."""
    camera = cameras["fisheye, equidistant"]
    uv = camera.project([np.sin(angle) * 0.6, np.sin(angle) * 0.8, np.cos(angle)])
    assert uv.valid
    wanted = [camera.cx + camera.fx * angle * 0.6, camera.cy + camera.fy * angle * 0.8]
    assert np.abs(uv.uv - wanted).max() < 16 * EPS * 2000


def test_a_swapped_p1_p2_is_seen(cameras: Cameras, field_points: FieldPoints) -> None:
    """The test above is sharp: exchanging the tangential coefficients moves pixels by more than 1 px."""
    a = cameras["radtan, left01-14"]
    assert isinstance(a, Radtan)
    b = Radtan(a.fx, a.fy, a.cx, a.cy, a.k1, a.k2, a.p2, a.p1, a.k3)
    X = field_points(a, 0.9, np.random.default_rng(0))
    assert np.abs(a.project(X).uv - b.project(X).uv).max() > 0.5

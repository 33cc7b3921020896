"""unproject undoes project all over the field."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from vslam_ref.geometry.cameras import Camera, Radtan
from vslam_ref.geometry.cameras.radtan import distort, undistort
from vslam_ref.testing import check_jacobian

EPS = float(np.finfo(float).eps)
FieldPoints = Callable[..., np.ndarray]


@pytest.mark.parametrize("share", [0.5, 0.99, 1 - 1e-6])
def test_rays_come_back(camera: Camera, field_points: FieldPoints, share: float) -> None:
    """A pixel is rounded to eps of the largest number in it; the ray's error is that times |dray/dpixel|."""
    X = field_points(camera, share, np.random.default_rng(1))
    seen = camera.project(X)
    back = camera.unproject_with_jacobians(seen.uv)
    assert seen.valid.all()
    assert back.valid.all()
    bearing = X / np.linalg.norm(X, axis=1, keepdims=True)
    gain = np.linalg.norm(back.J_pixel, axis=(1, 2))
    size = np.abs(seen.uv).max(axis=1) + camera.fx + camera.cx
    assert (np.abs(back.bearing - bearing).max(axis=1) <= 64 * EPS * (1 + gain * size)).all()


@pytest.mark.parametrize("share", [0.5, 0.99, 1 - 1e-6])
def test_pixels_come_back(camera: Camera, field_points: FieldPoints, share: float) -> None:
    X = field_points(camera, share, np.random.default_rng(2))
    uv = camera.project(X).uv
    at = camera.unproject(uv)
    again = camera.project(at.bearing)
    # a bearing's rounding is eps; beside the plane z = 1 the pinhole multiplies it by tan^2
    gain = np.linalg.norm(camera.project_with_jacobians(at.bearing).J_point, axis=(1, 2))
    assert at.valid.all()
    assert again.valid.all()
    size = np.abs(uv).max(axis=1) + camera.cx
    assert (np.abs(again.uv - uv).max(axis=1) <= 64 * EPS * (size + gain)).all()


def test_every_pixel_of_the_sensor_has_one_answer(camera: Camera) -> None:
    """Where unproject says valid, project leads back; where it says no, no ray of the field ends there."""
    u, v = np.meshgrid(np.linspace(-200, 952, 97), np.linspace(-200, 680, 75))
    uv = np.stack([u, v], -1)
    rays = camera.unproject(uv)
    again = camera.project(rays.bearing)
    assert np.abs((again.uv - uv)[rays.valid]).max() < 1e-8  # gain near the field's end
    if not rays.valid.all():
        # a missing pixel lies outside the image of the field's border
        theta = min(camera.max_angle, 3.14) * (1 - 1e-9)
        around = np.linspace(-np.pi, np.pi, 2000, endpoint=False)
        ring = np.stack(
            [np.sin(theta) * np.cos(around), np.sin(theta) * np.sin(around), 0 * around + np.cos(theta)], -1
        )
        border = camera.project(ring).uv - [camera.cx, camera.cy]
        missing = uv[~rays.valid] - [camera.cx, camera.cy]
        angle = np.arctan2(border[:, 1], border[:, 0])
        order = np.argsort(angle)
        reach = np.hypot(*border[order].T)
        wanted = np.interp(np.arctan2(missing[:, 1], missing[:, 0]), angle[order], reach, period=2 * np.pi)
        assert (np.hypot(*missing.T) > wanted * (1 - 1e-4)).all()


def test_undistortion_with_strong_tangential_terms(cameras: dict[str, Camera]) -> None:
    """Damped Newton steps find every ray of the field, up to one millionth of its radius."""
    k = np.array([-0.35, 0.02, 0.02, -0.03, 0.0])
    R = np.tan(Radtan(1, 1, 0, 0, *k).max_angle)
    r, around = np.meshgrid(np.append(np.linspace(0, 0.999, 60), 1 - 1e-6) * R, np.linspace(0, 6.28, 64))
    X = np.stack([r * np.cos(around), r * np.sin(around), np.ones_like(r)], -1)
    seen = distort(k, X)
    back = undistort(k, seen.xd)
    assert seen.valid.all()
    assert back.valid.all()
    # the eigenvalue at 1 - 1e-6 of the radius is about 1e-6
    assert np.abs(back.xn - X[..., :2]).max() < 1e-8
    assert np.abs((back.xn - X[..., :2])[:, :40]).max() < 1e-14


def test_jacobian_of_unprojection(camera: Camera, field_points: FieldPoints) -> None:
    X = field_points(camera, 0.8, np.random.default_rng(4), 12)
    uv = camera.project(X).uv[5:]
    for pixel in uv:
        at = camera.unproject_with_jacobians(pixel)

        def near(d: np.ndarray, pixel: np.ndarray = pixel) -> np.ndarray:
            return camera.unproject(pixel + d).bearing

        check_jacobian(near, np.zeros(2), at.J_pixel)  # steps of 0.006 px: the strongest lens bends over 1


def test_distorted_beyond_the_field_has_no_ray() -> None:
    """With k1 = -0.3 the radius D grows to D(R) = 2/3 R and never beyond."""
    R = np.sqrt(1 / 0.9)
    rays = undistort([-0.3, 0, 0, 0, 0], [[2 / 3 * R * (1 - 1e-12), 0.0], [2 / 3 * R * (1 + 1e-12), 0.0]])
    assert rays.valid.tolist() == [True, False]


def test_one_camera_for_each_point(camera: Camera, field_points: FieldPoints) -> None:
    """Parameters (N, n) against points (N, 3), and (2, 1, n) against (N, 3)."""
    from vslam_ref.geometry.cameras import projection

    X = field_points(camera, 0.7, np.random.default_rng(5), 9)
    many = np.tile(camera.params, (9, 1))
    many[::2, 0] *= 1.1
    at = projection.project_with_jacobians(many, X, lens=camera.lens)
    rays = projection.unproject(many, at.uv, lens=camera.lens)
    for i in range(9):
        one = type(camera).from_params(many[i])
        assert np.abs(at.uv[i] - one.project(X[i]).uv).max() < 1e-9
        assert np.abs(rays.bearing[i] - one.unproject(at.uv[i]).bearing).max() < 1e-12
    both = projection.project_with_jacobians(many[:2, None], X, lens=camera.lens)
    assert both.uv.shape == (2, 9, 2)
    assert both.valid.shape == (2, 9)
    assert both.J_intrinsics.shape == (2, 9, 2, len(camera.params))
    assert projection.project(many[:2, None], X, lens=camera.lens).valid.shape == (2, 9)
    assert projection.unproject(many[:2, None], both.uv[0], lens=camera.lens).valid.shape == (2, 9)

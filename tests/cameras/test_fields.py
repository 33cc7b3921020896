"""What cannot be seen is flagged: behind the camera, outside the invertible field, or not a number."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Pinhole, Radtan, Rational
from vslam_ref.geometry.cameras._roots import first_positive_root
from vslam_ref.geometry.cameras.fisheye import field_angle
from vslam_ref.geometry.cameras.interface import MAX_TAN
from vslam_ref.geometry.cameras.radtan import distort_with_jacobians, field_radius

SENSOR = {"fx": 500.0, "fy": 400.0, "cx": 320.0, "cy": 240.0}
BAD_POINTS = np.array(
    [
        [0.1, 0.2, np.nan], [np.nan, 0.0, 1.0], [np.inf, 0.0, 1.0], [0.0, 0.0, np.inf],
        [0.0, -np.inf, -np.inf], [0.0, 0.0, 0.0], [1e-320, 0.0, 1e-320], [1e300, 1e300, -1e300],
        [0.0, 0.0, -1.0], [5e-324, 0.0, 0.0],
    ]
)  # fmt: skip


def finite(camera: Camera, X: np.ndarray) -> np.ndarray:
    """Assert that nothing is NaN or infinite and that the flagged are as promised; the flags."""
    with np.errstate(all="raise", under="ignore"):
        at = camera.project_with_jacobians(X)
        plain = camera.project(X)
    for array in (at.uv, at.J_point, at.J_intrinsics, plain.uv):
        assert np.isfinite(array).all()
    assert (at.valid == plain.valid).all()
    assert np.abs(at.uv - plain.uv).max() < 1e-9
    assert (at.uv[~at.valid] == [camera.cx, camera.cy]).all()
    assert (at.J_point[~at.valid] == 0.0).all()
    assert (at.J_intrinsics[~at.valid] == 0.0).all()
    return plain.valid


def test_bad_points_are_flagged(camera: Camera) -> None:
    assert not finite(camera, BAD_POINTS).any()
    with np.errstate(all="raise", under="ignore"):
        world = camera.pixel_from_world_with_jacobians(np.eye(4), BAD_POINTS)
    assert (world.J_pose == 0.0).all()


def test_points_behind_a_plane_camera_are_flagged(camera: Camera) -> None:
    if isinstance(camera, Fisheye):
        return
    X = np.random.default_rng(0).normal(size=(200, 3))
    assert (finite(camera, X) <= (X[:, 2] > 0)).all()
    assert not finite(camera, -np.abs(X)).any()
    edge = np.array([[0.99 * MAX_TAN, 0.0, 1.0], [1.01 * MAX_TAN, 0.0, 1.0], [1.0, 0.0, 0.0]])
    assert not finite(camera, edge)[1:].any()


def test_bad_pixels_are_flagged(camera: Camera) -> None:
    uv = np.array([[np.nan, 0.0], [0.0, np.inf], [1e300, 0.0], [-1e9, 1e9]])
    if isinstance(camera, Radtan) and camera.max_angle > 1.5:
        uv = uv[:3]  # a polynomial that grows to the end has a ray for the last
    with np.errstate(all="raise", under="ignore"):
        at = camera.unproject_with_jacobians(uv)
    assert not at.valid.any()
    assert (at.bearing == [0.0, 0.0, 1.0]).all()
    assert (at.J_pixel == 0.0).all()
    assert (camera.unproject(uv).xn == 0.0).all()


def test_the_field_ends_where_the_map_turns_back(camera: Camera) -> None:
    """Just inside its end every point is seen, just outside none."""
    if camera.max_angle > np.arctan(MAX_TAN) - 1e-12:
        return
    around = np.linspace(0, 2 * np.pi, 73)
    for share, seen in ((1 - 1e-9, True), (1 + 1e-9, False)):
        theta = camera.max_angle * share
        X = np.stack(
            [np.sin(theta) * np.cos(around), np.sin(theta) * np.sin(around), np.full(73, np.cos(theta))], -1
        )
        if theta < np.pi:
            assert (finite(camera, X) == seen).all()


@pytest.mark.parametrize(
    ("k", "radius"),
    [
        ([-0.3, 0, 0, 0, 0], np.sqrt(1 / 0.9)),
        ([0, -0.2, 0, 0, 0], 1.0),  # 1 - r^4
        ([0, 0, 0, 0, -1 / 7], 1.0),  # 1 - r^6
        ([-0.6, 0.4, 0, 0, 0], None),  # 1 - 1.8 q + 2 q^2 has no real root
        ([0, 0, 0, 0, 0], None),
        ([0.1, 0.1, 0, 0, 0.1], None),
        ([0, 0, 0, 0, 0, 1.0, 0, 0], 1.0),  # r / (1 + r^2) is largest at 1
        ([0, 0, 0, 0, 0, -0.25, 0, 0], 2.0),  # the denominator's zero
        ([0, 0, 0.03, 0.04, 0], 1 / 0.3),  # 1 - 6 |p| r, |p| = 0.05
    ],
)
def test_field_radius_by_hand(k: list[float], radius: float | None) -> None:
    wanted = MAX_TAN if radius is None else radius
    assert abs(float(field_radius(k)) - wanted) < 1e-12 * wanted


@pytest.mark.parametrize("seed", range(20))
def test_field_radius_is_the_first_zero_of_the_smallest_eigenvalue(seed: int) -> None:
    """Oracle: the eigenvalue itself, on a grid of radii and angles, and brentq on the bound."""
    rng = np.random.default_rng(seed)
    k = np.array([*rng.uniform(-0.5, 0.2, 2), *rng.uniform(-0.02, 0.02, 2), rng.uniform(-0.2, 0.1)])
    if seed % 2:
        k = np.concatenate([k, rng.uniform(-0.2, 0.5, 3)])
    R = float(field_radius(k))
    around = np.linspace(0, 2 * np.pi, 181)
    r = np.linspace(0, min(R, 5.0) * (1 - 1e-6), 200)
    X = np.stack([r[:, None] * np.cos(around), r[:, None] * np.sin(around), np.ones((200, 181))], -1)
    at = distort_with_jacobians(k, X)
    assert at.valid.all()
    J = at.J_point[..., :2]
    assert np.abs(J - np.swapaxes(J, -1, -2)).max() < 1e-13 * np.abs(J).max()  # a gradient map
    assert np.linalg.eigvalsh(J).min() > 0
    if len(k) == 5 and R < 5.0:

        def bound(r: float) -> float:
            q = r * r
            grows = 1 + 3 * k[0] * q + 5 * k[1] * q**2 + 7 * k[4] * q**3
            ratio = 1 + k[0] * q + k[1] * q**2 + k[4] * q**3
            return float(min(grows, ratio) - 6 * np.hypot(k[2], k[3]) * r)

        assert abs(brentq(bound, 0, R * 1.01) - R) < 1e-9 * R
        # and it is sharp: at the worst angle the eigenvalue vanishes there
        toward = -np.array([k[3], k[2]]) / np.hypot(k[2], k[3])
        x = toward * R * (1 - 1e-9)
        worst = np.linalg.eigvalsh(distort_with_jacobians(k, [*x, 1.0]).J_point[:, :2]).min()
        assert 0 < worst < 1e-6


def test_field_of_many_cameras_at_once() -> None:
    k = np.array([[-0.3, 0, 0, 0, 0], [0, 0, 0, 0, 0], [-0.3, 0, 0, 0, 0]])
    assert np.array_equal(field_radius(k), [field_radius(row) for row in k])
    assert field_radius(k[:, None, :]).shape == (3, 1)
    k = np.array([[-0.1, 0, 0, 0], [0, 0, 0, 0]])
    assert np.array_equal(field_angle(k), [field_angle(row) for row in k])


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_lens_parameters_that_are_no_numbers_see_nothing(bad: float) -> None:
    assert float(field_radius([bad, 0, 0, 0, 0])) == 0.0
    assert float(field_angle([bad, 0, 0, 0])) == 0.0


@pytest.mark.parametrize("degree", [1, 3, 6])
def test_first_positive_root(degree: int) -> None:
    rng = np.random.default_rng(degree)
    for _ in range(50):
        roots = rng.uniform(-3, 3, degree)
        found = first_positive_root(np.poly(roots)[::-1])
        positive = roots[roots > 0]
        wanted = positive.min() if len(positive) else np.inf
        gap = np.abs(roots - wanted)
        if np.isfinite(wanted) and np.sort(gap)[1:2].min(initial=1) > 0.1:
            assert abs(found - wanted) < 1e-9


def test_tiny_highest_coefficients_do_no_harm() -> None:
    assert first_positive_root([1.0, -1.0, 1e-320]) == pytest.approx(1.0, rel=1e-14)
    assert first_positive_root([1.0]) == np.inf
    assert first_positive_root([]) == np.inf


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Pinhole(0.0, 1.0, 0.0, 0.0), "focal lengths must be more than 0"),
        (lambda: Pinhole(1.0, -1.0, 0.0, 0.0), "focal lengths must be more than 0"),
        (lambda: Fov(**SENSOR, omega=np.nan), "omega=nan: must be finite"),
        (lambda: Fov(**SENSOR, omega=-0.1), "at least 0 and less than pi"),
        (lambda: Fov(**SENSOR, omega=3.2), "at least 0 and less than pi"),
        (lambda: Radtan.from_params([1, 1, 0, 0]), "params of Radtan has shape"),
        (lambda: Pinhole(**SENSOR).project([1.0, 2.0]), r"X_cam has shape \(2,\): need"),
        (lambda: Pinhole(**SENSOR).unproject([1.0, 2.0, 3.0]), r"uv has shape \(3,\): need"),
        (lambda: Pinhole(**SENSOR).pixel_from_world(np.eye(3), [0, 0, 1]), "T_cam_world has shape"),
        (lambda: field_radius([1.0, 2.0]), r"k has shape \(2,\); need"),
    ],
)
def test_bad_input_is_refused(make: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()  # type: ignore[operator]


def test_a_camera_without_a_lens_cannot_be_made() -> None:
    with pytest.raises(TypeError, match="no lens"):
        Camera(1.0, 1.0, 0.0, 0.0)


def test_params_and_names_go_together() -> None:
    camera = Rational(**SENSOR, k1=1, k2=2, p1=3, p2=4, k3=5, k4=6, k5=7, k6=8)
    assert Rational.names() == ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
    assert Rational.from_params(camera.params) == camera
    assert Rational.names()[4:] == Rational.lens.names

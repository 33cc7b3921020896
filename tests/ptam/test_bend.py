"""A bend that is driven with a camera whose centre is wrong: the map's scale, and how it is cured."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.arrays import Array
from vslam_ref.estimation.bundle import BundleProblem, Observations, Options, Scene, bundle_adjust, freedom
from vslam_ref.geometry import camera_pose, se3
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.worlds import bends


def map_of(seen: bends.SeenDrive, camera: Pinhole, free: tuple[str, ...] = ()) -> Scene:
    """The best map of exact pixels with a camera, its first view held."""
    view, point = np.nonzero(seen.seen)
    scene = Scene(seen.T_cam_world, seen.X_world, camera.params[None])
    frees = freedom(Pinhole, scene, fixed_views=[0], intrinsics=free)
    problem = BundleProblem(Pinhole, scene, Observations(view, point, seen.uv[view, point]), free=frees)
    return bundle_adjust(problem, options=Options(max_iterations=100, cost=1e-9)).problem.scene


def steps(T: Array) -> Array:
    return np.asarray(np.linalg.norm(np.diff(camera_pose.centre_from_pose(T), axis=0), axis=1))


def growth(scene: Scene, seen: bends.SeenDrive) -> float:
    """Logarithm of the scale of the last 25 steps over that of the first 25."""
    ratio = steps(scene.T_cam_world) / steps(seen.T_cam_world)
    return float(np.log(ratio[-25:].mean() / ratio[:25].mean()))


@pytest.mark.parametrize("angle", [np.pi / 2, -np.pi / 4])
def test_the_world(angle: float) -> None:
    """Steps of the arc's chord; the camera turns by the angle; pixels are those of the points."""
    seen = bends.drive(np.random.default_rng(0), angle)
    turn = se3.rotation(seen.T_cam_world[-1])
    assert np.arctan2(-turn[0, 2], turn[2, 2]) == pytest.approx(angle)
    length = steps(seen.T_cam_world)
    np.testing.assert_allclose(length[:30], 1.0, atol=1e-12)
    chord = 2 * 12.0 * np.sin(1.0 / 24.0)
    inside = (seen.way[:-1] > seen.bend[0]) & (seen.way[1:] < seen.bend[1])
    np.testing.assert_allclose(length[inside], chord, atol=1e-12)
    X_cam = se3.act(seen.T_cam_world[3], seen.X_world[7])
    np.testing.assert_allclose(seen.uv[3, 7], 707 * X_cam[:2] / X_cam[2] + [600, 180], atol=1e-9)
    centre = camera_pose.centre_from_pose(seen.T_cam_world[-1])
    assert np.sign(centre[0]) == np.sign(angle)  # to the right is +x


@pytest.mark.parametrize("angle", [np.pi / 2, -np.pi / 2])
@pytest.mark.parametrize("offset", [8.0, -4.0])
def test_the_scale_goes_with_offset_times_angle(angle: float, offset: float) -> None:
    """Between one and three times offset / f times the angle, with its sign."""
    seen = bends.drive(np.random.default_rng(1), angle)
    wrong = Pinhole(707.0, 707.0, 600.0 + offset, 180.0)
    factor = growth(map_of(seen, wrong), seen) / (offset / 707.0 * angle)
    assert 1.0 < factor < 3.0


def test_without_a_bend_the_scale_stays() -> None:
    seen = bends.drive(np.random.default_rng(1), 1e-9)
    wrong = Pinhole(707.0, 707.0, 608.0, 180.0)
    assert abs(growth(map_of(seen, wrong), seen)) < 1e-3  # without a turn it is a shear, to first order


def test_a_camera_that_is_free_finds_itself() -> None:
    """Exact pixels: the true camera has no error at all, and is found to what ends the descent."""
    seen = bends.drive(np.random.default_rng(1), np.pi / 2)
    wrong = Pinhole(727.0, 727.0, 608.0, 184.0)
    found = map_of(seen, wrong, ("f", "cx", "cy"))
    np.testing.assert_allclose(found.intrinsics[0], bends.CAMERA.params, atol=0.05)
    assert abs(growth(found, seen)) < 1e-3


def test_what_a_turn_does_not_show_it_does_not_spoil() -> None:
    """A world stretched along the axis of the turn looks right: fy may be anything, the scale stays."""
    seen = bends.drive(np.random.default_rng(1), np.pi / 2)
    found = map_of(seen, Pinhole(707.0, 717.0, 600.0, 180.0))
    assert abs(growth(found, seen)) < 1e-3


def test_what_a_wrong_centre_adds_to_the_flow_of_a_turn() -> None:
    """Differences of exact flows against epsilon omega (2 x, y), to second order in epsilon."""
    omega, eps, h = 0.3, 1e-4, 1e-6
    X = np.random.default_rng(0).uniform([-1, -1, 2], [1, 1, 5], (20, 3))

    def seen(t: float) -> Array:
        c, s = np.cos(omega * t), np.sin(omega * t)  # to the right: points go to the left
        at = X @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]).T
        return np.asarray(at[:, :2] / at[:, 2:] + [eps, 0])

    flow, x = (seen(h) - seen(-h)) / (2 * h), seen(0)
    turn = -omega * np.stack([1 + x[:, 0] ** 2, x[:, 0] * x[:, 1]], 1)
    np.testing.assert_allclose(flow - turn, eps * omega * x * [2, 1], atol=20 * eps**2)

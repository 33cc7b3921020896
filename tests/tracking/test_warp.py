"""The affine map of a patch is the derivative of what a plane does to pixels."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.arrays import Array
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, Fov, Pinhole
from vslam_ref.systems.ptam.look import prepare
from vslam_ref.systems.ptam.settings import FeatureSettings
from vslam_ref.systems.visual_map import VisualMap, visible

SHAPE = (240, 320)
CAMERAS = [Pinhole(260.0, 250.0, 159.5, 119.5), Fov(250.0, 240.0, 159.5, 119.5, 0.9)]
T_KF = se3.exp([0.3, -0.2, 0.5, 0.2, -0.1, 0.3])
T_CAM = se3.exp([0.25, 0.1, -0.6, 0.1, 0.25, 0.5]) @ T_KF
DEPTH = 3.0


def a_map(camera: Camera, level: int = 0) -> VisualMap:
    """Points of one depth in a blank keyframe; only where they are matters."""
    made = VisualMap(camera, SHAPE)
    kf = made.add_keyframe(T_KF, prepare(0, np.zeros(SHAPE, np.uint8), FeatureSettings()))
    uv = np.stack(np.meshgrid(np.arange(40.0, 281, 40), np.arange(40.0, 201, 40)), -1).reshape(-1, 2)
    made.add_points(on_plane(camera, uv), kf, level, uv)
    return made


def on_plane(camera: Camera, uv: Array) -> Array:
    """World points under pixels of the keyframe, on the plane z = DEPTH across its axis."""
    ray = camera.unproject(uv).bearing
    return se3.act(se3.inverse(T_KF), DEPTH * ray / ray[:, 2:])


@pytest.mark.parametrize("camera", CAMERAS, ids=["pinhole", "fov"])
def test_it_is_the_derivative_of_the_map_from_pixel_to_plane_to_pixel(camera: Camera) -> None:
    """Central differences, h = 1e-3 pixels: h^2 of third derivatives below 1e-3; rounding: 1e-13 / h."""
    made, h = a_map(camera), 1e-3
    seen = visible(made, T_CAM)
    uv = made.points["source_uv"][seen.point]
    assert len(uv) > 10

    def there(at: Array) -> Array:
        return camera.project(se3.act(T_CAM, on_plane(camera, at))).uv

    numeric = np.stack([(there(uv + h * d) - there(uv - h * d)) / (2 * h) for d in np.eye(2)], -1)
    assert np.abs(seen.A - numeric).max() < 1e-7
    assert np.abs(seen.A - np.eye(2)).max() > 0.3  # a map worth the test


def test_from_where_it_was_taken_a_patch_is_as_it_was() -> None:
    for camera in CAMERAS:
        assert np.abs(visible(a_map(camera), T_KF).A - np.eye(2)).max() < 1e-12


@pytest.mark.parametrize("angle", [0.3, -1.2])
def test_a_camera_that_rolls_turns_the_patch_by_as_much(angle: float) -> None:
    """A pinhole with square pixels sees a plane across its axis turned, and nothing else."""
    camera = Pinhole(250.0, 250.0, 159.5, 119.5)
    A = visible(a_map(camera), se3.exp([0, 0, 0, 0, 0, angle]) @ T_KF).A
    R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    assert np.abs(A - R).max() < 1e-12


@pytest.mark.parametrize(
    ("closer", "source", "level"), [(1.0, 0, 0), (2.0, 0, 1), (3.9, 0, 2), (0.52, 2, 1), (1, 2, 2)]
)
def test_a_patch_of_twice_the_size_is_looked_for_one_level_further_down(
    closer: float, source: int, level: int
) -> None:
    """At half the distance A = 2; four pixels for one are too many, so the level below.  2^s counts, too."""
    camera = CAMERAS[0]
    T = se3.exp([0, 0, DEPTH / closer - DEPTH, 0, 0, 0]) @ T_KF
    seen = visible(a_map(camera, source), T)
    assert len(seen.level) > 0
    assert np.abs(seen.A - closer * np.eye(2)).max() < 1e-9
    assert set(seen.level.tolist()) == {level}


def test_too_small_too_large_behind_or_outside_is_not_visible() -> None:
    made = a_map(CAMERAS[0])
    for z in (2.1 * DEPTH, -0.96 * DEPTH, -1.5 * DEPTH):
        assert len(visible(made, se3.exp([0, 0, z, 0, 0, 0]) @ T_KF).point) == 0
    assert len(visible(made, se3.exp([50.0, 0, 0, 0, 0, 0]) @ T_KF).point) == 0

"""Slopes, warps and templates: derivatives by differences, and nothing from a neighbour's image."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from vslam_ref.arrays import Array
from vslam_ref.features import warp
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, Fov, Pinhole
from vslam_ref.systems.visual_map import VisualMap, templates, visible
from vslam_ref.systems.visual_map.visibility import affine, sources
from vslam_ref.systems.visual_map.visual_map import slopes

MakeMap = Callable[..., VisualMap]
CAMERAS = [Pinhole(150.0, 140.0, 63.5, 47.5), Fov(150.0, 140.0, 63.5, 47.5, 0.9)]
STEP = 1e-4
"""Pixels: differences are good to STEP^2 / f^2 of the value, and rounding eps * 100 / STEP = 2e-10."""


def differences(f: Callable[[Array], Array], uv: Array) -> Array:
    """Central differences (n, 2, 2) of f (n, 2) -> (n, 2)."""
    columns = [(f(uv + d) - f(uv - d)) / (2 * STEP) for d in STEP * np.eye(2)]
    return np.stack(columns, -1)


@pytest.mark.parametrize("camera", CAMERAS)
def test_slopes(camera: Camera) -> None:
    uv = np.random.default_rng(0).uniform([5, 5], [120, 90], (20, 2))
    numeric = differences(lambda at: camera.unproject(at).xn, uv)
    np.testing.assert_allclose(slopes(camera, uv), numeric, rtol=0, atol=1e-9)


@pytest.mark.parametrize("camera", CAMERAS)
def test_the_warp_is_the_derivative_through_the_plane(camera: Camera, make_map: MakeMap) -> None:
    """Pixel of the source -> its ray -> the plane of the point's depth across the source's axis -> pixel."""
    template = make_map()
    visual_map = VisualMap(camera, (96, 128), levels=2)
    T_source, T_cam = template.T_kf_world[0], template.T_kf_world[4]
    visual_map.keyframes.append(1, T_kf_world=T_source)
    rng = np.random.default_rng(1)
    uv, depth = rng.uniform([30, 30], [100, 70], (15, 2)), rng.uniform(2, 4, 15)

    def through(at: Array) -> Array:
        xn = camera.unproject(at).xn
        X_source = np.column_stack([xn, np.ones(len(xn))]) * depth[:, None]
        return np.asarray(camera.project(se3.act(T_cam, se3.act(se3.inverse(T_source), X_source))).uv)

    xn = camera.unproject(uv).xn
    X = se3.act(se3.inverse(T_source), np.column_stack([xn, np.ones(15)]) * depth[:, None])
    numbers = visual_map.add_points(X, 0, 0, uv)
    J = camera.project_with_jacobians(se3.act(T_cam, X)).J_point
    A = affine(visual_map, sources(visual_map, numbers), T_cam, J)
    np.testing.assert_allclose(A, differences(through, uv), rtol=0, atol=2e-8)


def test_templates_never_read_the_neighbours_image(make_map: MakeMap) -> None:
    """Images lie one under another: garbage in all the others changes no template."""
    visual_map = make_map()
    numbers = np.flatnonzero(visual_map.alive)
    origin = sources(visual_map, numbers)
    rng = np.random.default_rng(2)
    uv = rng.uniform([-3, -3], [131, 99], (len(numbers), 2))  # many at and beyond the borders
    origin = origin._replace(uv=uv, kf=rng.integers(0, 5, len(numbers)))
    A = np.eye(2) + rng.normal(0, 0.2, (len(numbers), 2, 2))
    level = np.zeros(len(numbers), np.int64)
    before = templates(visual_map, origin, A, level)
    assert 5 < before.inside.sum() < len(numbers) - 5
    for k in np.flatnonzero(before.inside)[:20]:
        own = int(origin.kf[k])
        for each in range(2):
            garbage = visual_map.image(each)
            kept = garbage[own].copy()
            saved = garbage.copy()
            garbage[:] = rng.integers(0, 256, garbage.shape, dtype=np.uint8)
            garbage[own] = kept
            if each == origin.level[k]:
                now = templates(visual_map, origin, A, level)
                assert now.inside[k]
                np.testing.assert_array_equal(now.patch[k], before.patch[k])
            garbage[:] = saved


def test_a_template_is_that_of_its_own_image_alone(make_map: MakeMap) -> None:
    """The same patch as from the one image, and refused where that image ends, up to the last row."""
    visual_map = make_map()
    rows = np.array([4.0, 3.75, 91.75, 92.0, 92.25, 50.5])
    numbers = np.flatnonzero(visual_map.alive)[: len(rows)]
    uv = np.column_stack([np.full(len(rows), 60.0), rows])
    origin = sources(visual_map, numbers)._replace(
        uv=uv, kf=np.full(len(rows), 2), level=np.zeros(len(rows), np.int64)
    )
    eye = np.broadcast_to(np.eye(2), (len(rows), 2, 2))
    found = templates(visual_map, origin, eye, np.zeros(len(rows), np.int64))
    alone = warp(visual_map.image(0)[2], uv, eye)
    assert found.inside.tolist() == alone.inside.tolist() == [True, False, True, True, False, True]
    np.testing.assert_array_equal(found.patch[alone.inside], alone.patch[alone.inside])


def test_visible_points_are_where_the_camera_puts_them(make_map: MakeMap) -> None:
    """Pixels and depths by projection; behind the camera nothing is visible; an unchanged view has A = I."""
    visual_map = make_map()
    seen = visible(visual_map, visual_map.T_kf_world[0])
    X_cam = se3.act(visual_map.T_kf_world[0], visual_map.X_world[seen.point])
    np.testing.assert_allclose(seen.uv, visual_map.camera.project(X_cam).uv, atol=1e-12)
    np.testing.assert_allclose(seen.depth, X_cam[:, 2])
    own = visual_map.points["source_kf"][seen.point] == 0
    assert own.sum() > 10
    np.testing.assert_allclose(seen.A[own], np.broadcast_to(np.eye(2), (own.sum(), 2, 2)), atol=1e-9)
    turned = se3.compose(se3.exp([0, 0, 0, 0, np.pi, 0]), visual_map.T_kf_world[0])
    assert len(visible(visual_map, turned).point) == 0
    visual_map.remove(seen.point[:3])
    assert not set(seen.point[:3].tolist()) & set(
        visible(visual_map, visual_map.T_kf_world[0]).point.tolist()
    )

"""Dots, lines, areas and the house land where the camera's projection puts them."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.experiments.visual_slam import overlay, raster, running, solids
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.cameras import Fov, Pinhole

RED = (255, 0, 0)


def canvas(height: int = 40, width: int = 60) -> np.ndarray:
    return np.zeros((height, width, 3), np.uint8)


def painted(image: np.ndarray) -> np.ndarray:
    """Pixels (x, y) that are not black."""
    return np.argwhere(image.any(-1))[:, ::-1]


def test_a_dot_is_a_disc_around_its_pixel() -> None:
    image = canvas()
    raster.dots(image, np.array([[20.3, 10.6]]), RED, 3.0)
    at = painted(image) - [20, 11]
    assert len(at) == 37 - 8  # pixels with x^2 + y^2 <= 9 (29: Gauss' circle problem)
    assert (np.hypot(*at.T) <= 3.0).all()


def test_what_lies_outside_or_is_no_number_is_left_out() -> None:
    image = canvas()
    raster.dots(image, np.array([[-50.0, 3], [np.nan, 2], [1e300, 0], [59, 39]]), RED, 1.0)
    assert sorted(map(tuple, painted(image).tolist())) == [(58, 39), (59, 38), (59, 39)]
    raster.lines(image, np.array([[[1e6, 0], [3.0, 3.0]]]), RED, 1.0)
    raster.area(image, np.array([[70.0, 5], [90, 5], [80, 9]]), RED)
    assert len(painted(image)) == 3


def test_half_cover_lets_half_through_once() -> None:
    image = np.full((5, 5, 3), 100, np.uint8)
    raster.dots(image, np.array([[2.0, 2.0], [2.0, 2.0]]), (200, 0, 100), 0.0, 0.5)
    assert image[2, 2].tolist() == [150, 50, 100]


def test_lines_have_no_gap_and_stay_on_their_line() -> None:
    """Steps of at most a pixel in both directions; rounding moves a point by half a pixel in each."""
    rng = np.random.default_rng(0)
    for ends in rng.uniform([5, 5], [54, 34], (50, 2, 2)):
        image = canvas()
        raster.lines(image, ends[None], RED, 0.0)
        at = painted(image).astype(float)
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        off = (at - ends[0]) @ np.array([-along[1], along[0]])
        assert np.abs(off).max() <= np.sqrt(0.5) + 1e-9
        assert np.diff(np.sort((at - ends[0]) @ along)).max() <= np.sqrt(2) + 1e-9
        for end in np.rint(ends):
            assert (at == end).all(1).any()


def test_several_lines_are_those_one_by_one() -> None:
    ends = np.random.default_rng(1).uniform(-10, 60, (20, 2, 2))
    both, single = canvas(), canvas()
    raster.lines(both, ends, RED, 1.0)
    for one in ends:
        raster.lines(single, one[None], RED, 1.0)
    np.testing.assert_array_equal(both, single)


@pytest.mark.parametrize("turn", [1, -1])
def test_an_area_is_the_pixels_inside(turn: int) -> None:
    """Oracle: signed areas, pixel by pixel."""
    corners = np.array([[10.2, 5.1], [50.7, 8.3], [40.1, 30.9], [12.4, 25.6]])[::turn]
    image = canvas()
    raster.area(image, corners, RED)
    for y, x in np.ndindex(image.shape[:2]):
        edges = [(b - a, np.array([x, y]) - a) for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)]
        inside = len({np.sign(d[0] * p[1] - d[1] * p[0]) for d, p in edges}) == 1
        assert image[y, x].any() == inside


def test_the_house_is_closed_convex_and_stands_on_the_plane() -> None:
    faces = solids.house(0.5)
    corners = np.concatenate([face.corners for face in faces])
    assert corners[:, 2].min() == 0.0
    assert corners[:, 2].max() == pytest.approx(0.5 * solids.ROOF)
    for face in faces:
        height = (corners - face.corners[0]) @ face.normal
        assert height.max() < 1e-12  # all of it behind each face: convex, normals outwards
        np.testing.assert_allclose((face.corners - face.corners[0]) @ face.normal, 0.0, atol=1e-12)
    area = sum(normal_area(face.corners) for face in faces)
    floor = np.array([0, 0, -0.25 * solids.WIDTH * solids.DEPTH])
    np.testing.assert_allclose(area + floor, 0.0, atol=1e-12)  # a closed surface has no area as a vector


def normal_area(corners: np.ndarray) -> np.ndarray:
    """Area times normal of a flat polygon, (3,)."""
    return 0.5 * np.cross(corners, np.roll(corners, -1, 0)).sum(0)


def test_from_above_both_sides_of_the_roof_are_seen_and_no_wall() -> None:
    seen = solids.faces_towards(solids.house(1.0), np.array([0.0, 0.0, 50.0]))
    assert sorted(face.light for face in seen) == [0.8, 1.0]


@pytest.mark.parametrize(
    "camera", [Pinhole(200.0, 200.0, 159.5, 119.5), Fov(200.0, 200.0, 159.5, 119.5, 0.9)]
)
def test_the_grid_goes_through_the_lens(camera: Pinhole | Fov) -> None:
    """Seen pixels are those of the camera's own projection; ends behind the camera are not seen."""
    T = se3.from_rt(so3.exp([1.2, 0.1, 0.2]), [0.1, 0.8, 1.5])  # stands on the plane: a part is behind
    view = solids.SolidView(camera, (320, 240), T)
    ends = solids.grid(1.0)
    uv, seen = view.pixels(ends)
    X = se3.act(T, ends)
    assert not seen[X[..., 2] <= 0].any()
    np.testing.assert_array_equal(uv[seen], camera.project(X[seen]).uv)
    there = camera.project(X)
    inside = (there.uv >= 0).all(-1) & (there.uv < (320, 240)).all(-1) & there.valid & (X[..., 2] > 0)
    assert 50 < inside.sum() < inside.size
    assert (X[..., 2] <= 0).any()
    assert seen[inside].all()
    np.testing.assert_allclose(se3.act(T, view.eye), 0.0, atol=1e-12)


def test_what_stands_on_the_plane_is_seen_where_the_map_has_it() -> None:
    """A point of the map, once through the plane's frame and once straight."""
    camera, T_cam_world = Pinhole(200.0, 200.0, 159.5, 119.5), se3.exp([0.1, 0.2, 0.3, 0.1, -0.2, 0.3])
    stage = overlay.Stage(se3.exp([0.4, -0.5, 1.0, 0.7, 0.2, 1.1]), 0.5)
    X_world = np.random.default_rng(0).uniform(-1, 1, (20, 3)) + [0, 0, 4]
    view = overlay.view_of(camera, (320, 240), T_cam_world, stage)
    uv, seen = view.pixels(se3.act(stage.T_plane_world, X_world))
    assert seen.all()
    np.testing.assert_allclose(uv, camera.project(se3.act(T_cam_world, X_world)).uv, atol=1e-9)


def test_points_of_a_picture_are_drawn_in_the_colour_of_their_level() -> None:
    marks = running.Marks(
        np.array([[10, 10], [30, 10], [10, 30], [40, 30]], np.float32), np.arange(4, dtype=np.uint8)
    )
    image = canvas()
    overlay.draw_marks(image, running.Frame(0, 0.0, running.GOOD, marks=marks), 1.0)
    assert [tuple(image[y, x].tolist()) for x, y in marks.uv.astype(int)] == list(overlay.LEVELS)
    assert len(set(overlay.LEVELS)) == 4


def test_the_grid_is_square_and_has_its_lines() -> None:
    ends = solids.grid(0.25)
    n = solids.CELLS
    assert len(ends) == 2 * (n + 1) * n * solids.PIECES
    assert (ends[..., 2] == 0).all()
    assert np.abs(ends).max() == 0.25 * n / 2
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    np.testing.assert_allclose(length, 0.25 / solids.PIECES)

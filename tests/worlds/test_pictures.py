"""Painted walls: areas and edges are where the polygons are, and a second view is the first one moved."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from vslam_ref.worlds.pictures import Wall, house_front, moved, painted_wall, picture


def test_the_centre_of_a_square_is_that_of_its_grey_levels() -> None:
    """Edges change linearly over two pixels about the true edge: area and centre are kept.

    Rounding to whole grey levels: at most half a level at 80 pixels of the border.
    """
    low, high = np.array([7.3, 9.8]), np.array([17.3, 19.8])
    corner = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    drawn = picture(Wall(corner[None], np.array([200.0]), ground=100.0), size=(30, 32)).astype(float) - 100
    y, x = np.indices(drawn.shape)
    assert abs(drawn.sum() / 100 - 100) < 0.5
    for place, axis in ((x, 0), (y, 1)):
        assert abs((place * drawn).sum() / drawn.sum() - (low + high)[axis] / 2) < 0.05


def test_a_second_view_shows_the_same_wall() -> None:
    """Away from edges both pictures are flat: the second, read where the homography says, is the first."""
    H = np.array([[1.2, 0.2, -20.0], [-0.1, 1.1, 10.0], [2e-4, 0.0, 1.0]])
    wall = painted_wall(np.random.default_rng(0), 60, (160, 120))
    one, two = picture(wall, size=(160, 120)), picture(wall, H, size=(160, 120))
    y, x = np.indices(one.shape)
    at = moved(H, np.stack([x, y], -1).reshape(-1, 2))
    seen = map_coordinates(two.astype(float), at.T[::-1], order=1, cval=-1.0).reshape(one.shape)
    steep = np.hypot(*np.gradient(one.astype(float))) > 0
    inside = ((at >= 3) & (at <= [156, 116])).all(1).reshape(one.shape)
    assert inside.mean() > 0.5
    agree = np.abs(seen - one) <= 1
    assert agree[inside & ~steep].mean() > 0.97  # beside an edge, half a pixel of blur more or less
    wrong = np.abs(
        map_coordinates(two.astype(float), moved(np.linalg.inv(H), at).T[::-1], order=1) - one.ravel()
    )
    assert (wrong <= 1).mean() < 0.5


def test_a_wall_needs_a_generator_for_noise_and_is_the_same_from_the_same_seed() -> None:
    wall = painted_wall(np.random.default_rng(3), 20)
    again = painted_wall(np.random.default_rng(3), 20)
    np.testing.assert_array_equal(wall.vertex, again.vertex)
    with pytest.raises(ValueError, match="need a generator"):
        picture(wall, noise=1.0)


def test_the_second_front_lacks_windows_and_has_no_others() -> None:
    front, later = house_front(np.random.default_rng(0), 0.25)
    assert len(front.grey) == 432
    assert 280 < len(later.grey) < 370  # 432 of 3/4, six deviations of 9
    all_of_them = {tuple(v) for v in front.vertex.reshape(-1, 8)}
    assert {tuple(v) for v in later.vertex.reshape(-1, 8)} < all_of_them

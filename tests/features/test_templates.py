"""Warped patches: SciPy's interpolation, and a surface drawn in two views."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from vslam_ref.features.templates import cut, sampling, search_level, warp

Bytes = NDArray[np.uint8]
pytestmark = pytest.mark.usefixtures("backend")


def test_it_is_scipys_linear_interpolation(wall: Bytes) -> None:
    """Before rounding both are right to some 10 eps of 255: only near a half may they round apart."""
    rng = np.random.default_rng(0)
    uv, M = rng.uniform(20, 200, (300, 2)), np.eye(2) + rng.normal(0, 0.4, (300, 2, 2))
    step = np.arange(8) - 4.0
    offset = np.stack(np.meshgrid(step, step), -1).reshape(-1, 2)  # row by row, x first
    at = uv[:, None] + np.einsum("nij,kj->nki", M, offset)
    exact = map_coordinates(wall.astype(float), at[..., ::-1].transpose(2, 0, 1), order=1).reshape(-1, 8, 8)
    found = warp(wall, uv, M)
    assert found.inside.all()
    near_half = np.abs(exact % 1 - 0.5) < 1e-11
    assert not ((found.patch != np.floor(exact + 0.5)) & ~near_half).any()


def test_whole_pixels_are_cut_out_as_they_are(wall: Bytes) -> None:
    height, width = wall.shape
    xy = np.array([[4, 4], [100, 50], [width - 4, height - 4]])
    found = cut(wall, xy)
    assert found.inside.all()
    for (x, y), patch in zip(xy, found.patch, strict=True):
        np.testing.assert_array_equal(patch, wall[y - 4 : y + 4, x - 4 : x + 4])


def test_what_leaves_the_image_is_marked(wall: Bytes) -> None:
    height, width = wall.shape
    outside = np.array(
        [[3.9, 50], [50, 3.9], [width - 3.9, 50], [50, height - 3.9], [np.nan, 50], [1e9, 1e9]]
    )
    found = warp(wall, outside, np.broadcast_to(np.eye(2), (6, 2, 2)))
    assert not found.inside.any()
    assert not found.patch.any()


def surface(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Grey levels of a wall; second derivatives of at most 110 / 49."""
    return 120 + 60 * np.sin(x / 7) + 50 * np.cos(y / 7)


@pytest.mark.parametrize("target_level", [0, 1])
def test_a_template_is_what_the_other_view_shows(target_level: int) -> None:
    """u_target = A u_source + b, both drawn from the surface itself.

    The template, read from the source, differs from the target's patch by the linear interpolation, at most
    (1/8)(60 + 50)/49 = 0.28, and by two roundings, 1 in all; a level 1 pixel is the mean of four, and the
    surface at its centre is off by at most (1/2)(1/4)(110/49) |A^-1|^2 = 0.3.  Inverting A, or forgetting the
    level, is off by tens.
    """
    A, b = np.array([[1.3, 0.4], [-0.2, 0.9]]), np.array([-10.0, 20.0])
    y, x = np.mgrid[0:120, 0:120].astype(float)
    source = np.rint(surface(x, y)).astype(np.uint8)
    centre = np.array([60.0, 55.0])
    scale = 2.0**target_level
    u = A @ centre + b  # level 0 of the target
    step = np.arange(8) - 4.0
    offset = np.stack(np.meshgrid(step, step), -1)
    there = (u + scale * offset - b) @ np.linalg.inv(A).T
    expected = surface(there[..., 0], there[..., 1])
    found = warp(source, [centre], [sampling(A, target_level, 0)])
    assert np.abs(found.patch[0] - expected).max() < 1.6
    for wrong in (np.linalg.inv(A), A.T, 2.0 * A):
        other = warp(source, [centre], [sampling(wrong, target_level, 0)])
        assert np.abs(other.patch[0] - expected).max() > 8


def test_source_levels_count_against_target_levels() -> None:
    A = np.array([[2.0, 1.0], [0.0, 1.0]])
    np.testing.assert_array_equal(sampling(A, 2, 2), np.linalg.inv(A))
    np.testing.assert_array_equal(sampling(A, 3, 1), 4 * np.linalg.inv(A))


@pytest.mark.parametrize(
    ("area", "level"),
    [
        (0.2, -1),
        (0.25, 0),
        (1.0, 0),
        (2.9, 0),
        (3.1, 1),
        (11.9, 1),
        (12.1, 2),
        (190.0, 3),
        (193.0, -1),
        (-1.0, -1),
    ],
)
def test_levels_are_chosen_by_area_as_in_ptam(area: float, level: int) -> None:
    """PTAM: while the area exceeds 3, go one level up and divide it by 4; refuse below a quarter."""
    A = np.diag([area, 1.0])
    assert search_level(A) == level

"""Pyramids against OpenCV's area means, and levels' positions against a picture that shows its position."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from vslam_ref.features.levels import (
    finest_from_level,
    halve,
    level_from_finest,
    level_sigma,
    pyramid,
)

Bytes = NDArray[np.uint8]
pytestmark = pytest.mark.usefixtures("backend")


def test_levels_are_opencvs_area_means(wall: Bytes) -> None:
    """Both round half up, so not one pixel differs."""
    expected = wall
    for level in pyramid(wall, 5)[1:]:
        expected = cv2.resize(expected, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        np.testing.assert_array_equal(level, expected)


def test_halves_are_rounded_up_and_odd_ends_left_out() -> None:
    image = np.array([[0, 1, 9], [0, 1, 9], [9, 9, 9]], np.uint8)
    assert halve(image).tolist() == [[1]]
    assert halve(np.array([[0, 1], [0, 0]], np.uint8)).tolist() == [[0]]
    assert halve(np.full((2, 2), 255, np.uint8)).tolist() == [[255]]


def test_a_part_of_a_larger_image_is_halved_alike(wall: Bytes) -> None:
    np.testing.assert_array_equal(halve(wall[10:60, 20:90]), halve(wall[10:60, 20:90].copy()))


@pytest.mark.parametrize("axis", [0, 1])
def test_the_half_pixel_between_levels(axis: int) -> None:
    """Grey level = twice the position: means of it are exact, so a level shows where its pixels lie.

    With x_0 = 2^l x_l, the half pixel forgotten, this is off by 2^l - 1 grey levels.
    """
    ramp = np.broadcast_to(2 * np.arange(120, dtype=np.uint8), (120, 120))
    for level, image in enumerate(pyramid(ramp if axis == 0 else ramp.T, 4)):
        at = np.indices(image.shape)[::-1].reshape(2, -1).T  # x, y
        place = finest_from_level(at, level)
        np.testing.assert_array_equal(2 * place[:, axis], image[at[:, 1], at[:, 0]])
        np.testing.assert_array_equal(level_from_finest(place, level), at)


def test_levels_of_each_point_may_differ() -> None:
    uv, level = np.array([[1.0, 2.0], [1.0, 2.0]]), np.array([0, 2])
    np.testing.assert_array_equal(finest_from_level(uv, level), [[1.0, 2.0], [5.5, 9.5]])
    np.testing.assert_array_equal(level_sigma(level), [1.0, 4.0])


@pytest.mark.parametrize(
    ("image", "levels", "told"),
    [
        (np.zeros((8, 8)), 1, "float64 of shape"),
        (np.zeros((8, 8, 3), np.uint8), 1, "need uint8"),
        (np.zeros((7, 9), np.uint8), 4, "at least 8 x 8"),
        (np.zeros((8, 8), np.uint8), 0, "need at least 1"),
    ],
)
def test_what_is_no_grey_image_is_refused(image: Bytes, levels: int, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        pyramid(image, levels)

"""Moments in closed form and by OpenCV; directions that turn with the picture."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from vslam_ref.features.orb import book
from vslam_ref.features.orb.direction import moments, towards

Bytes = NDArray[np.uint8]
pytestmark = pytest.mark.usefixtures("backend")


def test_moments_of_a_slope() -> None:
    """Of 128 + a x + b y they are (a, b) times the sum of x^2 over the disc, counted here row by row.

    The disc has 31 pixels in its middle rows and 7 in its first and last: those within 15.5 pixels.
    """
    half = [15, 15, 15, 15, 14, 14, 14, 13, 13, 12, 11, 10, 9, 8, 6, 3]
    rows = [half[abs(v)] for v in range(-15, 16)]
    squares = sum(u * u for h in rows for u in range(-h, h + 1))
    x, y = np.meshgrid(np.arange(-15, 16), np.arange(-15, 16))
    for a, b in [(3, 0), (0, -4), (2, 5), (-7, 1)]:
        image = (128 + a * x + b * y).astype(np.uint8)
        assert moments(image, [[15, 15]]).tolist() == [[a * squares, b * squares]]


def test_opencv_finds_the_same_angles(wall: Bytes) -> None:
    """On one octave, at the pixels it chose; its arc tangent is documented to 0.3 degrees."""
    found = cv2.ORB_create(200, nlevels=1).detect(wall)
    xy = np.array([k.pt for k in found]).astype(np.int32)
    assert len(xy) > 100
    unit = towards(moments(wall, xy))
    theirs = np.radians([k.angle for k in found])
    off = np.angle(np.exp(1j * (np.arctan2(unit[:, 1], unit[:, 0]) - theirs)))
    assert np.abs(off).max() < np.radians(0.3)


def test_plain_loops_find_the_same(wall: Bytes) -> None:
    xy = np.random.default_rng(0).integers(15, 201, (20, 2))
    m = moments(wall, xy)
    expected = [book.angle(wall, x, y) for x, y in xy.tolist()]
    found = np.arctan2(m[:, 1], m[:, 0])  # of the same whole numbers: two roundings of numbers below 4
    np.testing.assert_allclose(found, expected, rtol=0, atol=4 * np.finfo(float).eps)


def test_unit_vectors_and_flat_patches() -> None:
    unit = towards(np.array([[3, 4], [-5, 12], [0, -2], [0, 0]]))
    np.testing.assert_allclose(unit, [[0.6, 0.8], [-5 / 13, 12 / 13], [0, -1], [1, 0]], atol=2e-16)


def test_a_pixel_too_near_to_the_border_is_refused(wall: Bytes) -> None:
    with pytest.raises(ValueError, match=r"pixel \(14, 50\)"):
        moments(wall, [[14, 50]])

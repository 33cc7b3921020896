"""The smaller eigenvalue of the structure tensor, against OpenCV and closed forms."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from vslam_ref.features.corners import shi_tomasi

Bytes = NDArray[np.uint8]
pytestmark = pytest.mark.usefixtures("backend")


def test_it_is_opencvs_with_plain_differences(wall: Bytes) -> None:
    """OpenCV's aperture 1 is I(x+1) - I(x-1), twice our slope, over 255; its block is the same 7 x 7.

    It sums in single precision: a + c and the root are right to some 50 eps of a + c <= 2 * 255^2 / 255^2.
    """
    inner = np.stack(np.meshgrid(np.arange(10, 300, 3), np.arange(10, 220, 3)), -1).reshape(-1, 2)
    theirs = cv2.cornerMinEigenVal(wall, 7, ksize=1)[inner[:, 1], inner[:, 0]] * 255.0**2 / 4
    ours = shi_tomasi(wall, inner)
    assert np.abs(ours - theirs).max() <= 50 * np.finfo(np.float32).eps * 2 * 255.0**2 / 4
    assert ours.max() > 500


def test_an_edge_has_none_however_it_lies() -> None:
    x, y = np.meshgrid(np.arange(20), np.arange(20))
    for edge in (x > 9, y > 9, x > y):
        assert shi_tomasi((200 * edge).astype(np.uint8), [[10, 10]])[0] < 1e-9 * 200**2


def test_it_turns_with_the_image(wall: Bytes) -> None:
    """The eigenvalue knows no direction: a quarter turn of the image changes nothing, exactly."""
    turned = np.rot90(wall)  # pixel (x, y) goes to (y, W - 1 - x)
    xy = np.array([[50, 60], [200, 100]])
    there = np.stack([xy[:, 1], wall.shape[1] - 1 - xy[:, 0]], 1)
    np.testing.assert_array_equal(shi_tomasi(wall, xy), shi_tomasi(turned, there))


def test_pixels_at_the_border_are_refused(wall: Bytes) -> None:
    assert shi_tomasi(wall, [[4, 4]]).shape == (1,)
    with pytest.raises(ValueError, match="need 4 pixels"):
        shi_tomasi(wall, [[3, 4]])

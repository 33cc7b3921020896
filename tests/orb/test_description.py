"""Smoothing by SciPy and OpenCV, descriptors in plain loops."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from vslam_ref.features.orb import book
from vslam_ref.features.orb.description import WEIGHTS, describe, smooth
from vslam_ref.features.orb.pair_table import PAIRS

Bytes = NDArray[np.uint8]
pytestmark = pytest.mark.usefixtures("backend")


def test_weights_are_a_gaussian_of_two_pixels() -> None:
    """Of rounded 256ths each is off by a half at most, the middle one by halves of all the others."""
    exact = np.exp(-(np.arange(-3, 4) ** 2) / (2 * 2.0**2))
    off = WEIGHTS - 256 * exact / exact.sum()
    assert WEIGHTS.sum() == 256
    assert np.abs(np.delete(off, 3)).max() <= 0.5
    assert abs(off[3]) <= 3


@pytest.mark.parametrize("shape", [(4, 4), (4, 30), (31, 5), (40, 41)])
def test_smoothing_is_a_correlation_with_mirrored_borders(shape: tuple[int, int]) -> None:
    """SciPy's sums of whole numbers below 2^53 are exact, and so is the rounding half up."""
    image = np.random.default_rng(shape[0]).integers(0, 256, shape, dtype=np.uint8)
    rows = correlate1d(image.astype(float), WEIGHTS.astype(float), 1, mode="mirror")
    both = correlate1d(rows, WEIGHTS.astype(float), 0, mode="mirror")
    np.testing.assert_array_equal(smooth(image), np.floor(both / 2**16 + 0.5))


def test_opencvs_gaussian_is_the_same_to_a_grey_level_or_two(wall: Bytes) -> None:
    """Weights differ by 2 of 256 in the middle, and by as much in all others: 1.6 % of 255, twice: 8.

    That is for a picture of single bright pixels; where neighbours are alike, differences cancel.
    """
    theirs = cv2.GaussianBlur(wall, (7, 7), 2.0, borderType=cv2.BORDER_REFLECT_101)
    difference = np.abs(smooth(wall).astype(int) - theirs)
    assert difference.max() <= 8
    assert difference.mean() < 0.5


def test_plain_loops_describe_the_same(wall: Bytes) -> None:
    rng = np.random.default_rng(3)
    xy, theta = rng.integers(22, 194, (12, 2)), rng.uniform(-np.pi, np.pi, 12)
    bits = np.unpackbits(
        describe(smooth(wall), xy, np.stack([np.cos(theta), np.sin(theta)], 1)), axis=1, bitorder="little"
    )
    for k in range(12):
        assert bits[k].tolist() == book.descriptor(wall, *xy[k].tolist(), float(theta[k]), PAIRS)


def test_pairs_of_ones_own(wall: Bytes) -> None:
    """The first sixteen pairs give the first two bytes; pairs that would leave the border are refused."""
    smoothed, at, right = smooth(wall), [[60, 60]], [[0.6, 0.8]]
    two = describe(smoothed, at, right, PAIRS[:16])
    np.testing.assert_array_equal(two, describe(smoothed, at, right)[:, :2])
    with pytest.raises(ValueError, match="whole bytes"):
        describe(smoothed, at, right, PAIRS[:9])
    with pytest.raises(ValueError, match="more than 19 from the centre"):
        describe(smoothed, at, right, np.array([[0, 0, 14, 14]] * 8))


def test_which_pixel_decides_which_bit() -> None:
    """A single brighter pixel under the second point of a pair sets its bit; under the first, it does not."""
    for number in (0, 7, 8, 255):
        ax, ay, bx, by = PAIRS[number]
        for (x, y), expected in (((bx, by), 1), ((ax, ay), 0)):
            for turn, c, s in ((0, 1.0, 0.0), (1, 0.0, 1.0)):
                image = np.zeros((39, 39), np.uint8)
                u, v = (x, y) if turn == 0 else (-y, x)
                image[19 + v, 19 + u] = 1
                byte = describe(image, [[19, 19]], [[c, s]])[0, number // 8]
                assert byte >> (number % 8) & 1 == expected


@pytest.mark.parametrize(
    ("xy", "direction", "told"),
    [
        ([[18, 30]], [[1.0, 0.0]], r"pixel \(18, 30\)"),
        ([[30, 30]], [[1.0, 0.0], [0.0, 1.0]], "direction is of shape"),
        ([[30, 30]], [[np.nan, 0.0]], "direction"),
    ],
)
def test_bad_questions_are_refused(xy: object, direction: object, told: str, wall: Bytes) -> None:
    with pytest.raises(ValueError, match=told):
        describe(wall, xy, direction)  # type: ignore[arg-type]

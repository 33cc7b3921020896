"""The fast module beside plain loops, and both beside closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from vslam_ref.features.freak import book, describe
from vslam_ref.features.freak.description import directions, upright_means
from vslam_ref.features.freak.pair_table import PAIRS
from vslam_ref.features.freak.pattern import CENTRE, HALF, REACH, SYMMETRIC
from vslam_ref.features.freak.sampling import field_means, sums

Bytes = NDArray[np.uint8]
pytestmark = pytest.mark.usefixtures("backend")


def drawn(count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    return rng.uniform([45, 45], [114, 84], (count, 2)), rng.uniform(0.15, 1.9, count)


def test_pattern_and_pairs_are_the_books() -> None:
    """Powers of sqrt 2 by division or by power, and degrees or radians: a few eps of 22 pixels."""
    np.testing.assert_allclose(np.column_stack([CENTRE, HALF]), book.pattern(), atol=1e-13)
    assert len(book.pattern()) == 43
    assert sorted(map(tuple, SYMMETRIC.tolist())) == sorted(book.symmetric_pairs())


def test_means_are_the_books(wall: Bytes) -> None:
    """Both are whole numbers over whole numbers, rounded once: equal but where an edge is rounded apart.

    Places agree to 1e-13 pixels; an edge so near to a half of a 64th is as good as impossible.
    """
    rng = np.random.default_rng(1)
    uv, scale = drawn(30, rng)
    theta = rng.uniform(-np.pi, np.pi, 30)
    unit = np.stack([np.cos(theta), np.sin(theta)], 1)
    found = field_means(sums(wall), uv, scale, unit, CENTRE, HALF)
    for k in range(30):
        assert found[k].tolist() == book.means(wall, *uv[k].tolist(), float(scale[k]), float(theta[k]))


def test_descriptors_and_angles_are_the_books(wall: Bytes) -> None:
    """Angles: 45 terms of size 255 in another order, over a direction longer than 0.01 grey levels."""
    uv, scale = drawn(25, np.random.default_rng(2))
    found = describe(wall, uv, scale)
    bits = np.unpackbits(found.descriptor, axis=1, bitorder="little")
    assert found.kept.tolist() == list(range(25))
    assert bits.shape == (25, 512)
    for k in range(25):
        at = (*uv[k].tolist(), float(scale[k]))
        assert math.hypot(*book.direction(book.means(wall, *at, 0.0))) > 0.01
        assert abs(math.remainder(found.angle[k] - book.angle(wall, *at), 2 * math.pi)) < 1e-9
        assert bits[k].tolist() == book.descriptor(wall, *at, float(found.angle[k]), PAIRS)


def test_a_box_of_one_pixel_interpolates_between_four(wall: Bytes) -> None:
    """At 64ths of a pixel nothing is rounded; SciPy's weights are off by eps of 255."""
    rng = np.random.default_rng(3)
    uv = rng.integers(64 * 2, 64 * 120, (50, 2)) / 64
    one = np.ones(50)
    found = field_means(sums(wall), uv, one, np.tile([1.0, 0.0], (50, 1)), np.zeros((1, 2)), np.array([0.01]))
    expected = map_coordinates(wall.astype(float), [uv[:, 1], uv[:, 0]], order=1)
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-11)


@pytest.mark.parametrize("theta", [0.0, 0.4, 2.0, -2.8, -1.1])
def test_a_slope_has_its_own_direction(theta: float) -> None:
    """The mean of a box in a slope is the slope at its centre, and all 45 pairs together favour no direction.

    The pairs go into themselves by 60 degrees, so sum of |d| u u^T is a multiple of the identity and o lies
    along the slope: its length is 1.3 / 2 times the pairs' mean distance, 11 pixels.  Rounding grey levels
    moves means of boxes of n pixels by about 0.29 / sqrt(n), smallest boxes 4: 45 pairs, twice 0.15 each, are
    0.15 sqrt(2 / 45) = 0.03 of 7 grey levels, 0.005 radians; asked are four of these.
    """
    y, x = np.mgrid[-40:41, -40:41]
    image = np.rint(128 + 1.3 * (math.cos(theta) * x + math.sin(theta) * y)).clip(0, 255).astype(np.uint8)
    found = describe(image, [[40.0, 40.0]])
    assert abs(math.remainder(found.angle[0] - theta, 2 * math.pi)) < 0.02


def test_half_a_turn_of_the_picture_turns_the_angle_and_keeps_the_bits(wall: Bytes) -> None:
    """The pattern goes into itself by half a turn, and so does the rounding of edges: nothing else changes.

    Angles: sums of 45 differences in another order, over directions longer than 0.1 grey levels.  By 90
    degrees a pattern of hexagons does not go into itself.
    """
    turned = np.ascontiguousarray(wall[::-1, ::-1])
    uv = np.random.default_rng(4).uniform([24, 24], [135, 105], (40, 2))
    a, b = describe(wall, uv), describe(turned, np.array(wall.shape[::-1]) - 1 - uv)
    assert np.abs(np.abs(a.angle - b.angle) - np.pi).max() < 1e-10
    np.testing.assert_array_equal(a.descriptor, b.descriptor)


@pytest.mark.parametrize("level", [0, 90, 255])
@pytest.mark.parametrize("scale", [0.2, 1.0, 1.37])
def test_a_constant_patch_has_angle_zero_and_no_bit(level: int, scale: float) -> None:
    found = describe(np.full((90, 90), level, np.uint8), [[44.3, 45.9]], scale)
    assert found.angle.tolist() == [0.0]
    assert not found.descriptor.any()


def test_directions_are_the_mean_over_pairs() -> None:
    rng = np.random.default_rng(5)
    mean = rng.uniform(0, 255, (6, 43))
    unit, _ = directions(mean)
    for k in range(6):
        o = np.array(book.direction(mean[k].tolist()))
        np.testing.assert_allclose(unit[k], o / np.linalg.norm(o), atol=1e-11)


def test_whole_patterns_only(wall: Bytes) -> None:
    """A key point is kept just where its 45 x 45 pixels lie in the picture, less a 64th of a pixel."""
    height, width = wall.shape
    low = REACH - 0.5 + 1 / 64
    at = [[low, 60], [low - 1e-6, 60], [width - 1 - low, 60], [width - 1 - low + 1e-6, 60], [60, low - 1e-6]]
    at += [[60, height - 1 - low], [60, height - 1 - low + 1e-6]]
    assert describe(wall, at).kept.tolist() == [0, 2, 5]
    assert describe(np.zeros((43, 200), np.uint8), [[100, 21]]).kept.tolist() == []
    low += 1e-4  # so that no edge is just at half a 64th
    corner = np.array([[low, low], [width - 1 - low, height - 1 - low]])
    for theta in np.linspace(0, 2 * np.pi, 25):  # no box leaves the table: an index below 0 would wrap
        unit = np.tile([np.cos(theta), np.sin(theta)], (2, 1))
        shown = field_means(sums(wall), corner, np.ones(2), unit, CENTRE, HALF)
        for k in range(2):
            assert shown[k].tolist() == book.means(wall, *corner[k].tolist(), 1.0, float(theta))


def test_no_key_points() -> None:
    found = describe(np.zeros((60, 60), np.uint8), np.zeros((0, 2)))
    assert found.descriptor.shape == (0, 64)
    assert found.kept.shape == found.angle.shape == (0,)
    assert upright_means(sums(np.zeros((5, 5), np.uint8)), np.zeros((0, 2)), np.zeros(0)).shape == (0, 43)


@pytest.mark.parametrize(
    ("uv", "scale", "told"),
    [
        ([[60.0, np.nan]], 1.0, "key point 0 is"),
        ([[60.0, 60.0], [np.inf, 60.0]], 1.0, "key point 1 is"),
        ([[60.0, 60.0]], 0.0, "scale of key point 0 is 0.0"),
        ([[60.0, 60.0]], [-1.0], "scale of key point 0 is -1.0"),
        ([[60.0, 60.0]], [1.0, 1.0], r"scale is of shape \(2,\)"),
        ([60.0, 60.0, 1.0], 1.0, r"uv is of shape \(3,\)"),
    ],
)
def test_bad_key_points_are_refused(uv: object, scale: object, told: str, wall: Bytes) -> None:
    with pytest.raises(ValueError, match=told):
        describe(wall, uv, scale)  # type: ignore[arg-type]


def test_bad_pictures_and_pairs_are_refused(wall: Bytes) -> None:
    with pytest.raises(ValueError, match="image is float64"):
        describe(wall.astype(float), [[60, 60]])
    with pytest.raises(ValueError, match="whole bytes"):
        describe(wall, [[60, 60]], pairs=PAIRS[:9])
    with pytest.raises(ValueError, match="need 0 to 42"):
        describe(wall, [[60, 60]], pairs=np.array([[0, 43]] * 8))

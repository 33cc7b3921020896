"""Exercise 8.1: levels, a corner, a comparison and a refinement, with the mistakes that are usually made."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray

EXERCISE = "08_patch"
Bytes = NDArray[np.uint8]
CIRCLE = [(0, 3), (1, 3), (2, 2), (3, 1), (3, 0), (3, -1), (2, -2), (1, -3)]
CIRCLE += [(-x, -y) for x, y in CIRCLE]


@pytest.mark.parametrize("level", [0, 1, 2, 3])
def test_no_half_pixel_is_lost(answer: ModuleType, level: int) -> None:
    """The first pixel of a level lies in the middle of its 2^l x 2^l pixels: the mean of 0 ... 2^l - 1."""
    size = 2**level
    found = np.asarray(answer.on_level_zero(np.array([[0.0, 3.0]]), level))
    middle = np.mean(np.arange(size))
    if level and np.allclose(found, [[0.0, 3.0 * size]]):
        pytest.fail("2^l x is the corner of a block of pixels; its centre was asked for")
    assert np.allclose(found, [[middle, 3 * size + middle]])


def ring(start: int, length: int, more: int) -> Bytes:
    image = np.full((7, 7), 100, np.uint8)
    for k in range(length):
        x, y = CIRCLE[(start + k) % 16]
        image[3 + y, 3 + x] = 100 + more
    return image


@pytest.mark.parametrize("arc", [9, 10, 12])
@pytest.mark.parametrize("more", [50, -50])
def test_an_arc_counts_wherever_it_begins_and_one_short_never(
    answer: ModuleType, arc: int, more: int
) -> None:
    for start in range(16):
        if not answer.is_corner(ring(start, arc, more), 3, 3, 30, arc):
            pytest.fail(
                f"an arc of {arc} from pixel {start}, {more:+d}: is it closed, and are bytes whole numbers?"
            )
        assert not answer.is_corner(ring(start, arc - 1, more), 3, 3, 30, arc)


def test_the_threshold_itself_is_not_enough_and_signs_do_not_mix(answer: ModuleType) -> None:
    assert answer.is_corner(ring(4, 10, 31), 3, 3, 30, 10)
    assert not answer.is_corner(ring(4, 10, 30), 3, 3, 30, 10)
    mixed = ring(0, 5, 50)
    for x, y in CIRCLE[5:10]:
        mixed[3 + y, 3 + x] = 50
    assert not answer.is_corner(mixed, 3, 3, 30, 10)


def test_the_five_sums_say_what_the_definition_says(answer: ModuleType) -> None:
    """Whole numbers: the definition's own rounding is some 100 eps of the sums."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        a, b = rng.integers(0, 256, (2, 64)).astype(float)
        expected = np.sum(((a - a.mean()) - (b - b.mean())) ** 2)
        found = answer.zmssd(a.sum(), b.sum(), a @ a, b @ b, a @ b, 64)
        assert abs(found - expected) < 1e-9 * 64 * 255**2
        brighter = b + 60
        again = answer.zmssd(a.sum(), brighter.sum(), a @ a, brighter @ brighter, a @ brighter, 64)
        if abs(again - found) > 1:
            pytest.fail("60 grey levels more in one patch change the answer: the means must go")


def waves(shift: tuple[float, float], offset: float = 0.0) -> Bytes:
    x, y = np.meshgrid(np.arange(60.0), np.arange(60.0))
    p, q = x - shift[0], y - shift[1]
    grey = 120 + 45 * np.sin(0.55 * p + 0.3 * q) + 40 * np.cos(0.6 * q - 1)
    return np.rint(grey + offset).astype(np.uint8)


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.4, -0.3), (-0.7, 0.6)])
@pytest.mark.parametrize("offset", [0.0, 30.0])
def test_a_shift_is_found_to_a_twentieth_of_a_pixel(
    answer: ModuleType, shift: tuple[float, float], offset: float
) -> None:
    """Slopes of some 15 grey levels at 36 pixels: rounding (0.4 in both) gives 0.4 / (6 * 15) = 0.005.

    Straight lines between pixels are off by at most (1/8)(0.55^2 45 + 0.3^2 45 + 0.6^2 40) = 4 grey levels,
    where the picture is at an extreme and its slope small: some hundredths of a pixel, 0.02 at this place.
    """
    template = waves((0.0, 0.0))[21:29, 29:37]
    place = np.array([33.0, 25.0])
    u, b = answer.refine(waves(shift, offset), template, place)
    error = np.asarray(u) - place - shift
    if np.hypot(*error) > 0.3 and offset == 0:
        pytest.fail(f"off by {error}: is the step subtracted, and is T[4, 4] the pixel at u?")
    if np.hypot(*error) > 0.05:
        pytest.fail(f"with a picture {offset:g} grey levels brighter, off by {error}")
    assert abs(b - offset) < 1.5

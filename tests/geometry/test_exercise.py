"""Exercise 2.1: a logarithm of rotations that keeps its digits at every angle.

Oracle: Rodrigues' formula in exact arithmetic of its series, rounded once to the matrix that is handed in.
"""

from __future__ import annotations

from types import ModuleType

import mpmath
import numpy as np
import pytest

EXERCISE = "02_logarithm"

AXES = [
    np.array(a) / np.linalg.norm(a)
    for a in ([0.36, -0.48, 0.8], [0, 0, 1], [-1, 0, 0], [1, 1, 0], [-2, 1, 1e-9])
]
TOLERANCE = 32 * np.finfo(float).eps  # of numbers up to pi, from a matrix rounded to eps


def rotation(phi: np.ndarray) -> np.ndarray:
    """Exp(phi) to the last digit."""
    with mpmath.workdps(50):
        x, y, z = (mpmath.mpf(float(v)) for v in phi)
        exact = mpmath.expm(mpmath.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]]))
        return np.array(exact.tolist(), dtype=float)


def found(answer: ModuleType, R: np.ndarray) -> np.ndarray:
    kept = R.copy()
    with np.errstate(all="ignore"):
        phi = answer.log(R)
    assert np.array_equal(R, kept), "the matrix must not be changed"
    assert np.shape(phi) == (3,), f"the result has shape {np.shape(phi)}, need (3,)"
    assert np.isfinite(phi).all(), f"the result is {phi}: is something divided by a sine that vanishes?"
    return np.asarray(phi)


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("angle", [0.3, 1.5, np.pi / 2, 1.7, 2.5])
def test_a_generic_turn(answer: ModuleType, angle: float, axis: np.ndarray) -> None:
    phi = found(answer, rotation(angle * axis))
    assert not np.allclose(phi, -angle * axis, atol=1e-6), (
        "turned the wrong way: R[2, 1] - R[1, 2] is +2 sin a_x"
    )
    half = np.allclose(phi, angle * axis / 2, atol=1e-6) or np.allclose(phi, 2 * angle * axis, atol=1e-6)
    assert not half, "a factor 2: angle or half angle?"
    assert np.abs(phi - angle * axis).max() < TOLERANCE * np.pi, f"{phi}, must be {angle * axis}"


def test_no_turn(answer: ModuleType) -> None:
    assert np.array_equal(found(answer, np.eye(3)), np.zeros(3)), "the identity is a turn by zero"


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-9, 1e-15])
def test_a_tiny_turn_keeps_its_digits(answer: ModuleType, angle: float, axis: np.ndarray) -> None:
    """Relative to the angle: the antisymmetric part of R knows it to eps."""
    phi = found(answer, rotation(angle * axis))
    told = "digits are lost near 0: arccos of the trace cannot tell a small angle; use atan2 with the sine"
    assert np.abs(phi / angle - axis).max() < TOLERANCE, told


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("short", [1e-2, 1e-4, 1e-6, 1e-9])
def test_almost_half_a_turn(answer: ModuleType, short: float, axis: np.ndarray) -> None:
    wanted = (np.pi - short) * axis
    phi = found(answer, rotation(wanted))
    mirrored = np.abs(phi + wanted).max() < 1e-6
    assert not mirrored, "the axis points the wrong way: the antisymmetric part still knows its sign"
    told = "digits lost near pi: there the antisymmetric part vanishes; the symmetric one, 2 a a^T - I, stays"
    assert np.abs(phi - wanted).max() < TOLERANCE * np.pi, f"{told}\n{phi}, must be {wanted}"


@pytest.mark.parametrize("axis", AXES)
def test_half_a_turn(answer: ModuleType, axis: np.ndarray) -> None:
    R = 2 * np.outer(axis, axis) - np.eye(3)
    phi = found(answer, R)
    assert abs(np.linalg.norm(phi) - np.pi) < TOLERANCE * np.pi, "half a turn has the angle pi"
    off = min(np.abs(phi - np.pi * axis).max(), np.abs(phi + np.pi * axis).max())
    assert off < TOLERANCE * np.pi, f"{phi}, must be {np.pi * axis} or its negative"


@pytest.mark.parametrize("seed", range(30))
def test_any_turn(answer: ModuleType, seed: int) -> None:
    """Log is the inverse of the exponential, and never longer than pi."""
    phi = np.random.default_rng(seed).normal(0, 2, 3)
    R = rotation(phi)
    back = found(answer, R)
    assert np.linalg.norm(back) <= np.pi * (1 + 1e-15), "an angle beyond pi: there is a shorter way round"
    assert np.abs(rotation(back) - R).max() < TOLERANCE * np.pi

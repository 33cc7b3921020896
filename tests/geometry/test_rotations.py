"""Rotations of space: half a turn, quaternions, the nearest rotation, and SciPy's opinion."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from vslam_ref.geometry import quaternion, sim3, so3
from vslam_ref.geometry.nearest import nearest_rotation

EPS = float(np.finfo(float).eps)
VECTORS = st.tuples(*[st.floats(-3.6, 3.6)] * 3)


def cube_rotations() -> list[np.ndarray]:
    """The 24 rotations of a cube: turns about every axis that could need a branch of its own."""
    found = []
    for order, signs in product(permutations(range(3)), product((1, -1), repeat=3)):
        R = np.zeros((3, 3))
        R[range(3), order] = signs
        if np.linalg.det(R) > 0:
            found.append(R)
    return found


@pytest.mark.parametrize("R", cube_rotations())
def test_the_rotations_of_a_cube_come_back(R: np.ndarray) -> None:
    assert np.abs(so3.exp(so3.log(R)) - R).max() < 8 * EPS
    assert np.abs(quaternion.matrix(quaternion.from_matrix(R)) - R).max() < 4 * EPS


@pytest.mark.parametrize("short_of_pi", [0.0, 1e-15, 1e-12, 1e-8, 1e-5, 1e-2])
@pytest.mark.parametrize("seed", range(4))
def test_log_near_half_a_turn_finds_axis_and_angle(short_of_pi: float, seed: int) -> None:
    """Both to eps, also where the antisymmetric part of R has lost its direction.  At pi the sign is free."""
    axis = np.random.default_rng(seed).normal(size=3)
    axis /= np.linalg.norm(axis)
    phi = (np.pi - short_of_pi) * axis
    found = so3.log(so3.exp(phi))
    sign = np.sign(found @ phi) if short_of_pi < 1e-14 else 1.0
    assert np.abs(sign * found - phi).max() < 16 * EPS * np.pi


def test_at_half_a_turn_the_first_number_is_positive() -> None:
    for axis in ([0.6, -0.8, 0.0], [0.0, 0.6, -0.8], [0.0, 0.0, 1.0]):
        R = 2 * np.outer(axis, axis) - np.eye(3)  # exactly symmetric
        assert np.abs(so3.log(R) - np.pi * np.array(axis)).max() < 4 * EPS * np.pi


@given(VECTORS)
def test_scipy_agrees(phi: tuple[float, float, float]) -> None:
    theirs = Rotation.from_rotvec(phi)
    R = so3.exp(phi)
    assert np.abs(R - theirs.as_matrix()).max() < 32 * EPS
    q = quaternion.exp(phi)
    assert (
        np.abs(quaternion.canonical(q) - quaternion.canonical(theirs.as_quat(scalar_first=True))).max()
        < 32 * EPS
    )
    if np.linalg.norm(phi) < 3.1:
        assert np.abs(so3.log(R) - phi).max() < 64 * EPS


@given(VECTORS, VECTORS)
def test_quaternions_multiply_as_matrices(a: tuple[float, ...], b: tuple[float, ...]) -> None:
    p, q = quaternion.exp(a), quaternion.exp(b)
    product = quaternion.matrix(p) @ quaternion.matrix(q)
    assert np.abs(quaternion.matrix(quaternion.compose(p, q)) - product).max() < 32 * EPS
    assert np.abs(quaternion.matrix(quaternion.inverse(p)) - quaternion.matrix(p).T).max() == 0.0
    x = np.array([0.3, -2.0, 5.0])
    assert np.abs(quaternion.act(p, x) - quaternion.matrix(p) @ x).max() < 64 * EPS * 5
    assert np.abs(quaternion.log(p) - so3.log(quaternion.matrix(p))).max() < 64 * EPS * np.pi or (
        np.linalg.norm(quaternion.log(p)) > np.pi - 1e-7
    )


def test_quaternion_interpolation_is_that_of_matrices() -> None:
    rng = np.random.default_rng(1)
    p, q = quaternion.random(rng, (20,)), quaternion.random(rng, (20,))
    f = rng.uniform(size=20)
    R = so3.interpolate(quaternion.matrix(p), quaternion.matrix(q), f)
    assert np.abs(quaternion.matrix(quaternion.interpolate(p, q, f)) - R).max() < 64 * EPS
    assert quaternion.identity((2, 3)).shape == (2, 3, 4)


@pytest.mark.parametrize("size", [1e-300, 1e-200, 1.0, 1e200, 1e308])
def test_normalise_survives_its_squares(size: float) -> None:
    q = quaternion.normalise(np.array([0.5, -0.5, 0.5, 0.5]) * size)
    assert np.abs(q - [0.5, -0.5, 0.5, 0.5]).max() < 4 * EPS


@pytest.mark.parametrize("q", [[0.0, 0.0, 0.0, 0.0], [np.nan, 0.0, 0.0, 1.0], [np.inf, 0.0, 0.0, 1.0]])
def test_normalise_refuses_what_is_no_rotation(q: list[float]) -> None:
    with pytest.raises(ValueError, match="zero or not finite"):
        quaternion.normalise(q)


def test_uniform_rotations_have_the_angle_of_the_haar_measure() -> None:
    """Density (1 - cos) / pi on [0, pi]; Kolmogorov-Smirnov, one false alarm in 10 000."""
    angle = np.linalg.norm(so3.log(so3.random(np.random.default_rng(0), (5000,))), axis=-1)
    assert kstest(angle, lambda t: (t - np.sin(t)) / np.pi).pvalue > 1e-4


def davenport(M: np.ndarray) -> np.ndarray:
    """Another way to the nearest rotation: the eigenvector of the largest eigenvalue of a 4 x 4 matrix."""
    K = np.empty((4, 4))
    z = np.array([M[2, 1] - M[1, 2], M[0, 2] - M[2, 0], M[1, 0] - M[0, 1]])
    K[0, 0], K[0, 1:], K[1:, 0] = np.trace(M), z, z
    K[1:, 1:] = M + M.T - np.trace(M) * np.eye(3)
    return quaternion.matrix(np.linalg.eigh(K)[1][:, -1])


@pytest.mark.parametrize("seed", range(20))
def test_nearest_is_davenports(seed: int) -> None:
    """Half of these have a negative determinant.  Error: eps over the gap of eigenvalues, here above 0.02.

    The two orthogonal factors of R are good to some 9 eps each (three reflections of three products), their
    product adds 3, so R^T R to 2 * 21; det R to half of the trace of that, 63, and 9 for the three pivots.
    The trace sums nine products of numbers up to |M|, in two ways.
    """
    M = np.random.default_rng(seed).normal(size=(3, 3))
    found = nearest_rotation(M)
    assert np.abs(found.R - davenport(M)).max() < 1e-13
    assert np.abs(found.R.T @ found.R - np.eye(3)).max() < 42 * EPS
    assert abs(np.linalg.det(found.R) - 1) < 72 * EPS
    assert abs(found.trace - np.trace(found.R.T @ M)) < (2 * 9 + 21) * EPS * np.linalg.norm(M)


@pytest.mark.parametrize(
    "M",
    [
        np.zeros((3, 3)),
        np.diag([1.0, 0.0, 0.0]),  # rank 1: turns about the axis are free
        -np.eye(3),  # every half turn is equally near
        np.diag([3.0, 1.0, -1.0]),
        np.full((3, 3), np.nan),
    ],
)
def test_nearest_refuses_what_has_none(M: np.ndarray) -> None:
    with pytest.raises(ValueError, match="undefined"):
        so3.nearest(M)
    with pytest.raises(ValueError, match="undefined"):
        so3.nearest(np.stack([np.eye(3), M]))


def test_nearest_of_rank_two_is_defined() -> None:
    assert np.abs(so3.nearest(np.diag([2.0, 1.0, 0.0])) - np.eye(3)).max() < 4 * EPS


def test_sim3_refuses_a_scale_that_is_not_positive() -> None:
    with pytest.raises(ValueError, match="must be positive"):
        sim3.from_srt([1.0, 0.0], np.eye(3), np.zeros(3))


@pytest.mark.parametrize("formula", ["arccos", "antisymmetric"])
def test_the_formulas_of_many_programs_lose_half_of_the_digits(formula: str) -> None:
    """Why log goes through the quaternion: what these formulas give is worse by a factor of 10^5 and more.

    The trace is known to half of an ulp below 1, 0.6e-16, which moves the angle by 0.6e-16 / 1e-7.  One angle
    may be lucky, on one machine or another; of twenty the worst is not.
    """
    axis = np.array([0.36, -0.48, 0.8])
    for near in (0.0, np.pi):
        off = 0.0
        for small in 1e-7 * np.linspace(1.0, 2.0, 20):
            angle = abs(near - small)
            R = so3.exp(angle * axis)
            theta = np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1))
            theirs = theta * axis if formula == "arccos" else angle * so3.vee(R) / np.sin(angle)
            assert np.abs(so3.log(R) - angle * axis).max() / angle < 4 * EPS
            off = max(off, np.abs(theirs - angle * axis).max() / angle)
        if formula == "arccos" or near > 0.0:
            assert off > 1e5 * EPS

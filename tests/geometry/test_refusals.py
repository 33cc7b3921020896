"""What is no rotation is refused by name; rounded digits pass; the poles of an inverse are named."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from vslam_ref.geometry import orthonormal, quaternion, se2, se3, sim3, so2, so3

EPS = float(np.finfo(float).eps)
SHEAR = np.array([[1.0, 0.3, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def motion(block: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = block, [1.0, 2.0, 3.0]
    return T


OF_SPACE: dict[str, Callable[..., Any]] = {
    "so3": so3.log,
    "quaternion": quaternion.from_matrix,
    "se3": lambda R, **flags: se3.log(motion(R), **flags),
    "sim3": lambda R, **flags: sim3.log(motion(R), **flags),
}
of_space = pytest.mark.parametrize("name", OF_SPACE)


@of_space
def test_reflections_are_refused_by_name(name: str) -> None:
    rng = np.random.default_rng(1)
    for R in (np.diag([1.0, 1.0, -1.0]), -np.eye(3), so3.random(rng) @ np.diag([-1.0, 1.0, 1.0])):
        with pytest.raises(ValueError, match=r"is a reflection, no rotation: its determinant is -1"):
            OF_SPACE[name](R)


@of_space
@pytest.mark.parametrize("M", [SHEAR, np.diag([1.0, 1.0, 0.5]), np.ones((3, 3)), np.diag([1.0, 1.0, 0.0])])
def test_what_is_far_from_orthonormal_is_refused(name: str, M: np.ndarray) -> None:
    with pytest.raises(ValueError, match=r"no rotation: R\^T R is .* off the identity"):
        OF_SPACE[name](M)


def test_a_scaled_rotation_is_a_similarity_and_no_rotation() -> None:
    R = so3.exp([0.3, -0.2, 0.5])
    for name in ("so3", "quaternion", "se3"):
        for scale in (2.0, 0.5, 1.01, -3.0):
            with pytest.raises(ValueError, match=r"is no rotation: R\^T R is"):
                OF_SPACE[name](scale * R)
    np.testing.assert_allclose(sim3.log(motion(2.0 * R))[3:], [0.3, -0.2, 0.5, np.log(2.0)], atol=8 * EPS)
    with pytest.raises(ValueError, match="its scale is zero"):
        sim3.log(motion(np.zeros((3, 3))))


@of_space
def test_numbers_that_are_not_finite_are_refused(name: str) -> None:
    for bad in (np.nan, np.inf):
        M = np.eye(3)
        M[1, 2] = bad
        with pytest.raises(ValueError, match="not finite"), np.errstate(invalid="ignore"):
            OF_SPACE[name](M)


def test_turns_of_the_plane_are_checked_too() -> None:
    with pytest.raises(ValueError, match="R is a reflection"):
        so2.log([[1.0, 0.0], [0.0, -1.0]])
    with pytest.raises(ValueError, match="R is no rotation"):
        so2.log([[2.0, 0.0], [0.0, 2.0]])
    assert so2.log([[2.0, -0.1], [0.1, 2.0]], project=True) == pytest.approx(np.arctan2(0.2, 4.0), abs=EPS)
    with pytest.raises(ValueError, match="nearest rotation undefined"):
        so2.log(np.zeros((2, 2)), project=True)
    assert se2.log([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).shape == (3, 3)  # three poses


@pytest.mark.parametrize("count", [1, 5, 400])
def test_the_first_bad_one_of_a_batch_is_named(count: int) -> None:
    """Few are checked by matrix products, many entry by entry: both must see it."""
    R = so3.random(np.random.default_rng(2), (count, 3))
    k = count - 1
    R[k, 1] = R[k, 1] @ np.diag([1.0, -1.0, 1.0])
    with pytest.raises(ValueError, match=rf"^R\[{k}, 1\] is a reflection"):
        so3.log(R)
    R[k, 1] = SHEAR
    with pytest.raises(ValueError, match=rf"^R\[{k}, 1\] is no rotation"):
        quaternion.from_matrix(R)
    turns = so2.random(np.random.default_rng(3), (count,))
    turns[k] = [[0.0, 1.0], [1.0, 0.0]]
    with pytest.raises(ValueError, match=rf"R\[{k}\] is a reflection"):
        so2.log(turns)


def test_both_ways_to_check_agree() -> None:
    rng = np.random.default_rng(4)
    for n in (2, 3):
        M = rng.normal(size=(50, 4, n, n))
        for few, many in zip(orthonormal._by_matrices(M), orthonormal._by_entries(M), strict=True):
            np.testing.assert_allclose(few, many, rtol=0, atol=64 * EPS * 30)


def test_no_matrix_at_all_is_no_mistake() -> None:
    assert so3.log(np.zeros((0, 3, 3))).shape == (0, 3)
    assert so2.log(np.zeros((0, 2, 2))).shape == (0,)
    assert se3.log(np.zeros((0, 4, 4))).shape == (0, 6)


@pytest.mark.parametrize("decimals", [3, 4, 5, 6])
def test_rounded_digits_pass(decimals: int) -> None:
    """The bound is derived: entries off by h = 10^-d / 2 move the rotation vector by sqrt(3) h and some."""
    R = so3.random(np.random.default_rng(decimals), (2000,))
    rounded, h = R.round(decimals), 0.5 * 10.0**-decimals
    off = np.abs(np.swapaxes(rounded, 1, 2) @ rounded - np.eye(3)).max()
    assert off <= 2 * np.sqrt(3) * h * (1 + 2 * h)
    assert np.linalg.norm(so3.log(np.swapaxes(R, 1, 2) @ so3.nearest(rounded)), axis=1).max() < 4 * h
    product = rounded[:-1] @ np.swapaxes(rounded[1:], 1, 2)
    for group, M in ((so3, rounded), (so3, product)):
        group.log(M)
    quaternion.from_matrix(product)
    se3.log(np.array([motion(M) for M in product[:50]]))
    sim3.log(np.array([motion(M) for M in product[:50]]))
    so2.log(so2.random(np.random.default_rng(0), (500,)).round(decimals))
    so3.log(R.astype(np.float32))


@of_space
def test_project_takes_the_nearest(name: str) -> None:
    """The oracle is the polar decomposition by SciPy."""
    from scipy.linalg import polar

    M = so3.exp([0.4, 1.2, -0.3]) @ SHEAR * 1.3
    U = polar(M)[0]
    found, want = OF_SPACE[name](M, project=True), OF_SPACE[name](U)
    if name == "sim3":
        assert found[6] == pytest.approx(np.log(np.trace(U.T @ M) / 3), abs=1e-12)
        found, want = found[3:6], want[3:6]
    np.testing.assert_allclose(found, want, atol=1e-12)
    with pytest.raises(ValueError, match="nearest rotation undefined"):
        OF_SPACE[name](np.diag([1.0, 1.0, -1.0]), project=True)


def test_the_unchecked_functions_give_the_same_numbers() -> None:
    T = se3.random(np.random.default_rng(5), (20,))
    assert (so3.log_of_rotation(T[:, :3, :3]) == so3.log(T[:, :3, :3])).all()
    assert (se3.log_of_motion(T) == se3.log(T)).all()
    assert (quaternion.of_rotation(T[:, :3, :3]) == quaternion.from_matrix(T[:, :3, :3])).all()


AXIS = np.array([0.36, -0.48, 0.8])
INVERSES: dict[str, Callable[[float], Any]] = {
    "so3": lambda angle: so3.left_jacobian_inverse(angle * AXIS),
    "se3": lambda angle: se3.left_jacobian_inverse([1.0, 2.0, 3.0, *(angle * AXIS)]),
    "sim3": lambda angle: sim3.left_jacobian_inverse([1.0, 2.0, 3.0, *(angle * AXIS), 0.4]),
    "sim3.w": lambda angle: sim3.w_matrix_inverse(angle * AXIS, 0.0),
    "se2": lambda angle: se2.left_jacobian_inverse([1.0, 2.0, angle]),
}


@pytest.mark.parametrize("name", INVERSES)
@pytest.mark.parametrize("turns", [1, 2, 5, 40])
def test_the_poles_of_the_inverse_are_named(name: str, turns: int) -> None:
    pole = 2 * np.pi * turns
    for angle in (pole, -pole, pole * (1 + 4 * EPS), pole * (1 - 4 * EPS), pole * (1 + 1e-12)):
        with pytest.raises(ValueError, match="no inverse at multiples of 2 pi: the angle"):
            INVERSES[name](angle)


@pytest.mark.parametrize("turns", [1, 2, 5])
def test_near_the_poles_the_inverse_keeps_what_its_condition_leaves(turns: int) -> None:
    """Exact at 40 digits: V^-1 has the eigenvalue 1 and a pair of length theta / (2 sin(theta / 2))."""
    import mpmath

    mpmath.mp.dps = 40
    for off in (1e-9, -1e-6, 1e-3):
        angle = 2 * np.pi * turns + off
        found = so3.left_jacobian_inverse([0.0, 0.0, angle])
        half = mpmath.mpf(angle) / 2
        h = float(half * mpmath.cot(half))
        want = np.array([[h, angle / 2, 0.0], [-angle / 2, h, 0.0], [0.0, 0.0, 1.0]])
        assert np.abs(found - want).max() < 16 * EPS * abs(angle / off) * np.abs(want).max()


def test_one_pole_in_a_batch_is_enough_and_between_poles_all_is_well() -> None:
    phi = np.array([[0.0, 0.0, 1.0], [0.0, 2 * np.pi, 0.0]])
    with pytest.raises(ValueError, match=r"6\.28"):
        so3.left_jacobian_inverse(phi)
    for angle in (0.0, 3.0, 7.5, 11.0, 100.0, 2000.0):
        product = so3.left_jacobian_inverse(angle * AXIS) @ so3.left_jacobian(angle * AXIS)
        assert np.abs(product - np.eye(3)).max() < 64 * EPS * max(1.0, angle) ** 2
        product = se2.left_jacobian_inverse([1.0, 2.0, angle]) @ se2.left_jacobian([1.0, 2.0, angle])
        assert np.abs(product - np.eye(3)).max() < 64 * EPS * max(1.0, angle) ** 2
    assert np.isfinite(se2.left_jacobian_inverse([1.0, 2.0, np.pi])).all()
    # a scale takes W's pole away
    W = sim3.w_matrix_inverse(2 * np.pi * AXIS, 0.5) @ sim3.w_matrix(2 * np.pi * AXIS, 0.5)
    assert np.abs(W - np.eye(3)).max() < 256 * EPS

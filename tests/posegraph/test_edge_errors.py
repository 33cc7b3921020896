"""The error of an edge: against closed forms, matrix logarithms, and what both conventions share."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import logm
from scipy.spatial.transform import Rotation
from small_graphs import SPACES

from vslam_ref.estimation.posegraph.errors import (
    CONVENTIONS,
    Convention,
    edge_error,
    edge_error_with_jacobians,
)
from vslam_ref.estimation.posegraph.spaces import GROUPS, Space, moved

EPS = float(np.finfo(float).eps)


def triple(space: Space, seed: int, size: float = 0.4) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two poses and a measurement whose error is about ``size``."""
    group, rng = GROUPS[space], np.random.default_rng(seed)
    a, b = group.random(rng, (5,)), group.random(rng, (5,))
    off = group.exp(size * rng.standard_normal((5, group.DOF)))
    return a, b, group.compose(group.between(a, b), off)


@pytest.mark.parametrize("space", SPACES)
def test_the_logarithm_is_that_of_matrices(space: Space) -> None:
    """Against SciPy's matrix logarithm of Z^-1 A^-1 B, all by general matrix inverses."""
    group = GROUPS[space]
    a, b, z = triple(space, 1)
    A, B, Z = (np.asarray(group.matrix(x)) for x in (a, b, z))
    D = np.linalg.inv(Z) @ np.linalg.inv(A) @ B
    wanted = np.array([group.vee(np.real(logm(M))) for M in D])
    e = edge_error(a, b, z, space=space, convention="log")
    np.testing.assert_allclose(e, wanted, atol=1e-12)  # logm's own accuracy: about 1e4 eps here


def test_g2o_in_the_plane_is_a_rotated_difference_and_an_angle() -> None:
    """R_z^T (R_a^T (t_b - t_a) - t_z) and theta_b - theta_a - theta_z, written out."""
    a, b, z = triple("se2", 2)
    for (ax, ay, at), (bx, by, bt), (zx, zy, zt), e in zip(
        a, b, z, edge_error(a, b, z, space="se2", convention="g2o"), strict=True
    ):
        x = np.cos(at) * (bx - ax) + np.sin(at) * (by - ay) - zx
        y = -np.sin(at) * (bx - ax) + np.cos(at) * (by - ay) - zy
        turn = (bt - at - zt + np.pi) % (2 * np.pi) - np.pi
        wanted = [np.cos(zt) * x + np.sin(zt) * y, -np.sin(zt) * x + np.cos(zt) * y, turn]
        np.testing.assert_allclose(e, wanted, atol=64 * EPS)


def test_g2o_in_space_is_a_translation_and_half_a_quaternion() -> None:
    """Quaternion by SciPy, with its real part not negative."""
    a, b, z = triple("se3", 3, size=0.9)
    D = np.linalg.inv(z) @ np.linalg.inv(a) @ b
    q = Rotation.from_matrix(D[:, :3, :3]).as_quat(canonical=True)
    wanted = np.concatenate([D[:, :3, 3], q[:, :3]], 1)
    np.testing.assert_allclose(edge_error(a, b, z, space="se3", convention="g2o"), wanted, atol=64 * EPS)


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("space", SPACES)
def test_an_edge_that_agrees_has_no_error(space: Space, convention: Convention) -> None:
    group = GROUPS[space]
    a, b, _ = triple(space, 4)
    e = edge_error(a, b, group.between(a, b), space=space, convention=convention)
    np.testing.assert_allclose(e, 0.0, atol=64 * EPS)


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("space", SPACES)
def test_moving_both_ends_alike_changes_nothing(space: Space, convention: Convention) -> None:
    """A step of the whole world, Exp(w) on the left of both poses: the gauge."""
    group, rng = GROUPS[space], np.random.default_rng(5)
    a, b, z = triple(space, 6)
    world = group.exp(rng.standard_normal(group.DOF))
    here = edge_error(a, b, z, space=space, convention=convention)
    there = edge_error(
        group.compose(world, a), group.compose(world, b), z, space=space, convention=convention
    )
    np.testing.assert_allclose(there, here, atol=1e-13)
    # the same to first order: on the right that step is Ad(X^-1) w
    J = edge_error_with_jacobians(a, b, z, space=space, convention=convention)
    gauge = J.J_tail @ group.adjoint(group.inverse(a)) + J.J_head @ group.adjoint(group.inverse(b))
    np.testing.assert_allclose(gauge, 0.0, atol=1e-12)


@pytest.mark.parametrize("space", SPACES)
def test_noise_on_the_right_of_a_measurement_comes_back_as_the_error(space: Space) -> None:
    """Z = X_i^-1 X_j Exp(eta) gives e = -eta exactly: the convention that the worlds use."""
    group, rng = GROUPS[space], np.random.default_rng(7)
    a, b, _ = triple(space, 8)
    eta = 0.3 * rng.standard_normal((5, group.DOF))
    z = group.compose(group.between(a, b), group.exp(eta))
    np.testing.assert_allclose(edge_error(a, b, z, space=space, convention="log"), -eta, atol=1e-13)


def test_a_step_is_on_the_right() -> None:
    """Ahead, for a body that looks along y, is y in the world."""
    there = moved("se2", np.array([5.0, 5.0, np.pi / 2]), np.array([1.0, 0.0, 0.0]))
    np.testing.assert_allclose(there, [5.0, 6.0, np.pi / 2], atol=4 * EPS)

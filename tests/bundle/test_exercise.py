"""Exercise 6.1: points first, against one dense system, at a size where there is no such system."""

from __future__ import annotations

import tracemalloc
from types import ModuleType
from typing import NamedTuple

import numpy as np
import pytest

EXERCISE = "06_schur"


class Blocks(NamedTuple):
    B: np.ndarray
    C: np.ndarray
    W: np.ndarray
    view: np.ndarray
    point: np.ndarray
    g_view: np.ndarray
    g_point: np.ndarray


def blocks(views: int, points: int, seed: int = 6, *, share: float = 0.6) -> Blocks:
    """Of a made-up Jacobian, two rows an observation, damped; no block is its own transpose but B and C."""
    rng = np.random.default_rng(seed)
    view, point = np.nonzero(rng.uniform(size=(views, points)) < share)
    order = rng.permutation(len(view))
    view, point = view[order], point[order]
    J_view = rng.standard_normal((len(view), 2, 6))
    J_point, r = rng.standard_normal((len(view), 2, 3)), rng.standard_normal((len(view), 2))
    B, C = np.tile(np.eye(6), (views, 1, 1)), np.tile(0.5 * np.eye(3), (points, 1, 1))
    g_view, g_point = np.zeros((views, 6)), np.zeros((points, 3))
    np.add.at(B, view, np.einsum("nab,nac->nbc", J_view, J_view))
    np.add.at(C, point, np.einsum("nab,nac->nbc", J_point, J_point))
    np.add.at(g_view, view, np.einsum("nab,na->nb", J_view, r))
    np.add.at(g_point, point, np.einsum("nab,na->nb", J_point, r))
    return Blocks(B, C, np.einsum("nab,nac->nbc", J_view, J_point), view, point, g_view, g_point)


def dense(b: Blocks) -> tuple[np.ndarray, np.ndarray]:
    """H and -g as one matrix and one vector, views first."""
    V, N = len(b.B), len(b.C)
    H = np.zeros((6 * V + 3 * N, 6 * V + 3 * N))
    for i, block in enumerate(b.B):
        H[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = block
    for j, block in enumerate(b.C):
        at = 6 * V + 3 * j
        H[at : at + 3, at : at + 3] = block
    for block, i, j in zip(b.W, b.view, b.point, strict=True):
        at = 6 * V + 3 * j
        H[6 * i : 6 * i + 6, at : at + 3] = block
        H[at : at + 3, 6 * i : 6 * i + 6] = block.T
    return H, -np.concatenate([b.g_view.ravel(), b.g_point.ravel()])


def reduced(answer: ModuleType, b: Blocks) -> tuple[np.ndarray, np.ndarray]:
    S, rhs = answer.reduced_system(*(part.copy() for part in b))
    size = 6 * len(b.B)
    assert np.shape(S) == (size, size), f"S has the shape {np.shape(S)}: need {(size, size)}"
    assert np.shape(rhs) == (size,), f"rhs has the shape {np.shape(rhs)}: need {(size,)}"
    return S, rhs


def test_the_reduced_system_is_the_schur_complement(answer: ModuleType) -> None:
    b = blocks(4, 9)
    S, rhs = reduced(answer, b)
    H, minus_g = dense(b)
    k = 24
    inverse = np.linalg.inv(H[k:, k:])
    np.testing.assert_allclose(S, S.T, atol=1e-12 * np.abs(S).max(), err_msg="S is symmetric")
    # products of a few blocks with a condition of about 100: 1e-10 leaves four digits for rounding
    np.testing.assert_allclose(
        S, H[:k, :k] - H[:k, k:] @ inverse @ H[k:, :k], atol=1e-10 * np.abs(H).max(),
        err_msg="S = B - W C^-1 W^T: every two views that share a point meet",
    )  # fmt: skip
    np.testing.assert_allclose(
        rhs, minus_g[:k] - H[:k, k:] @ inverse @ minus_g[k:], atol=1e-10 * np.abs(minus_g).max(),
        err_msg="rhs = -g_view + W C^-1 g_point",
    )  # fmt: skip


@pytest.mark.parametrize(("views", "points"), [(4, 9), (1, 5), (6, 40)])
def test_both_steps_solve_the_whole_system(answer: ModuleType, views: int, points: int) -> None:
    b = blocks(views, points)
    S, rhs = reduced(answer, b)
    steps = np.linalg.solve(S, rhs).reshape(-1, 6)
    moved = answer.point_steps(b.C, b.W, b.view, b.point, b.g_point, steps)
    assert np.shape(moved) == (points, 3), f"steps of the points have the shape {np.shape(moved)}"
    H, minus_g = dense(b)
    whole = np.linalg.solve(H, minus_g)
    np.testing.assert_allclose(steps.ravel(), whole[: 6 * views], atol=1e-9, err_msg="steps of the views")
    np.testing.assert_allclose(moved.ravel(), whole[6 * views :], atol=1e-9, err_msg="steps of the points")


def test_back_substitution_for_any_steps(answer: ModuleType) -> None:
    """Also for steps that solve nothing: the lower row, and no other, must hold."""
    b = blocks(3, 7, seed=1)
    H, minus_g = dense(b)
    steps = np.random.default_rng(2).standard_normal((3, 6))
    moved = answer.point_steps(b.C, b.W, b.view, b.point, b.g_point, steps)
    left = H[18:, :18] @ steps.ravel() + H[18:, 18:] @ moved.ravel()
    np.testing.assert_allclose(
        left, minus_g[18:], atol=1e-9, err_msg="W^T step_view + C step_point = -g_point"
    )


def test_points_that_nobody_sees_stand_alone(answer: ModuleType) -> None:
    b = blocks(3, 12, seed=3, share=0.15)
    unseen = np.setdiff1d(np.arange(12), b.point)
    assert len(unseen), "the blocks should leave some points unseen"
    S, rhs = reduced(answer, b)
    H, minus_g = dense(b)
    steps = np.linalg.solve(S, rhs)
    np.testing.assert_allclose(steps, np.linalg.solve(H, minus_g)[:18], atol=1e-9)
    moved = answer.point_steps(b.C, b.W, b.view, b.point, b.g_point, steps.reshape(-1, 6))
    np.testing.assert_allclose(moved[unseen], 0.0, atol=1e-15, err_msg="no observation, no gradient, no step")


def test_the_order_of_observations_means_nothing(answer: ModuleType) -> None:
    b = blocks(4, 9)
    order = np.argsort(b.view, kind="stable")
    sorted_ = b._replace(W=b.W[order], view=b.view[order], point=b.point[order])
    for one, other in zip(reduced(answer, b), reduced(answer, sorted_), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-10)


def test_what_is_given_stays_as_it_is(answer: ModuleType) -> None:
    b = blocks(3, 5)
    kept = Blocks(*(part.copy() for part in b))
    answer.reduced_system(*b)
    answer.point_steps(b.C, b.W, b.view, b.point, b.g_point, np.ones((3, 6)))
    for name, before, after in zip(Blocks._fields, kept, b, strict=True):
        np.testing.assert_array_equal(after, before, err_msg=f"{name} was changed")


def test_thousands_of_points_need_little_memory(answer: ModuleType) -> None:
    """4000 points: C as one matrix has 1.15 GB, W as one 18 MB.  The blocks have 9 MB."""
    b = blocks(15, 4000, share=0.4)
    tracemalloc.start()
    S, rhs = reduced(answer, b)
    steps = np.linalg.solve(S, rhs).reshape(-1, 6)
    moved = answer.point_steps(b.C, b.W, b.view, b.point, b.g_point, steps)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 200e6, f"{peak / 1e6:.0f} MB at the peak: C is block diagonal, never build it as one matrix"
    # the lower row for every point, without the matrix
    left = np.einsum("nij,nj->ni", b.C, moved)
    np.add.at(left, b.point, np.einsum("nij,ni->nj", b.W, steps[b.view]))
    np.testing.assert_allclose(left, -b.g_point, atol=1e-8)
    # and the upper one
    left = np.einsum("nij,nj->ni", b.B, steps)
    np.add.at(left, b.view, np.einsum("nij,nj->ni", b.W, moved[b.point]))
    np.testing.assert_allclose(left, -b.g_view, atol=1e-8 * np.abs(b.g_view).max())

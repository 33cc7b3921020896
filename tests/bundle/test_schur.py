"""The blocks and the Schur complement against the dense normal matrix of the whole problem."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.estimation.bundle import BundleProblem, schur
from vslam_ref.estimation.bundle import reduced_system as rs
from vslam_ref.estimation.bundle.normal import normal_equations
from vslam_ref.estimation.bundle.structure import Structure, structure

from .conftest import dense_system, hold, make

SETTINGS = {
    "pinhole": {},
    "own lenses": {"sets": 5, "intrinsics": ("f", "cx")},
    "shared lens": {"intrinsics": ("f", "cy")},
    "three lenses": {"sets": 3, "intrinsics": ("f", "cy")},
    "covariances": {"with_cov": True, "intrinsics": ("f",)},
}


def dense_columns(problem: BundleProblem, table: Structure) -> tuple[np.ndarray, np.ndarray]:
    """For each reduced column, its column in the dense Jacobian; and the columns of the sorted points."""
    system = dense_system(problem)
    V, q, L = system["views"], system["q"], system["lenses"]
    at = np.empty(table.size, dtype=int)
    for i in range(V):
        own = [6 * i + a for a in range(6)] + [6 * V + q * problem.lens_of_view[i] + c for c in range(q)]
        for local, column in enumerate(table.columns[i]):
            if column < table.size:
                at[column] = own[local]
    points = (6 * V + q * L + 3 * table.point_order[:, None] + np.arange(3)).ravel()
    return at, points


@pytest.mark.parametrize("name", SETTINGS)
@pytest.mark.parametrize("held", [[], [1], [0, 3]])
def test_step_solves_the_whole_damped_system(name: str, held: list[int], rng: np.random.Generator) -> None:
    """S, its right side and both steps, against elimination by dense inverses.

    Weights and damping differ everywhere.  Tolerance: condition of the damped system (computed) times eps.
    """
    problem, truth = make(rng, "radtan", views=5, points=9, **SETTINGS[name])
    problem = hold(problem, held, truth)
    free = dataclasses.replace(problem.free, point=np.arange(9) != 4)
    problem = dataclasses.replace(problem, free=free)
    weights = rng.uniform(0.2, 1.0, len(problem.seen))
    table = structure(problem)
    at, point_columns = dense_columns(problem, table)
    system = dense_system(problem, weights)
    H, g = system["J"].T @ system["J"], system["J"].T @ system["r"]
    extra_view, extra_point = rng.uniform(1, 2, table.size), rng.uniform(1, 2, (9, 3))
    moving = np.repeat(table.free_point, 3)
    both = np.concatenate([at, point_columns[moving]])
    damped = H[np.ix_(both, both)] + np.diag(np.concatenate([extra_view, extra_point.ravel()[moving]]))
    want = np.linalg.solve(damped, -g[both])
    D = table.size
    inverse = np.linalg.inv(damped[D:, D:])
    S_want = damped[:D, :D] - damped[:D, D:] @ inverse @ damped[D:, :D]

    normal = normal_equations(
        problem.model, table.state(problem), table, weights[table.order], problem.free.intrinsics
    )
    M = schur.point_factor(normal.C, extra_point, table.free_point)
    S, rhs = schur.reduce(normal, M, extra_view, table)
    tolerance = 1e-15 * np.linalg.cond(damped)
    assert np.abs(np.tril(S - S_want)).max() <= tolerance * np.abs(S_want).max()
    factor = rs.factor(S, table.border, table.bandwidth, "dense")
    assert factor is not None
    step = factor.solve(rhs)
    view_step = np.append(step, 0.0)[table.columns]
    point_step = schur.point_steps(normal.W, M, normal.g_point, view_step, table.links.view, table.offsets)
    assert np.abs(step - want[:D]).max() <= tolerance * np.abs(want).max()
    assert np.abs(point_step.ravel()[moving] - want[D:]).max() <= tolerance * np.abs(want).max()
    assert not point_step[~table.free_point].any()
    diagonal = schur.diagonals(normal, table)
    assert diagonal.view == pytest.approx(np.diag(H)[at], rel=1e-12)
    assert diagonal.point.ravel()[moving] == pytest.approx(np.diag(H)[point_columns][moving], rel=1e-12)


def test_point_factor_is_the_root_of_the_inverse(rng: np.random.Generator) -> None:
    """M M^T (C + extra) = I to the condition; upper triangular; zero where singular or held."""
    J = rng.standard_normal((50, 6, 3)) * np.array([1.0, 10.0, 0.1])
    C, extra = np.swapaxes(J, 1, 2) @ J, rng.uniform(0, 1, (50, 3))
    M = schur.point_factor(C, extra, np.arange(50) != 7)
    damped = C + extra[:, :, None] * np.eye(3)
    off = np.abs(M @ np.swapaxes(M, 1, 2) @ damped - np.eye(3)).max((1, 2))
    assert (off[np.arange(50) != 7] < 1e-15 * np.linalg.cond(damped)[np.arange(50) != 7]).all()
    assert not np.tril(M, -1).any()
    assert not M[7].any()
    flat = np.array([[1.0, 2.0, 3.0]]).T @ np.array([[1.0, 2.0, 3.0]])
    assert not schur.point_factor(flat[None], np.zeros((1, 3)), np.ones(1, dtype=bool)).any()


@pytest.mark.parametrize("border", [0, 5])
@pytest.mark.parametrize("columns", [(), (3,)])
def test_banded_equals_dense(border: int, columns: tuple[int, ...], rng: np.random.Generator) -> None:
    """A random banded matrix with a full border; one and several right sides."""
    n, w = 40, 6
    A = np.triu(np.tril(rng.standard_normal((n, n)), w), -w)
    S = np.zeros((n + border, n + border))
    S[:n, :n] = np.triu(np.tril(A @ A.T, w), -w) + 200 * np.eye(n)
    S[n:, :n] = rng.standard_normal((border, n))
    S[:n, n:] = S[n:, :n].T
    S[n:, n:] = 300 * np.eye(border)
    rhs = rng.standard_normal((n + border, *columns))
    want = np.linalg.solve(S, rhs)
    junk = np.tril(S) + np.triu(rng.standard_normal(S.shape), 1)  # only the lower triangle counts
    for method in ("dense", "banded"):
        factor = rs.factor(junk.copy(), n, w, method)
        assert factor is not None
        assert np.abs(factor.solve(rhs) - want).max() < 1e-13
    indefinite = S - 500 * np.eye(n + border)
    assert rs.factor(indefinite, n, w, "dense") is None
    assert rs.factor(indefinite, n, w, "banded") is None


def test_band_holds_what_it_says(rng: np.random.Generator) -> None:
    """A chain of views in random order: after renumbering no entry lies outside the announced band."""
    problem, _ = make(rng, views=24, points=120, seen_by=3, perturb=0.0)
    shuffled = rng.permutation(24)
    T = problem.scene.T_cam_world[np.argsort(shuffled)]
    seen = dataclasses.replace(problem.seen, view=shuffled[problem.seen.view])
    scene = dataclasses.replace(problem.scene, T_cam_world=T)
    problem = dataclasses.replace(problem, scene=scene, seen=seen, lens_of_view=np.zeros(24, dtype=int))
    table = structure(problem)
    normal = normal_equations(
        problem.model, table.state(problem), table, np.ones(len(seen)), problem.free.intrinsics
    )
    M = schur.point_factor(normal.C, np.ones((120, 3)), table.free_point)
    S, _ = schur.reduce(normal, M, np.ones(table.size), table)
    row, column = np.nonzero(np.tril(S))
    assert (row - column).max() == table.bandwidth == 17  # three views of six columns
    assert rs.choose(table.size, table.border, table.bandwidth) == "banded"

"""Fronts: a tree that adds up, and a solution that is the factor's, with either backend."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csc_array
from small_graphs import random_graph

from vslam_ref import _kernels
from vslam_ref.estimation.posegraph.fronts import Fronts, make_fronts, solve_in_order
from vslam_ref.estimation.posegraph.pattern import make_pattern
from vslam_ref.estimation.posegraph.system import GraphProblem


def graphs(n: int, loops: list[tuple[int, int]]) -> tuple[np.ndarray, np.ndarray]:
    ends = np.array([(i, i + 1) for i in range(n - 1)] + [(i % n, j % n) for i, j in loops])
    ends = ends[ends[:, 0] != ends[:, 1]]
    return ends[:, 0], ends[:, 1]


def rows_of(fronts: Fronts, s: int) -> np.ndarray:
    return fronts.rows[fronts.begin[s] : fronts.begin[s + 1]]


def require_a_tree(fronts: Fronts, dense: np.ndarray | None = None) -> None:
    """Every front has the rows of its columns in a dense factor; what is left over fits into the parent."""
    waiting: list[np.ndarray] = []
    for s in range(len(fronts.first) - 1):
        first, last, rows = fronts.first[s], fronts.first[s + 1], rows_of(fronts, s)
        assert rows[: last - first].tolist() == list(range(first, last))
        if dense is not None:
            for c in range(first, last):
                assert np.flatnonzero(np.abs(dense[:, c]) > 0).tolist() == rows[c - first :].tolist()
        for _ in range(fronts.children[s]):
            left = waiting.pop()
            assert left[0] in range(first, last)
            assert set(left.tolist()) <= set(rows.tolist())
        if len(rows) > last - first:
            waiting.append(rows[last - first :])
    assert not waiting


@settings(max_examples=30, deadline=None)
@given(n=st.integers(2, 14), loops=st.lists(st.tuples(st.integers(0, 13), st.integers(0, 13)), max_size=12))
def test_fronts_are_those_of_a_dense_factor(n: int, loops: list[tuple[int, int]]) -> None:
    """A matrix with negative entries off the diagonal has no entry that cancels in its factor."""
    tail, head = graphs(n, loops)
    pattern = make_pattern(n, tail, head, np.arange(n) == 0, 1)
    A = pattern.matrix(np.ones((len(tail), 1, 1)), -np.ones((len(tail), 1, 1)))
    require_a_tree(pattern.ordering.fronts, np.linalg.cholesky(A.toarray()))


def test_a_long_chain_has_all_entries() -> None:
    """4000 nodes, joined at their ends: entries of the factor would underflow in a matrix too definite."""
    n = 4000
    tail, head = graphs(n, [(0, n - 1), (7, n - 2)])
    fronts = make_pattern(n, tail, head, np.arange(n) == n // 2, 3).ordering.fronts
    require_a_tree(fronts)
    assert fronts.first[-1] == n - 1


def test_siblings_join_their_parent_in_any_order() -> None:
    """Columns 0 and 1 both reach 2; whichever comes first, both are its children."""
    post, fronts = make_fronts(np.array([0, 2, 4, 5]), np.array([0, 2, 1, 2, 2]))
    assert sorted(post[:2].tolist()) == [0, 1]
    assert fronts.children.sum() == len(fronts.first) - 2


@pytest.mark.parametrize("backend", _kernels.available())
def test_a_solution_solves(backend: str, space: str) -> None:
    """Against NumPy's dense solution: both are backward stable, so they differ by eps times the condition."""
    graph = random_graph(space, n=60, loops=70)  # type: ignore[arg-type]
    problem = GraphProblem(graph)
    model = problem.linearise(problem.at(graph.T_world))
    assert model is not None
    A, b = model.matrix, model.gradient
    with _kernels.use_backend(backend):
        x = solve_in_order(A.data, A.indices, A.indptr, model.pattern.ordering.fronts, b)
    dense = A.toarray()
    bound = 20 * np.finfo(float).eps * np.linalg.cond(dense) * np.abs(x).max()
    np.testing.assert_allclose(x, np.linalg.solve(dense, b), rtol=0, atol=bound)


@pytest.mark.parametrize("backend", _kernels.available())
def test_a_singular_matrix_gives_no_number(backend: str) -> None:
    """Two nodes that nothing holds: the second pivot is exactly zero."""
    A = csc_array(np.array([[1.0, -1.0], [-1.0, 1.0]]))
    pattern = make_pattern(2, np.array([0]), np.array([1]), np.zeros(2, dtype=np.bool_), 1)
    with _kernels.use_backend(backend):
        x = solve_in_order(A.data, A.indices, A.indptr, pattern.ordering.fronts, np.ones(2))
    assert np.isnan(x).all()

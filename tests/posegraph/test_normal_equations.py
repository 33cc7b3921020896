"""The sparse system: equal to dense sums of the book, in any order, with any nodes held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_graphs import random_graph

from vslam_ref.estimation.posegraph import PoseGraph, book, pattern, solve_graph
from vslam_ref.estimation.posegraph.pattern import ORDERINGS, choose_ordering, make_pattern
from vslam_ref.estimation.posegraph.solver import Options
from vslam_ref.estimation.posegraph.spaces import tangent_size
from vslam_ref.estimation.posegraph.system import GraphModel, GraphProblem
from vslam_ref.estimation.robust import Cauchy


def model_of(graph: PoseGraph, **more: object) -> GraphModel:
    problem = GraphProblem(graph, **more)  # type: ignore[arg-type]
    return GraphModel(problem, problem.at(graph.T_world))


def unknowns(model: GraphModel) -> np.ndarray:
    """Where each unknown of the sparse system stands in the book's."""
    d = model.pattern.d
    return (model.pattern.free[:, None] * d + np.arange(d)).reshape(-1)


def held(graph: PoseGraph, *nodes: int) -> PoseGraph:
    fixed = np.zeros(graph.sizes[0], dtype=np.bool_)
    fixed[list(nodes)] = True
    return replace(graph, fixed=fixed)


@pytest.mark.parametrize("nodes", [(0,), (5,), (0, 3, 11)])
def test_sums_are_the_books(graph: PoseGraph, nodes: tuple[int, ...]) -> None:
    """A tolerance of some hundred roundings of the largest entry: sums of ten products of 7 numbers."""
    graph = held(graph, *nodes)
    model, plain = model_of(graph), book.dense_normal(graph, graph.T_world)
    at = unknowns(model)
    largest = np.abs(plain.H).max()
    np.testing.assert_allclose(model.matrix.toarray(), plain.H[np.ix_(at, at)], atol=1e-13 * largest)
    np.testing.assert_allclose(model.gradient, plain.g[at], atol=1e-13 * largest)
    assert 2.0 * model.costs.sum() == pytest.approx(plain.chi2, rel=1e-13)


def test_weights_of_a_loss_reach_matrix_and_gradient(graph: PoseGraph) -> None:
    loss = Cauchy(1.0)
    model = model_of(graph, loss=loss)
    plain = book.dense_normal(graph, graph.T_world, lambda c: float(loss.weight(c**0.5)))
    at, largest = unknowns(model), np.abs(plain.H).max()
    assert model.weights.min() < 0.9
    np.testing.assert_allclose(model.matrix.toarray(), plain.H[np.ix_(at, at)], atol=1e-13 * largest)
    np.testing.assert_allclose(model.gradient, plain.g[at], atol=1e-13 * largest)


def test_edges_between_the_same_nodes_add_up(graph: PoseGraph) -> None:
    """Every edge twice: twice the matrix."""
    many = np.arange(graph.sizes[1]).repeat(2)
    twice = PoseGraph(
        graph.space,
        graph.T_world,
        graph.tail[many],
        graph.head[many],
        graph.measured[many],
        graph.information[many],
    )
    one, two = (book.dense_normal(g, g.T_world) for g in (graph, twice))
    np.testing.assert_allclose(two.H, 2.0 * one.H)
    model = model_of(twice)
    at = unknowns(model)
    np.testing.assert_allclose(
        model.matrix.toarray(), two.H[np.ix_(at, at)], atol=1e-13 * np.abs(two.H).max()
    )


@pytest.mark.parametrize("name", ORDERINGS)
def test_every_ordering_gives_the_same_step(
    name: str, graph: PoseGraph, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pattern.choose_ordering, "__defaults__", ((name,),))
    problem = GraphProblem(graph)
    model = GraphModel(problem, problem.at(graph.T_world))
    assert model.pattern.ordering.name == name
    step = problem.step(model, 0.0)
    assert step is not None
    np.testing.assert_allclose(step.change, book.dense_step(graph, graph.T_world), atol=1e-9)


def test_products_are_those_of_the_factor() -> None:
    """Against a dense Cholesky factor's pattern, for every ordering of a ring with a chord."""
    a, b = np.array([0, 1, 2, 3, 4, 5, 0]), np.array([1, 2, 3, 4, 5, 0, 3])
    A = np.eye(6) * 10.0
    A[a, b] = A[b, a] = -1.0
    for name in ORDERINGS:
        found = choose_ordering(6, a, b, (name,))
        L = np.linalg.cholesky(A[np.ix_(found.order, found.order)])
        assert found.products == float(((np.abs(L) > 1e-12).sum(0) ** 2).sum())
    best = choose_ordering(6, a, b)
    assert best.products == min(choose_ordering(6, a, b, (name,)).products for name in ORDERINGS)


def test_the_order_is_not_its_inverse() -> None:
    """A star whose hub comes first must have it last, or all leaves are joined."""
    n = 30
    order = choose_ordering(n, np.zeros(n - 1, dtype=np.int64), np.arange(1, n))
    assert np.flatnonzero(order.order == 0)[0] >= n - 2
    assert order.products == 4.0 * (n - 1) + 1.0


def test_an_order_is_used_again_for_other_sizes() -> None:
    graph = random_graph("se2")
    first = make_pattern(12, graph.tail, graph.head, graph.fixed, 3)
    again = make_pattern(12, graph.tail, graph.head, graph.fixed, 1, first.ordering)
    assert (again.free == first.free).all()
    assert (again.size, first.size) == (11, 33)


def test_edges_of_negligible_weight_leave_the_matrix_and_not_the_gradient() -> None:
    """A false loop has no block; the descent ends where it ends with all blocks, and pulls the same."""
    graph = random_graph("se2", n=30, loops=12)
    z = graph.measured.copy()
    z[-3:, 0] += 1e4
    graph = replace(graph, measured=z)
    lean, whole = model_of(graph, loss=Cauchy(1.0)), model_of(graph, loss=Cauchy(1.0), negligible=0.0)
    assert lean.matrix.nnz < whole.matrix.nnz
    np.testing.assert_allclose(
        lean.gradient[np.argsort(unknowns(lean))], whole.gradient[np.argsort(unknowns(whole))], rtol=1e-12
    )
    ends = [
        solve_graph(graph, "cauchy", options=Options(constant=1.0, negligible=share, cost=0.0)).graph.T_world
        for share in (1e-4, 0.0)
    ]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-6)


def test_an_edge_that_holds_the_graph_together_always_matters() -> None:
    """A chain with one absurd edge, all edges judged: without it the rest would float."""
    graph = random_graph("se2", loops=1)
    z = graph.measured.copy()
    z[4, 0] += 1e5
    graph = replace(graph, measured=z).only(np.arange(12) != 11)
    model = model_of(graph, loss=Cauchy(1.0))
    assert model.weights[4] < 1e-4
    assert model.layout[1].all()


def test_nothing_is_left_to_solve_where_all_nodes_are_held() -> None:
    graph = held(random_graph("se3"), *range(12))
    model = model_of(graph)
    assert model.matrix.shape == (0, 0)
    assert tangent_size("se3") == model.pattern.d

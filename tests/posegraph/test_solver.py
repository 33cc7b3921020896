"""Solving: the book's steps, the minimum, its law, the gauge, and ends that are told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import least_squares
from small_graphs import SPACES, random_graph

from vslam_ref.estimation.posegraph import Options, PoseGraph, book, solve_graph
from vslam_ref.estimation.posegraph.errors import CONVENTIONS, Convention
from vslam_ref.estimation.posegraph.spaces import GROUPS, Space, moved, tangent_size
from vslam_ref.estimation.posegraph.system import GraphProblem
from vslam_ref.worlds.rounds import make_rounds


def test_gauss_newton_takes_the_books_steps(graph: PoseGraph) -> None:
    """Four steps, the poses after each: a tolerance for the condition of H, about 1e4 here."""
    X = graph.T_world
    for steps in range(1, 5):
        X = moved(graph.space, X, book.dense_step(graph, X))
        found = solve_graph(graph, options=Options(damping=0.0, max_iterations=steps, cost=0.0, gradient=0.0))
        np.testing.assert_allclose(found.graph.T_world, X, atol=1e-10)


def test_both_reach_the_same_minimum(graph: PoseGraph) -> None:
    found, plain = solve_graph(graph), book.pose_graph(graph, iterations=50)
    assert found.converged
    assert found.chi2 == pytest.approx(plain.chi2[-1], rel=1e-12)
    assert found.initial_chi2 == pytest.approx(plain.chi2[0], rel=1e-12)


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_scipy_finds_nothing_lower(space: Space, convention: Convention) -> None:
    """A solver that knows no Jacobian and no pattern, from the start and from the solution."""
    graph = random_graph(space, n=6, loops=3)
    problem, (n, _), d = GraphProblem(graph, convention), graph.sizes, tangent_size(space)

    def residual(step: np.ndarray) -> np.ndarray:
        return problem.at(moved(space, graph.T_world, np.append(np.zeros(d), step).reshape(n, d))).r.ravel()

    found = solve_graph(graph, convention=convention)
    other = least_squares(residual, np.zeros(d * (n - 1)), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert found.chi2 == pytest.approx(2.0 * other.cost, rel=1e-9)


def test_fixed_nodes_stay_and_the_world_may_be_anywhere(space: Space) -> None:
    """Poses on the left by G, fixed node too: the same chi², poses on the left by G."""
    graph, group = random_graph(space), GROUPS[space]
    G = group.exp(0.5 * np.ones(tangent_size(space)))
    fixed = np.zeros(12, dtype=np.bool_)
    fixed[7] = True
    graph = replace(graph, fixed=fixed)
    here, there = solve_graph(graph), solve_graph(graph.at(group.compose(G, graph.T_world)))
    assert (here.graph.T_world[7] == graph.T_world[7]).all()
    assert there.chi2 == pytest.approx(here.chi2, rel=1e-10)
    np.testing.assert_allclose(group.compose(G, here.graph.T_world), there.graph.T_world, atol=1e-8)


@pytest.mark.parametrize("space", SPACES)
def test_chi2_has_its_law(space: Space) -> None:
    """Sum of the least chi² of 40 worlds: chi-square with d (m - n + 1) each; alarm rate 1 in 1000."""
    total, freedom = 0.0, 0
    for seed in range(40):
        made = make_rounds(space, np.random.default_rng(seed), rounds=2, per_round=12, noise=0.1)
        found = solve_graph(made.graph)
        assert found.converged
        n, m = made.graph.sizes
        total, freedom = total + found.chi2, freedom + tangent_size(space) * (m - n + 1)
    low, high = stats.chi2.ppf([5e-4, 1 - 5e-4], freedom)
    assert low < total < high


def test_exact_measurements_give_the_truth(space: Space) -> None:
    made = make_rounds(space, np.random.default_rng(1), rounds=2, per_round=16, noise=1e-9)
    start = moved(
        space, made.true, 0.05 * np.random.default_rng(2).standard_normal((32, tangent_size(space)))
    )
    start[0] = made.true[0]
    found = solve_graph(made.graph.at(start))
    np.testing.assert_allclose(found.graph.T_world, made.true, atol=1e-7)


def test_parts_are_solved_side_by_side() -> None:
    """Two graphs in one: each as if it were alone."""
    a, b = random_graph("se2", 1), random_graph("se2", 2)
    n = a.sizes[0]
    both = PoseGraph(
        "se2",
        np.concatenate([a.T_world, b.T_world]),
        np.concatenate([a.tail, b.tail + n]),
        np.concatenate([a.head, b.head + n]),
        np.concatenate([a.measured, b.measured]),
        np.concatenate([a.information, b.information]),
    )
    assert np.flatnonzero(both.fixed).tolist() == [0, n]
    found, alone = solve_graph(both), [solve_graph(a), solve_graph(b)]
    assert found.chi2 == pytest.approx(sum(one.chi2 for one in alone), rel=1e-10)


def test_ends_that_are_told() -> None:
    graph = random_graph("se2")
    assert solve_graph(graph, options=Options(max_iterations=1)).reason == "max_iterations"
    still = solve_graph(replace(graph, fixed=np.ones(12, dtype=np.bool_)))
    assert (still.reason, still.chi2) == ("nothing_free", still.initial_chi2)
    far = graph.at(graph.T_world * np.array([1e300, 1e300, 1.0]))
    found = solve_graph(far)
    assert found.reason == "not_finite"
    assert (found.graph.T_world == far.T_world).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"tail": np.full(19, 99)}, r"tail\[0\] is no node; there are 12"),
        (
            {"tail": np.arange(1, 20) % 12, "head": np.arange(1, 20) % 12},
            r"edge\[0\] joins a node with itself",
        ),
        ({"measured": np.full((19, 3), np.nan)}, r"measured\[0\] has a number that is not finite"),
        ({"information": np.array([np.diag([1.0, -1.0, 1.0])] * 19)}, r"information\[0\] is not positive"),
        ({"information": np.ones((19, 3, 3))}, r"information\[0\] is not positive"),
        ({"information": np.ones((18, 3, 3))}, "18 information matrices for 19 edges"),
        ({"T_world": np.zeros((12, 4))}, r"T_world has shape \(12, 4\): SE\(2\) needs \(k, 3\)"),
        ({"fixed": np.zeros(12, dtype=np.bool_)}, "node 0 hangs on no fixed node"),
        ({"fixed": np.zeros(3, dtype=np.bool_)}, r"fixed has shape \(3,\)"),
    ],
)
def test_a_graph_that_makes_no_sense_is_refused(change: dict[str, np.ndarray], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(random_graph("se2"), **change)


@pytest.mark.parametrize(
    "wrong",
    [{"damping": -1.0}, {"negligible": 0.5}, {"constant": -2.0}, {"cost": 2.0}, {"max_iterations": -1}],
)
def test_settings_that_mean_nothing_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Options(**wrong)  # type: ignore[arg-type]

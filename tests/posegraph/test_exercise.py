"""Exercise 13.1: a pose graph solver of the plane that a reader has written."""

from __future__ import annotations

from types import ModuleType

import numpy as np

from vslam_ref.estimation.posegraph import PoseGraph, solve_graph
from vslam_ref.geometry import se2
from vslam_ref.worlds.rounds import make_rounds

EXERCISE = "13_pose_graph"


def chi2(poses: np.ndarray, graph: PoseGraph) -> float:
    D = se2.between(graph.measured, se2.between(poses[graph.tail], poses[graph.head]))
    return float(np.einsum("mi,mij,mj->", D, graph.information, D))


def answered(answer: ModuleType, graph: PoseGraph) -> np.ndarray:
    """The answer's poses, which have the right shape and hold the first one."""
    given = (graph.T_world, graph.tail, graph.head, graph.measured, graph.information)
    found = np.asarray(answer.solve(*(part.copy() for part in given)), dtype=float)
    assert found.shape == graph.T_world.shape, f"{found.shape} poses; there are {graph.T_world.shape}"
    assert np.isfinite(found).all(), "a pose is not finite"
    first = "the first pose has moved: hold it, or nothing ties the graph to the world"
    np.testing.assert_allclose(found[0], graph.T_world[0], atol=1e-12, err_msg=first)
    return found


def test_edges_that_agree_are_met(answer: ModuleType) -> None:
    made = make_rounds("se2", np.random.default_rng(1), rounds=2, per_round=10, noise=1e-9)
    start = made.true + np.random.default_rng(2).normal(0.0, 0.05, made.true.shape)
    start[0] = made.true[0]
    found = answered(answer, made.graph.at(start))
    off = se2.log(se2.between(made.true, found))
    np.testing.assert_allclose(off, 0.0, atol=1e-6, err_msg="exact edges do not give the true poses")


def test_the_minimum_is_reached(answer: ModuleType) -> None:
    made = make_rounds("se2", np.random.default_rng(3), rounds=2, per_round=12)
    found, best = answered(answer, made.graph), solve_graph(made.graph, convention="g2o")
    ratio = chi2(found, made.graph) / best.chi2
    assert ratio < 1.0 + 1e-8, f"chi² is {ratio:.9f} times the least one: are the Jacobians right?"


def test_the_whole_information_counts(answer: ModuleType) -> None:
    made = make_rounds("se2", np.random.default_rng(4), rounds=2, per_round=10)
    A = np.random.default_rng(5).standard_normal((made.graph.sizes[1], 3, 3))
    full = PoseGraph(
        "se2",
        made.graph.T_world,
        made.graph.tail,
        made.graph.head,
        made.graph.measured,
        100.0 * (A @ np.swapaxes(A, 1, 2) + np.eye(3)),
    )
    found, best = answered(answer, full), solve_graph(full, convention="g2o")
    ratio = chi2(found, full) / best.chi2
    assert ratio < 1.0 + 1e-8, f"chi² is {ratio:.6f} times the least one: is Omega used off its diagonal?"


def test_a_turn_past_half_a_circle_is_no_error(answer: ModuleType) -> None:
    """A pose at -179 degrees and one at 179 are two degrees apart."""
    near = np.deg2rad(179.0)
    graph = PoseGraph(
        "se2",
        np.array([[0.0, 0.0, near], [-1.0, 0.1, -near], [-2.0, 0.0, near]]),
        [0, 1, 0],
        [1, 2, 2],
        np.array([[1.0, 0.0, np.deg2rad(2.0)], [1.0, 0.0, -np.deg2rad(2.0)], [2.0, 0.0, 0.0]]),
        np.array([np.eye(3)] * 3),
    )
    found, best = answered(answer, graph), solve_graph(graph, convention="g2o")
    assert chi2(found, graph) < 1.001 * best.chi2 + 1e-12, "is the angle of an error wrapped?"

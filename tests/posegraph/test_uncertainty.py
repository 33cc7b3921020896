"""Marginal covariances: blocks of a dense inverse, and what many worlds scatter."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from small_graphs import random_graph

from vslam_ref.estimation.posegraph import PoseGraph, book, marginal_covariances, solve_graph
from vslam_ref.estimation.posegraph.spaces import GROUPS, tangent_size
from vslam_ref.worlds.rounds import make_rounds


def test_blocks_of_the_dense_inverse(graph: PoseGraph) -> None:
    """In any order, twice, and for the fixed node; rtol for the condition of H, below 1e6."""
    solved, d = solve_graph(graph).graph, tangent_size(graph.space)
    H = book.dense_normal(solved, solved.T_world).H[d:, d:]
    inverse = np.linalg.inv(H)
    asked = [11, 3, 0, 3]
    found = marginal_covariances(solved, asked)
    for cov, node in zip(found, asked, strict=True):
        at = slice(d * (node - 1), d * node)
        wanted = inverse[at, at] if node else np.zeros((d, d))
        np.testing.assert_allclose(cov, wanted, atol=1e-9 * np.abs(inverse).max())


def test_the_scatter_of_many_worlds() -> None:
    """Errors of one pose over 150 worlds, in its own covariance: a two-sided band, one alarm in 1000."""
    total, runs = 0.0, 150
    group = GROUPS["se2"]
    for seed in range(runs):
        made = make_rounds("se2", np.random.default_rng(seed), rounds=2, per_round=8, noise=0.05)
        solved = solve_graph(made.graph).graph
        error = group.log(group.between(made.true[9], solved.T_world[9]))
        total += float(error @ np.linalg.solve(marginal_covariances(solved, [9])[0], error))
    low, high = stats.chi2.ppf([5e-4, 1 - 5e-4], 3 * runs)
    assert low < total < high


def test_a_node_that_is_not_there_is_refused() -> None:
    with pytest.raises(ValueError, match="need numbers from 0 to 11"):
        marginal_covariances(random_graph("se2"), [12])

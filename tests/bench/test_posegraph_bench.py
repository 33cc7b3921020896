"""The parts of ``bench posegraph`` compare what they say; times are not asserted."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.bench import posegraph
from vslam_ref.bench.posegraph import GTSAM_TOLERANCE, chi2
from vslam_ref.estimation.posegraph import solve_graph
from vslam_ref.worlds.rounds import make_rounds


@pytest.mark.parametrize("space", ["se2", "se3"])
@pytest.mark.parametrize("ordering", posegraph.ORDERINGS)
def test_gtsam_solves_the_same_graph(space: str, ordering: str) -> None:
    """The same minimum: blocks of the information turned or poses read wrongly would show in chi²."""
    pytest.importorskip("gtsam", reason="the peer needs gtsam (extra `peers`)")
    graph = make_rounds(space, np.random.default_rng(2), rounds=2, per_round=20).graph  # type: ignore[arg-type]
    least = solve_graph(graph).chi2
    assert chi2(graph, graph.T_world) > 2.0 * least
    found = posegraph.gtsam_gauss_newton(graph, ordering)()
    # it stops where the cost changes by less than 1e-5 of itself, and its next step is far smaller
    assert chi2(graph, found) == pytest.approx(least, rel=1e-5)


@pytest.mark.parametrize("space", ["se2", "se3"])
def test_g2o_solves_the_same_graph(space: str) -> None:
    pytest.importorskip("g2opy", reason="the peer needs g2opy")
    graph = make_rounds(space, np.random.default_rng(2), rounds=2, per_round=20).graph  # type: ignore[arg-type]
    least = solve_graph(graph, convention="g2o").chi2
    found = posegraph.g2o_gauss_newton(graph, 8)()
    assert chi2(graph, found, "g2o") == pytest.approx(least, rel=1e-8)


def test_chi2_is_the_solvers() -> None:
    graph = make_rounds("se3", np.random.default_rng(0), rounds=2, per_round=20).graph
    found = solve_graph(graph, options=GTSAM_TOLERANCE)
    assert chi2(graph, found.graph.T_world) == pytest.approx(found.chi2, rel=1e-12)
    assert chi2(graph, found.graph.T_world, "g2o") < 0.9 * found.chi2  # another number


def test_graphs_stand_in_for_those_not_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(posegraph.catalogue, "find", lambda name: None)
    assert {graph.space for graph in posegraph.known_graphs(True).values()} == {"se2", "se3"}
    rows = posegraph.against_gtsam({}, 1)
    assert rows == []

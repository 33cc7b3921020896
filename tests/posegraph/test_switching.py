"""Losses of edges: what they minimise, that two of them are one, and that false loops are told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

from vslam_ref.estimation.posegraph import GraphSolution, Options, solve_graph
from vslam_ref.estimation.posegraph.solver import honest_limit
from vslam_ref.estimation.posegraph.spaces import translations
from vslam_ref.estimation.posegraph.switching import (
    LIKELY,
    NAMES,
    DynamicCovariance,
    MaxMixture,
    Switchable,
    edge_loss,
)
from vslam_ref.estimation.posegraph.system import GraphProblem
from vslam_ref.estimation.robust import GemanMcClure, Loss
from vslam_ref.worlds.rounds import RADIUS, make_rounds

SIZES = np.array([0.0, 1e-3, 0.7, 1.999, 2.001, 3.5, 12.0, 1e3])
LOSSES: list[Loss] = [Switchable(1.7), DynamicCovariance(2.0), MaxMixture(2.0)]


def test_a_switch_that_is_eliminated_is_geman_mcclure() -> None:
    """Cost, weight and its slope, for any constant; rtol of a few roundings."""
    for c in (0.5, 2.0, 7.0):
        ours, known = Switchable(c), GemanMcClure(c)
        for name in ("cost", "weight", "weight_slope"):
            np.testing.assert_allclose(getattr(ours, name)(SIZES), getattr(known, name)(SIZES), rtol=1e-13)


def test_the_switch_is_the_best_one() -> None:
    """Against a numeric search over s of s² c + Xi (1 - s)²."""
    loss = Switchable(2.0)
    for x in SIZES[2:7]:

        def both(s: float, x: float = x) -> float:
            return s**2 * x**2 + 4.0 * (1.0 - s) ** 2

        found = minimize_scalar(both, bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-10})
        assert float(loss.switch(x)) == pytest.approx(found.x, abs=1e-6)
        assert 2.0 * float(loss.cost(x)) == pytest.approx(found.fun, rel=1e-9)


def test_the_graph_with_explicit_switches_has_the_same_minimum() -> None:
    """Poses and switches at once (SciPy, switches as unknowns) against poses alone with Geman-McClure."""
    from scipy.optimize import least_squares

    from vslam_ref.estimation.posegraph.spaces import moved
    from vslam_ref.estimation.posegraph.system import GraphProblem

    made = make_rounds("se2", np.random.default_rng(3), rounds=2, per_round=8, false_loops=1)
    graph, loops = made.graph, made.graph.loops
    problem, n = GraphProblem(graph), graph.sizes[0]

    def residual(x: np.ndarray) -> np.ndarray:
        step, s = np.append(np.zeros(3), x[: 3 * n - 3]).reshape(n, 3), x[3 * n - 3 :]
        r = problem.at(moved("se2", graph.T_world, step)).r
        r[loops] *= s[:, None]
        return np.append(r.ravel(), 2.0 * (1.0 - s))

    rule = edge_loss("geman-mcclure", "se2")._replace(limit=0.0)
    found = solve_graph(graph, rule, options=Options(cost=0.0))
    x = np.append(
        np.zeros(3 * n - 3), rule.loss.sqrt_weight(np.sqrt(problem.at(graph.T_world).squares[loops]))
    )
    other = least_squares(residual, x, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    cost = GraphProblem(graph, loss=rule.loss, judged=loops).at(found.graph.T_world).costs.sum()
    assert float(cost) == pytest.approx(other.cost, rel=1e-8)


@pytest.mark.parametrize("loss", LOSSES, ids=lambda loss: type(loss).__name__)
def test_the_weight_is_the_slope_of_the_cost(loss: Loss) -> None:
    """psi = w x integrates to the cost; the slope of w by differences."""
    for x in SIZES[1:7]:
        area = quad(lambda v: float(loss.influence(v)), 0.0, x, points=[loss.c], epsabs=1e-12)[0]
        slack = 1e-5 if isinstance(loss, MaxMixture) else 1e-8  # its seam is nu off the point given
        assert float(loss.cost(x)) == pytest.approx(area, rel=slack)
        h = 1e-6 * x
        slope = (loss.weight(x + h) - loss.weight(x - h)) / ((x + h) ** 2 - (x - h) ** 2)
        assert float(loss.weight_slope(x)) == pytest.approx(float(slope), rel=1e-4, abs=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_small_errors_are_squared_and_infinity_is_least_squares(name: str) -> None:
    loss = edge_loss(name, "se2").loss
    assert float(loss.cost(1e-4)) == pytest.approx(0.5e-8, rel=1e-7)
    assert np.isnan(loss.weight(np.nan))
    if name != "max-mixture":
        wide = replace(loss, c=np.inf)
        np.testing.assert_allclose(wide.cost(SIZES), 0.5 * SIZES**2)


def test_limits_are_where_the_switch_is_one_half() -> None:
    """DCS at a weight of 1/4, a switch of one half, as the others; a mixture where it changes sides."""
    for name in ("geman-mcclure", "switchable", "dcs"):
        rule = edge_loss(name, "se3")
        assert float(rule.loss.weight(rule.limit**0.5)) == pytest.approx(0.25)
    rule = edge_loss("max-mixture", "se3")
    below, above = rule.loss.weight(np.sqrt(rule.limit * np.array([1 - 1e-9, 1 + 1e-9])))
    assert (below, above) == (1.0, 1e-6)
    wide = edge_loss("dcs", "se2").widened(48.0)
    assert float(wide.loss.weight(48.0**0.5)) == pytest.approx(0.25)


def test_the_limits_of_a_mixture_are_quantiles() -> None:
    for space, d in (("se2", 3), ("se3", 6), ("sim3", 7)):
        assert LIKELY[space] == pytest.approx(stats.chi2.ppf(0.999, d), abs=1e-6)


@pytest.mark.parametrize("name", ["switchable", "geman-mcclure", "dcs"])
@pytest.mark.parametrize("space", ["se2", "se3"])
def test_false_loops_are_told(space: str, name: str) -> None:
    """Twelve among some fifty: all out, at most three true ones with them; poses within 1 % of the path."""
    made = make_rounds(space, np.random.default_rng(1), false_loops=12)  # type: ignore[arg-type]
    found = solve_graph(made.graph, name)
    clean = solve_graph(made.graph.only(~made.false))
    assert found.converged
    assert found.rejected[made.false].all()
    assert found.rejected[~made.false].sum() <= 3
    path = 4 * 2.0 * np.pi * RADIUS
    fooled = solve_graph(made.graph)
    assert distance(found, clean) < 0.01 * path < distance(fooled, clean)


def distance(one: GraphSolution, other: GraphSolution) -> float:
    """RMSE between the positions of two solutions, metres."""
    space = one.graph.space
    off = translations(space, one.graph.T_world) - translations(space, other.graph.T_world)
    return float(np.sqrt((off**2).sum(1).mean()))


def test_least_squares_huber_and_cauchy_call_no_edge_false() -> None:
    made = make_rounds("se2", np.random.default_rng(1), rounds=2, false_loops=3)
    for name in ("l2", "huber", "cauchy"):
        assert not solve_graph(made.graph, name).rejected.any()


def test_a_loss_is_for_the_loops_unless_told() -> None:
    """A false step of the odometry: found where all edges are judged, and believed where loops only are."""
    made = make_rounds("se2", np.random.default_rng(2), rounds=3)
    z = made.graph.measured.copy()
    z[20, :2] += 5.0
    graph = replace(made.graph, measured=z)
    assert graph.loops.sum() > 10
    whole = solve_graph(graph, "dcs", judged=np.ones(graph.sizes[1], dtype=np.bool_))
    assert whole.rejected[20]
    assert not solve_graph(graph, "dcs").rejected[20]


def test_a_loss_is_widened_where_the_covariances_are_right_and_only_there() -> None:
    """Honest noise: the limit rises to what one edge in 1000 exceeds.  Noise below its word: it stays."""
    honest = make_rounds("se3", np.random.default_rng(4), false_loops=5)
    found = solve_graph(honest.graph, "switchable")
    assert honest_limit(found) > 15.0
    given = solve_graph(honest.graph, "switchable", options=Options(constant=2.0))
    assert given.rejected.sum() > found.rejected.sum() + 10
    modest = replace(honest.graph, information=honest.graph.information / 100.0)
    assert honest_limit(solve_graph(modest, "switchable")) < 1.0


def test_a_part_that_hangs_on_false_edges_only_is_held() -> None:
    """The last node is tied by one loop that is false: it stays where it is, and that is counted."""
    made = make_rounds("se2", np.random.default_rng(5), rounds=2, per_round=12)
    graph, (n, m) = made.graph, made.graph.sizes
    last = (graph.tail == n - 1) | (graph.head == n - 1)
    keep = ~last | (np.arange(m) == n - 2)
    z = graph.measured.copy()
    z[n - 2, 0] += 50.0
    alone = replace(graph, measured=z).only(keep)
    two = replace(
        alone,
        tail=np.append(alone.tail, 3),
        head=np.append(alone.head, n - 1),
        measured=np.concatenate([alone.measured, [[1.0, 2.0, 0.3]]]),
        information=np.concatenate([alone.information, alone.information[:1] / 1e6]),
    )
    found = solve_graph(two, "switchable", judged=np.ones(two.sizes[1], dtype=np.bool_))
    assert np.isfinite(found.graph.T_world).all()
    assert found.rejected.sum() + found.loosened >= 1


def test_an_unknown_loss_is_refused() -> None:
    with pytest.raises(ValueError, match="unknown loss 'tukey'; known: l2, huber"):
        edge_loss("tukey", "se2")


@pytest.mark.parametrize("seed", [1, 3, 4])
def test_the_lower_of_two_minima_counts(seed: int) -> None:
    """A mixture pulls no edge beyond its limit: from the odometry alone, true loops stay out for good.

    From where its rival leads they are within reach, and that end costs less by the mixture's own measure.
    """
    made = make_rounds("se2", np.random.default_rng(seed), rounds=3, false_loops=12)
    rule = edge_loss("max-mixture", "se2")
    alone, both = (solve_graph(made.graph, one) for one in (rule._replace(rival=None), rule))
    problem = GraphProblem(made.graph, "log", rule.loss, made.graph.loops)
    ends = [float(problem.at(found.graph.T_world).costs.sum()) for found in (alone, both)]
    assert ends[1] < 0.8 * ends[0]
    assert (alone.rejected & ~made.false).sum() > 10
    assert (both.rejected == made.false).all()
    assert len(both.history) > len(alone.history)  # both descents are told


def test_a_minimum_that_is_lower_already_is_kept() -> None:
    """No worse for the second descent: the poses of a graph without false loops are the same to the bit."""
    made = make_rounds("se2", np.random.default_rng(0), rounds=2, per_round=20)
    rule = edge_loss("switchable", "se2")
    alone, both = (solve_graph(made.graph, one) for one in (rule._replace(rival=None), rule))
    assert (alone.graph.T_world == both.graph.T_world).all()

"""Starts: exact where the edges agree, whatever their order and direction; and good where they do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from small_graphs import random_graph

from vslam_ref.estimation.posegraph import Options, PoseGraph, chordal_start, odometry_start, solve_graph
from vslam_ref.estimation.posegraph.spaces import GROUPS, Space, rotations, scales, translations
from vslam_ref.estimation.posegraph.starts import disconnected_parts
from vslam_ref.geometry import se3, so3
from vslam_ref.worlds.rounds import make_rounds


def exact(space: Space) -> tuple[PoseGraph, np.ndarray]:
    """A graph whose edges agree with its true poses, with a start that is all zero but for one fixed node."""
    graph = random_graph(space, noise=0.0)
    true = graph.T_world
    start = GROUPS[space].identity((12,))
    start[4] = true[4]
    fixed = np.arange(12) == 4
    return replace(graph, T_world=start, fixed=fixed), true


def test_both_are_exact_where_the_edges_agree(space: Space) -> None:
    """1e-10: chains of eleven products; a linear system of condition about 1e3."""
    graph, true = exact(space)
    np.testing.assert_allclose(odometry_start(graph), true, atol=1e-10)
    np.testing.assert_allclose(chordal_start(graph), true, atol=1e-10)


def test_the_order_and_direction_of_edges_mean_nothing_to_odometry(space: Space) -> None:
    graph, group = random_graph(space), GROUPS[space]
    chain = odometry_start(graph)
    order = np.random.default_rng(1).permutation(graph.sizes[1])
    turned = PoseGraph(
        space,
        graph.T_world,
        graph.head[order],
        graph.tail[order],
        group.inverse(graph.measured[order]),
        graph.information[order],
    )
    np.testing.assert_allclose(odometry_start(turned), chain, atol=1e-12)
    # by hand, one step after another
    X = [graph.T_world[0]]
    for k in range(11):
        X.append(group.compose(X[-1], graph.measured[k]))
    np.testing.assert_allclose(chain, X, atol=1e-12)


def test_odometry_takes_a_loop_only_where_the_chain_is_broken() -> None:
    graph = random_graph("se2")
    loop = int(np.flatnonzero(((graph.head > 5) != (graph.tail > 5)) & graph.loops)[0])
    broken = graph.only(np.arange(19) != 5)
    start, group = odometry_start(broken), GROUPS["se2"]
    other = odometry_start(graph)
    np.testing.assert_allclose(start[:6], other[:6], atol=1e-12)
    assert np.abs(start[6:] - other[6:]).max() > 1e-3
    across = group.between(start[graph.tail[loop]], start[graph.head[loop]])
    np.testing.assert_allclose(across, graph.measured[loop], atol=1e-12)


def test_the_cheapest_of_parallel_edges_is_taken() -> None:
    """Two steps between the same nodes: the first of the file, as often as it is asked."""
    still = np.array([np.eye(3)] * 3)
    z = np.array([[1.0, 0, 0], [9.0, 0, 0], [1.0, 0, 0]])
    graph = PoseGraph("se2", np.zeros((3, 3)), [0, 0, 1], [1, 1, 2], z, still)
    assert odometry_start(graph)[:, 0].tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize("space", ["se2", "se3"])
def test_chordal_rotations_are_the_least_chordal_distance(space: Space) -> None:
    """Against a least squares over all matrix entries by SciPy, then the nearest rotations by its SVD."""
    graph = random_graph(space, n=6, loops=3, noise=0.2)
    R, k = rotations(space, graph.measured), 2 if space == "se2" else 3
    kappa = np.diagonal(graph.information, axis1=1, axis2=2)[:, k:].mean(1)
    first = rotations(space, graph.T_world)[:1]

    def residual(x: np.ndarray) -> np.ndarray:
        M = np.concatenate([first, x.reshape(-1, k, k)])
        return (np.sqrt(kappa)[:, None, None] * (M[graph.tail] @ R - M[graph.head])).ravel()

    M = least_squares(residual, np.zeros(5 * k * k), xtol=1e-15, ftol=1e-15, gtol=1e-15).x.reshape(-1, k, k)
    U, _, Vt = np.linalg.svd(M)
    turn = np.linalg.det(U @ Vt)
    U[:, :, -1] *= turn[:, None]
    np.testing.assert_allclose(rotations(space, chordal_start(graph))[1:], U @ Vt, atol=1e-6)


def test_chordal_positions_are_the_least_squares_of_known_rotations(space: Space) -> None:
    """With rotations and scales of the answer, its translations make the linear residual's gradient 0."""
    graph = random_graph(space, noise=0.2)
    start = chordal_start(graph)
    R, t, s = rotations(space, start), translations(space, start), scales(space, start)
    weight = np.diagonal(graph.information, axis1=1, axis2=2)[:, : t.shape[1]].mean(1)
    way = np.einsum("mij,mj->mi", R[graph.tail], translations(space, graph.measured))
    off = weight[:, None] * (t[graph.tail] + s[graph.tail, None] * way - t[graph.head])
    pull = np.zeros_like(t)
    np.add.at(pull, graph.tail, off)
    np.add.at(pull, graph.head, -off)
    np.testing.assert_allclose(pull[1:], 0.0, atol=1e-11 * np.abs(off).sum())
    assert np.abs(pull[0]).max() < 1e-9 * np.abs(off).sum()


def test_chordal_is_nearer_than_odometry_where_drift_adds_up(space: Space) -> None:
    made = make_rounds(space, np.random.default_rng(6))
    ends = [solve_graph(made.graph.at(start(made.graph))) for start in (odometry_start, chordal_start)]
    assert ends[1].initial_chi2 < 0.1 * ends[0].initial_chi2
    assert ends[1].chi2 == pytest.approx(ends[0].chi2, rel=1e-8)


def test_parts_are_counted_and_each_begins_at_its_fixed_node() -> None:
    graph = random_graph("se3").only(np.ones(19, dtype=np.bool_))
    split = PoseGraph(
        "se3",
        graph.T_world,
        graph.tail[[0, 1, 6, 7]],
        graph.head[[0, 1, 6, 7]],
        graph.measured[[0, 1, 6, 7]],
        graph.information[[0, 1, 6, 7]],
    )
    assert disconnected_parts(graph) == 1
    assert disconnected_parts(split) == 8  # 0-1-2, 6-7-8, and six nodes alone
    for start in (odometry_start(split), chordal_start(split)):
        np.testing.assert_allclose(start[split.fixed], split.T_world[split.fixed])


def wound_sphere(rng: np.random.Generator, sigma: float) -> PoseGraph:
    """A path of 12 turns round a sphere, 180 poses; loops to the turn before; rotations off by sigma."""
    k, around = np.arange(180), 15
    a, b = 2 * np.pi * k / around, np.pi * (k + 8) / 196 - np.pi / 2
    t = 10.0 * np.stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)], 1)
    true = se3.from_rt(so3.exp(np.stack([0 * a, -b, a], 1)), t)
    tail, head = np.append(k[:-1], k[:-around]), np.append(k[:-1] + 1, k[:-around] + around)
    sigmas = np.array([0.1] * 3 + [sigma] * 3)
    eta = sigmas * rng.standard_normal((len(tail), 6))
    measured = se3.compose(se3.between(true[tail], true[head]), se3.exp(eta))
    return PoseGraph("se3", true, tail, head, measured, np.tile(np.diag(sigmas**-2), (len(tail), 1, 1)))


@pytest.mark.parametrize("seed", range(2))
def test_where_only_the_chordal_start_will_do(seed: int) -> None:
    """Rotations off by 11 degrees: from there as low as from the truth; from scrambled poses never."""
    rng = np.random.default_rng(seed)
    graph = wound_sphere(rng, 0.2)
    turned = so3.exp(1.5 * rng.standard_normal((180, 3)))
    scrambled = graph.T_world.copy()
    scrambled[1:, :3, :3] = scrambled[1:, :3, :3] @ turned[1:]
    best = solve_graph(graph).chi2
    chordal = solve_graph(graph.at(chordal_start(graph)))
    other = solve_graph(graph.at(scrambled), options=Options(max_iterations=50))
    assert chordal.converged
    assert chordal.chi2 <= best * (1 + 1e-6)
    assert other.chi2 > 1.2 * best
    assert np.isfinite(other.graph.T_world).all()
    assert other.message

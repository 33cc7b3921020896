"""The essential graph: which pairs it has, and why it is no minimum spanning tree (an erratum)."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree

from vslam_ref.estimation.posegraph import PoseGraph, solve_graph
from vslam_ref.geometry import sim3
from vslam_ref.systems.orbslam.essential_graph import COVISIBLE, LOOP, TREE, EssentialEdges, essential_edges
from vslam_ref.systems.orbslam.loops import book


def covisible(rng: np.random.Generator, K: int = 30) -> tuple[np.ndarray, np.ndarray]:
    """Common points of keyframes in a row, and the tree that grows with it: the strongest earlier one."""
    apart = np.abs(np.arange(K)[:, None] - np.arange(K))
    shared = np.triu(rng.poisson(300.0 * np.exp(-apart / 3.0)), 1)
    shared = shared + shared.T
    parent = np.array([-1, *(int(np.argmax(shared[k, :k])) for k in range(1, K))])
    return shared, parent


def weight(pairs: np.ndarray, shared: np.ndarray) -> int:
    return int(shared[pairs[:, 0], pairs[:, 1]].sum())


def pairs(edges: EssentialEdges) -> list[tuple[int, int]]:
    return list(zip(edges.tail.tolist(), edges.head.tolist(), strict=True))


@pytest.mark.parametrize("theta_min", [1, 15, 100, 10**6])
def test_the_edges_are_the_books(theta_min: int) -> None:
    shared, parent = covisible(np.random.default_rng(1))
    loops = [(29, 2), (28, 2), (7, 6)]
    edges = essential_edges(shared, parent, loops, theta_min=theta_min)
    assert pairs(edges) == book.pairs_of(shared, parent.tolist(), loops, theta_min)
    assert (edges.tail < edges.head).all()


def test_each_pair_has_the_first_kind_that_names_it() -> None:
    shared, parent = covisible(np.random.default_rng(2))
    edges = essential_edges(shared, parent, [(29, 2), (int(parent[9]), 9)], theta_min=100)
    kind = dict(zip(pairs(edges), edges.kind.tolist(), strict=True))
    assert kind[2, 29] == LOOP
    assert kind[min(9, int(parent[9])), max(9, int(parent[9]))] == TREE
    assert (edges.kind == TREE).sum() == 29
    strong = edges.kind == COVISIBLE
    assert (shared[edges.tail[strong], edges.head[strong]] >= 100).all()


def test_errata_the_essential_graph_is_no_tree_and_its_tree_is_not_of_least_weight() -> None:
    """A§3.1 calls it the minimum spanning tree of the covisibility graph."""
    shared, parent = covisible(np.random.default_rng(3))
    K = len(parent)
    edges = essential_edges(shared, parent, [(29, 2)])
    # as many edges as keyframes, connected: there is a cycle
    assert len(edges.tail) > K - 1
    grown = np.column_stack([np.arange(1, K), parent[1:]])
    rows, columns = minimum_spanning_tree(shared.astype(float)).nonzero()
    least = np.column_stack([rows, columns])
    assert len(least) == K - 1
    assert weight(least, shared) < 0.1 * weight(grown, shared)
    # what A may mean, the tree of most weight, is not it either: a keyframe cannot hang at a later one
    rows, columns = minimum_spanning_tree(-shared.astype(float)).nonzero()
    assert weight(np.column_stack([rows, columns]), shared) >= weight(grown, shared)
    three = np.array([[0, 10, 50], [10, 0, 60], [50, 60, 0]])
    rows, columns = minimum_spanning_tree(-three.astype(float)).nonzero()
    assert weight(np.column_stack([rows, columns]), three) == 110
    assert weight(np.array([[1, 0], [2, 1]]), three) == 70  # grown: 1 at 0, then 2 at 1


def test_errata_a_tree_spreads_no_error() -> None:
    """Whatever its edges measured, poses agree with all of a tree: chi² is 0, and nothing tells who errs."""
    rng = np.random.default_rng(4)
    K = 12
    parent = np.array([-1, *(int(rng.integers(k)) for k in range(1, K))])
    measured = sim3.random(rng, (K - 1,))
    one = np.broadcast_to(np.eye(7), (K - 1, 7, 7))
    start = np.broadcast_to(np.eye(4), (K, 4, 4)).copy()
    for k in range(1, K):
        start[k] = start[parent[k]] @ measured[k - 1]
    tree = PoseGraph("sim3", start, parent[1:], np.arange(1, K), measured, one)
    assert solve_graph(tree).chi2 < 1e-20
    # one more edge closes a cycle, which does not agree with itself
    more = PoseGraph(
        "sim3",
        start,
        [*parent[1:], 0],
        [*range(1, K), K - 1],
        np.concatenate([measured, sim3.random(rng, (1,))]),
        np.broadcast_to(np.eye(7), (K, 7, 7)),
    )
    assert solve_graph(more).chi2 > 1e-2


def test_without_the_weak_edges_the_graph_still_hangs_together() -> None:
    shared, parent = covisible(np.random.default_rng(5))
    edges = essential_edges(shared, parent, theta_min=1e9)
    links = np.zeros((30, 30))
    links[edges.tail, edges.head] = 1
    assert connected_components(links, directed=False)[0] == 1
    assert len(edges.tail) == 29


@pytest.mark.parametrize(
    ("shared", "parent", "loops", "words"),
    [
        (np.zeros((2, 3)), [-1, 0], (), "need .K, K."),
        ([[0, 3], [4, 0]], [-1, 0], (), r"shared\[0, 1\] is 3 and shared\[1, 0\] is 4"),
        (np.zeros((3, 3)), [-1, 0], (), "2 parents for 3 keyframes"),
        (np.zeros((3, 3)), [-1, 2, 1], (), "keyframe 1 has no way to a root"),
        (np.zeros((3, 3)), [-1, 0, 3], (), "need .K,. of -1"),
        (np.zeros((2, 2)), [-1, 0], [(0, 2)], r"loop \[0, 2\]"),
        (np.zeros((2, 2)), [-1, 0], [(1, 1)], "two different keyframes"),
    ],
)
def test_what_is_no_graph_is_refused(shared: object, parent: object, loops: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        essential_edges(shared, parent, loops)  # type: ignore[arg-type]

"""Closing loops: the similarity of two triangles by Horn's quaternions; edges of the essential graph."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np

from generator.building import Topic, tolerance
from generator.draws import digits
from generator.edges import GROUPS
from generator.exact import Matrix, column, floats, vector
from generator.features import _case as case
from generator.groups import Array, shift, turn
from generator.similarity import Similarity, align, inner, placed, products, rotation, rows

TOPIC, CHAPTER = "loops", 14

NOTES = {
    "scale-forgotten": ("your similarity has no scale: it is rigid", "R for s R"),
    "scale-inverted": ("your scale is turned over", "1/s"),
    "ratio-of-spreads": (
        "your scale is the ratio of the triangles' sizes; least squares give less",
        "(sum |q|^2 / sum |p|^2)^(1/2)",
    ),
    "mirrored": ("your rotation is a mirror image, det(R) = -1", "U V^T with det -1"),
    "translation-not-scaled": ("your translation forgets the scale", "mean y - R mean x"),
    "target-to-source": ("your similarity leads from the target to the source", "S^-1"),
    "not-centred": ("you do not take the means from the points before you turn them", "C = sum y x^T"),
    "rotation-transposed": ("your rotation is the transpose", "R^T"),
    "more-than": (
        "you join pairs with more than theta_min common points; as many are enough",
        "w > theta_min",
    ),
    "no-tree": ("the spanning tree is not among your edges", "loops and w >= theta_min"),
    "loops-forgotten": (
        "the pairs that loops have joined are not among your edges",
        "tree and w >= theta_min",
    ),
    "all-covisible": ("you join all pairs with common points", "w > 0"),
    "tree-only": ("you join no strong pairs beside the tree and the loops", "tree and loops"),
    "least-weight": (
        "your tree is that of least weight: it joins those that have least in common",
        "minimum spanning tree of w",
    ),
}
OF_EXACT = (
    *("scale-forgotten", "scale-inverted", "mirrored", "translation-not-scaled", "target-to-source"),
    *("not-centred", "rotation-transposed"),
)
OF_EDGES = ("more-than", "no-tree", "loops-forgotten", "all-covisible", "tree-only", "least-weight")


def build(rng: np.random.Generator) -> Topic:
    """Both groups."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    reason = "an eigenvector with a gap of order 1, then sums of products of numbers of order 10"
    rule = tolerance(2e-13, reason)
    horn = "Horn's quaternion in 50 digits"
    for flag, noise, count in (("", 0.0, 4), ("noisy", 0.15, 4)):
        cases = [_triangles(rng, noise) for _ in range(count)]
        topic.group("loops.three_points", "eq-umeyama", horn, rule, cases, flags=flag)
    cases = [{"inputs": bad, "expected": {}, "result": "invalid"} for bad in _degenerate()]
    topic.group("loops.three_points", "eq-umeyama", "definition", rule, cases, flags="degenerate")
    exact = tolerance(1e-15, "whole numbers", float32=1e-6)
    for flag, count in (("", 4), ("no_loops", 2)):
        cases = [_graph(rng, flag) for _ in range(count)]
        topic.group("loops.essential_edges", "eq-essential-graph", "sets of pairs", exact, cases, flags=flag)
    return topic


def _triangles(rng: np.random.Generator, noise: float) -> dict[str, Any]:
    """A triangle that is far from a line, and the same through a similarity."""
    base = np.array([[0.0, 0.0, 4.0], [2.0, 0.3, 5.0], [0.4, 1.7, 6.0]])
    source = digits(base + rng.uniform(-0.3, 0.3, (3, 3)))
    xi = [*shift(rng), *0.5 * turn(rng), rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 0.5)]
    S = np.array(floats(GROUPS["sim3"].exp(vector(xi))))
    target = digits(source @ S[:3, :3].T + S[:3, 3] + noise * rng.uniform(-1, 1, (3, 3)))
    notes = (*OF_EXACT, "ratio-of-spreads") if noise else OF_EXACT
    wrong = {note: _found(source, target, note) for note in notes}
    return case({"source": source, "target": target}, "S", _found(source, target), wrong)


def _found(source: Array, target: Array, wrong: str = "") -> Array:
    S = align(source, target, with_scale=True)
    _, moves_x, moves_y = products(source, target)
    if wrong == "target-to-source":
        S = align(target, source, with_scale=True)
    elif wrong == "mirrored":
        # a flat triangle: its mirror image in its own plane fits as well
        S = placed(S.scale, S.R * _mirror(source), source, target)
    elif wrong == "not-centred":
        S = _about_the_origin(source, target)
    elif wrong in ("scale-forgotten", "scale-inverted", "ratio-of-spreads"):
        scale = {"scale-forgotten": mpmath.mpf(1), "scale-inverted": 1 / S.scale}.get(
            wrong, mpmath.sqrt(moves_y / moves_x)
        )
        S = placed(scale, S.R, source, target)
    elif wrong == "rotation-transposed":
        S = placed(S.scale, S.R.T, source, target)
    elif wrong == "translation-not-scaled":
        S = Similarity(S.scale, S.R, placed(mpmath.mpf(1), S.R, source, target).t)
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = floats(S.scale * S.R), floats(S.t)
    return found


def _mirror(points: Array) -> Matrix:
    """Reflection in the direction of the triangle's normal."""
    a, b, c = (mpmath.matrix(p) for p in rows(points))
    u, v = column(b - a), column(c - a)
    n = mpmath.matrix([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])
    return mpmath.eye(3) - 2 * n * n.T / (n.T * n)[0]


def _about_the_origin(source: Array, target: Array) -> Similarity:
    """As if both means were zero; the translation is still that between the means."""
    x, y = rows(source), rows(target)
    C = mpmath.zeros(3, 3)
    for p, q in zip(x, y, strict=True):
        C += mpmath.matrix(q) * mpmath.matrix(p).T
    R = rotation(C)
    return placed(inner(R, C) / sum(v * v for p in x for v in p), R, source, target)


def _degenerate() -> list[dict[str, Any]]:
    """Corners on a line, two corners at one place, all at one place; on either side."""
    triangle = np.array([[0.0, 0.0, 4.0], [2.0, 0.0, 5.0], [0.0, 2.0, 6.0]])
    line = np.outer([0.0, 1.0, 3.0], [1.0, 2.0, -1.0]) + [0.5, 0.0, 3.0]
    double, still = triangle[[0, 0, 1]], np.ones((3, 3))
    pairs = [(line, line + 1.0), (line, triangle), (triangle, line), (double, triangle), (still, triangle)]
    return [{"source": a, "target": b} for a, b in [*pairs, (triangle, still)]]


def _graph(rng: np.random.Generator, flag: str) -> dict[str, Any]:
    """Seven keyframes; one pair has as many common points as are asked for, one less has another."""
    K, theta = 7, int(rng.integers(40, 100))
    shared = np.triu(rng.integers(5, 30, (K, K)), 1)
    parent = [-1, *(int(rng.integers(max(0, k - 2), k)) for k in range(1, K))]
    for k in range(1, K):
        shared[parent[k], k] = rng.integers(theta - 20, theta + 60)
    others = [(i, j) for i in range(K) for j in range(i + 1, K) if parent[j] != i]
    order = rng.permutation(len(others)).tolist()
    for k, more in zip(order, (0, -1, 7, 25), strict=False):
        shared[others[k]] = theta + more
    shared = shared + shared.T
    loops = [] if flag else [list(reversed(others[order[5]])), list(others[order[6]])]
    wrong = {note: _edges(shared.tolist(), parent, loops, theta, note) for note in OF_EDGES}
    inputs = {"shared": shared, "parent": parent, "loops": loops, "theta_min": theta}
    return case(inputs, "edges", _edges(shared.tolist(), parent, loops, theta), wrong)


def _edges(
    shared: list[list[int]], parent: list[int], loops: list[list[int]], theta: int, wrong: str = ""
) -> list[list[int]]:
    K = len(shared)
    tree = {(min(k, p), max(k, p)) for k, p in enumerate(parent) if p >= 0}
    if wrong == "least-weight":
        tree = _least(shared)
    joined = set() if wrong == "loops-forgotten" else {(min(pair), max(pair)) for pair in loops}
    least = {"more-than": theta + 1, "all-covisible": 1, "tree-only": 10**6}.get(wrong, theta)
    strong = {(i, j) for i in range(K) for j in range(i + 1, K) if shared[i][j] >= least}
    return [list(pair) for pair in sorted((set() if wrong == "no-tree" else tree) | joined | strong)]


def _least(shared: list[list[int]]) -> set[tuple[int, int]]:
    """Kruskal's: the lightest pair that joins two parts; of equals the first one."""
    K = len(shared)
    part, tree = list(range(K)), set()
    for _, i, j in sorted((shared[a][b], a, b) for a in range(K) for b in range(a + 1, K)):
        if part[i] != part[j]:
            tree.add((i, j))
            part = [part[i] if p == part[j] else p for p in part]
    return tree

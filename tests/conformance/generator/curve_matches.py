"""Matches on the line of a ray, found back or not: patches planted in two small pictures."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.draws import digits
from generator.exact import Matrix, column, derivative, floats, hat, matrix, vector
from generator.groups import SE3, Array
from generator.views import unit

NOTES = {
    "one-way": (
        "you do not search back: a wrong match on the line fits both pictures exactly",
        "kept = found",
    ),
    "line-forgotten": ("you ask all corners, not those near the line", "distance = infinity"),
    "depth-forgotten": ("you take points behind a camera, or nearer than is allowed", "no gate of depths"),
    "means-kept": ("your patches keep their means: brightness counts", "sum (a - b)^2"),
    "any-patch": ("you take the most similar patch, however little it is so", "no limit"),
}
PARAMS = np.array([60.0, 60.0, 27.5, 19.5])
SIZE = (56, 40)
DISTANCE, NEAR, LIMIT, BACK = 2.0, 1.0, 0.5, 1.5
Corner = tuple[int, int]
NOTICES = {
    "hidden": "one-way",
    "off_line": "line-forgotten",
    "behind": "depth-forgotten",
    "too_near": "depth-forgotten",
    "brighter": "means-kept",
    "nothing": "any-patch",
}
"""Kind of case -> the mistake that it is there for."""


class Pair:
    """Two pictures of noise, and corners in both; patches are planted around corners."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.images = [rng.integers(60, 196, (SIZE[1], SIZE[0])) for _ in range(2)]
        self.corners: list[list[Corner]] = [[], []]
        turn = rng.uniform(-0.03, 0.03, 3)
        side = rng.choice([-1.0, 1.0]) * rng.uniform(0.25, 0.35)
        self.T_b_a = np.array(floats(SE3.exp(vector(digits([side, 0.02, 0.01, *turn])))))

    def room(self, k: int, at: Corner) -> bool:
        """Whether a patch fits there, beside all others."""
        inside = 4 <= at[0] <= SIZE[0] - 4 and 4 <= at[1] <= SIZE[1] - 4
        return inside and all(max(abs(at[0] - x), abs(at[1] - y)) >= 8 for x, y in self.corners[k])

    def put(self, k: int, at: Corner, patch: Array | None = None) -> None:
        """A corner of picture k, with a patch around it or what is there."""
        assert self.room(k, at), (k, at, self.corners[k])
        self.corners[k].append(at)
        if patch is not None:
            self.images[k][at[1] - 4 : at[1] + 4, at[0] - 4 : at[0] + 4] = patch

    def patch(self, k: int, at: Corner) -> Array:
        return np.array(self.images[k][at[1] - 4 : at[1] + 4, at[0] - 4 : at[0] + 4])

    def like(self, patch: Array, noise: int, brighter: int = 0) -> Array:
        return patch + self.rng.integers(-noise, noise + 1, (8, 8)) + brighter


def bearing(at: Any) -> list[Any]:
    """Unit ray of a pixel."""
    k = vector(PARAMS)
    return unit([(at[0] - k[2]) / k[0], (at[1] - k[3]) / k[1], mpf(1)])


def gates(corner: Corner, other: Corner, T: Matrix) -> tuple[Any, Any, Any]:
    """Pixels of a corner of one picture from the line of another's, and the depths along both rays."""
    a = mpmath.matrix(bearing(vector(corner)))
    E = hat([T[0, 3], T[1, 3], T[2, 3]]) * T[:3, :3]
    line = column(E * a)

    def error(u: list[Any]) -> list[Any]:
        return [sum(p * q for p, q in zip(bearing(u), line, strict=True))]

    u = vector(other)
    slope = derivative(error, u)
    M = mpmath.matrix([[-v, w] for v, w in zip(column(T[:3, :3] * a), bearing(u), strict=True)])
    p, q = column(mpmath.lu_solve(M.T * M, M.T * mpmath.matrix([T[0, 3], T[1, 3], T[2, 3]])))
    return abs(error(u)[0]) / mpmath.hypot(slope[0, 0], slope[0, 1]), p, q


def difference(a: Array, b: Array, means: bool) -> float:
    """Sum of squared differences of two patches of whole numbers, with their means or without."""
    d = (a - b).ravel().tolist()
    return sum(v * v for v in d) - (0 if means else sum(d) ** 2 / len(d))


def best(pair: Pair, k: int, corner: Corner, near: float, wrong: str | None = None) -> int:
    """Number of the corner of the other picture that matches a corner of picture k; -1 without one."""
    T = matrix(pair.T_b_a) if k == 0 else matrix(pair.T_b_a) ** -1
    patch, found, least = pair.patch(k, corner), -1, float("inf")
    for number, other in enumerate(pair.corners[1 - k]):
        far, p, q = gates(corner, other, T)
        assert abs(far - DISTANCE) > 0.05, "too near to the limit for a vector"
        cost = difference(patch, pair.patch(1 - k, other), wrong == "means-kept")
        near_line = far <= DISTANCE or wrong == "line-forgotten"
        ahead = (p >= near and q > 0) or wrong == "depth-forgotten"
        if near_line and ahead and cost < least:
            found, least = number, cost
    variation = difference(patch, np.zeros((8, 8), int), False)
    assert found < 0 or abs(least / variation - LIMIT) > 0.05, "too near to the limit for a vector"
    return found if least <= LIMIT * variation or (found >= 0 and wrong == "any-patch") else -1


def answer(pair: Pair, wrong: str | None = None) -> dict[str, Any]:
    """What the search gives for the first corner of the first picture."""
    corner = pair.corners[0][0]
    number = best(pair, 0, corner, NEAR, wrong)
    if number < 0:
        return {"number": -1, "kept": False}
    if wrong == "one-way":
        return {"number": number, "kept": True}
    home = best(pair, 1, pair.corners[1][number], 0.0, wrong)
    back = home >= 0 and np.hypot(*np.subtract(pair.corners[0][home], corner)) <= BACK
    return {"number": number, "kept": bool(back)}


def at_depth(pair: Pair, corner: Corner, p: float) -> Corner:
    """Whole pixel of the second picture nearest to the corner's point at a distance along its ray."""
    x = [p * v for v in bearing(vector(corner))]
    X = matrix(pair.T_b_a) * mpmath.matrix([*x, 1])
    k = vector(PARAMS)
    return round(float(k[0] * X[0] / X[2] + k[2])), round(float(k[1] * X[1] / X[2] + k[3]))


def drawn(rng: np.random.Generator, kind: str) -> Pair:
    """A pair of pictures in which one thing decides."""
    pair = Pair(rng)
    corner = int(rng.integers(24, 32)), int(rng.integers(18, 22))
    pair.put(0, corner)
    patch, true = pair.patch(0, corner), at_depth(pair, corner, float(rng.uniform(1.6, 2.2)))
    step = int(np.sign(true[0] - at_depth(pair, corner, 50.0)[0]))
    if kind == "nothing":
        pair.put(1, true)
    else:
        pair.put(1, true, pair.like(patch, 30, 45 if kind == "brighter" else 0))
    if kind == "hidden":  # the corner there belongs to another one, on the same line
        other = corner[0] - 10 * step, corner[1]
        pair.put(0, other, pair.like(pair.patch(1, true), 3))
    if kind == "off_line":
        pair.put(1, (true[0], true[1] + (8 if true[1] < 20 else -8)), pair.like(patch, 3))
    if kind == "behind":
        far = at_depth(pair, corner, 50.0)
        pair.put(1, (far[0] - 10 * step, far[1]), pair.like(patch, 3))
    if kind == "too_near":
        pair.put(1, at_depth(pair, corner, 0.75), pair.like(patch, 3))
    for k in (0, 1):  # some that are like nothing
        for _ in range(40):
            some = int(rng.integers(4, SIZE[0] - 3)), int(rng.integers(4, SIZE[1] - 3))
            if len(pair.corners[k]) < 5 and pair.room(k, some):
                pair.put(k, some)
    return pair


def usable(rng: np.random.Generator, kind: str) -> Pair:
    """Draw until no corner lies at a limit, and the mistake shows."""
    while True:
        try:
            pair = drawn(rng, kind)
            answers = {note: answer(pair, note) for note in NOTES}
            assert kind == "plain" or answers[NOTICES[kind]] != answer(pair)
        except AssertionError:
            continue
        return pair


def matches(topic: Topic, rng: np.random.Generator) -> None:
    """Add the group."""
    exact = tolerance(0.0, "whole numbers and truth values; no corner lies within 0.05 of a limit")
    oracle = "sums of whole numbers; distances and depths in 50 digits"
    for kind in ("plain", *NOTICES):
        cases = []
        for _ in range(2 if kind == "hidden" else 1):
            pair = usable(rng, kind)
            right = answer(pair)
            wrong = {note: answer(pair, note) for note in NOTES}
            given = {
                "params": PARAMS,
                "images": np.array(pair.images),
                "corners_a": pair.corners[0],
                "corners_b": pair.corners[1],
                "T_b_a": pair.T_b_a,
                "gates": [DISTANCE, NEAR, LIMIT, BACK],
            }
            kept: dict[str, Any] = {}
            for note, value in wrong.items():
                if value != right and value not in kept.values():
                    kept[note] = value
            cases.append({"inputs": given, "expected": right, "mistakes": kept})
        flags = () if kind == "plain" else (kind,)
        topic.group("mapping.match_on_line", "eq-search-back", oracle, exact, cases, flags=flags)

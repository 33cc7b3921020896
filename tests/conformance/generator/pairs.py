"""Two views: distances from epipolar lines, and the middle between two lines, in 50 digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.exact import derivative, floats, hat, matrix, vector
from generator.se3 import case
from generator.views import Array, cameras, in_camera, pixel, scene_point, sensor


def pair_groups(topic: Topic, rng: np.random.Generator) -> None:
    """Distances of a pixel pair from fitting, and midpoints."""
    reason = "a sum of nine products of the size of pixels times pixels, over a gradient: some 1e5 eps"
    rule = tolerance(0.0, reason, absolute=1e-10)
    rule["float32"] = {"relative": 0.0, "absolute": 0.1}
    made = [_pair(rng) for _ in range(10)]
    oracle = "definition, 50 digits"
    topic.group(
        "multiview.epipolar_distance", "eq-epipolar-distance", oracle, rule, [_distance(*p) for p in made]
    )
    topic.group("multiview.sampson_distance", "eq-sampson", oracle, rule, [_sampson(*p) for p in made])
    rule = tolerance(1e-12, "an angle above 0.1 between the lines: eps over its square, and ten operations")
    oracle = "least distance of two lines, 50 digits"
    topic.group("multiview.midpoint", "eq-midpoint", oracle, rule, [_midpoint(rng) for _ in range(10)])
    oracle = "central differences of the definition, 50 digits"
    cases = [_midpoint_jacobian(rng) for _ in range(6)]
    topic.group("multiview.midpoint_jacobian", "eq-midpoint-jacobian", oracle, rule, cases)


def _pair(rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """A fundamental matrix of size 1, rounded, and two pixels some pixels off."""
    T, params, X = cameras(rng, 2, 6.0), sensor(rng), scene_point(rng)
    A, B = matrix(T[0]), matrix(T[1])
    M = B * A**-1
    K = matrix([[params[0], 0, params[2]], [0, params[1], params[3]], [0, 0, 1]])
    E = hat([M[0, 3], M[1, 3], M[2, 3]]) * M[0:3, 0:3]
    F = np.array(floats((K**-1).T * E * K**-1))
    F *= 1.0 / np.abs(F).max()
    uv = np.array([floats(pixel(vector(params), in_camera(pose, X))) for pose in T])
    uv += rng.uniform(1.0, 4.0, (2, 2)) * rng.choice([-1, 1], (2, 2))
    return F, uv[0], uv[1]


def _parts(F: Array, a: Array, b: Array) -> tuple[Any, Any, Any]:
    """u_b^T F u_a, and the lengths of its gradients in a and in b."""
    M, u, v = matrix(F), mpmath.matrix([*vector(a), 1]), mpmath.matrix([*vector(b), 1])
    line_b, line_a = M * u, M.T * v
    value = (v.T * line_b)[0]
    return value, mpmath.sqrt(line_a[0] ** 2 + line_a[1] ** 2), mpmath.sqrt(line_b[0] ** 2 + line_b[1] ** 2)


def _distance(F: Array, a: Array, b: Array) -> dict[str, Any]:
    value, in_a, in_b = _parts(F, a, b)
    back, _, other = _parts(F.T, a, b)
    wrong = {
        "other-image": {"value": value / in_a},
        "algebraic": {"value": value},
        "fundamental-transposed": {"value": back / other},
    }
    return case({"F": F, "uv_a": a, "uv_b": b}, "value", value / in_b, wrong)


def _sampson(F: Array, a: Array, b: Array) -> dict[str, Any]:
    value, in_a, in_b = _parts(F, a, b)
    wrong = {"one-image": {"value": value / in_b}, "algebraic": {"value": value}}
    return case({"F": F, "uv_a": a, "uv_b": b}, "value", value / mpmath.sqrt(in_a**2 + in_b**2), wrong)


def _lines(rng: np.random.Generator) -> tuple[Array, Array, Array, Array]:
    """Two lines, a point and a direction each, that are far from parallel."""
    while True:
        p, d, q, e = rng.uniform(-2, 2, (4, 3))
        if np.linalg.norm(np.cross(d, e)) > 0.1 * np.linalg.norm(d) * np.linalg.norm(e):
            return p, d, q, e


def _feet(p: list[Any], d: list[Any], q: list[Any], e: list[Any]) -> tuple[Any, Any]:
    """Ends of the common perpendicular."""
    P, D, Q, E = (mpmath.matrix(v) for v in (p, d, q, e))
    between = Q - P
    M = mpmath.matrix([[(D.T * D)[0], -(D.T * E)[0]], [(D.T * E)[0], -(E.T * E)[0]]])
    s = mpmath.lu_solve(M, mpmath.matrix([(D.T * between)[0], (E.T * between)[0]]))
    return P + D * s[0], Q + E * s[1]


def _middle(p: list[Any], d: list[Any], q: list[Any], e: list[Any]) -> list[Any]:
    a, b = _feet(p, d, q, e)
    return list((a + b) * mpf("0.5"))


def _midpoint(rng: np.random.Generator) -> dict[str, Any]:
    lines = _lines(rng)
    exact = [vector(v) for v in lines]
    wrong = {"on-the-first-line": {"X": list(_feet(*exact)[0])}}
    return case(dict(zip(("p_a", "b_a", "p_b", "b_b"), lines, strict=True)), "X", _middle(*exact), wrong)


def _midpoint_jacobian(rng: np.random.Generator) -> dict[str, Any]:
    lines = _lines(rng)
    p, d, q, e = (vector(v) for v in lines)
    length = mpmath.norm(mpmath.matrix(d))
    J_p, J_d = derivative(lambda v: _middle(v, d, q, e), p), derivative(lambda v: _middle(p, v, q, e), d)
    right = {"J_p_a": floats(J_p), "J_b_a": floats(J_d)}
    wrong = {"length-forgotten": {"J_p_a": right["J_p_a"], "J_b_a": floats(J_d * length)}}
    inputs = dict(zip(("p_a", "b_a", "p_b", "b_b"), lines, strict=True))
    return {"inputs": inputs, "expected": right, "mistakes": wrong}

"""Two views: what a pair costs, how many samples, which model; from the definitions in 50 digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.draws import digits
from generator.exact import derivative, expm, floats, hat, matrix, vector
from vslam_ref.arrays import Array


def cost_groups(topic: Topic, rng: np.random.Generator) -> None:
    """Distances, depths, costs, draws and criteria."""
    few = tolerance(1e-13, "a few dozen operations, a condition below 100")
    cases = [_map_distance(rng) for _ in range(10)]
    oracle = "definition, 50 digits"
    topic.group("two_views.homography_distance", "eq-homography-sampson", oracle, few, cases)
    few = tolerance(1e-12, "some dozen operations, a length of the gradient above 0.1")
    cases = [_turn_slope(rng) for _ in range(10)]
    oracle = "central differences of the definition, 50 digits"
    topic.group("two_views.sampson_turn_jacobian", "eq-sampson-jacobian", oracle, few, cases)
    oracle = "the scene's own point, 50 digits"
    near = tolerance(1e-12, "a parallax above 0.1: eps over its square", float32=1e-2)
    topic.group("two_views.depths", "eq-two-view-depths", oracle, near, [_depths(rng) for _ in range(10)])
    rule = tolerance(
        1e-11, "squares of differences of the size of 0.01: 100 eps over it, twice", float32=1e-2
    )
    for flag in ("front", "behind"):
        cases = [_cost(rng, flag == "behind") for _ in range(8)]
        oracle = "definition, 50 digits"
        topic.group("two_views.cheirality_cost", "eq-cheirality-cost", oracle, rule, cases, flags=(flag,))
    few = tolerance(1e-9, "1 - w^m keeps the digits of w^m, which is above 2e-6, to eps over it")
    oracle = "definition, 50 digits"
    topic.group("two_views.draws", "eq-draws", oracle, few, [_draws(rng, k) for k in range(8)])
    few = tolerance(1e-14, "a sum of a dozen numbers")
    topic.group("two_views.truncated_cost", "eq-msac", oracle, few, [_msac(rng) for _ in range(8)])
    topic.group(
        "two_views.model_criterion", "eq-gric", oracle, few, [_gric(rng, 2 + k % 2) for k in range(8)]
    )
    few = tolerance(1e-12, "some dozen operations, a length of the gradient above 0.1")
    cases = [_direction_slope(rng) for _ in range(10)]
    oracle = "central differences of the definition, 50 digits"
    topic.group("two_views.sampson_direction_derivative", "eq-sampson-jacobian", oracle, few, cases)
    few, oracle = tolerance(1e-14, "a sum of a dozen numbers"), "definition, 50 digits"
    far = [_msac(rng, far=200.0) for _ in range(4)]
    topic.group("two_views.truncated_cost", "eq-msac", oracle, few, far, flags="far_outliers")


def answers(inputs: dict[str, Any], name: str, right: Any, wrong: dict[str, Any]) -> dict[str, Any]:
    """A case, with the mistakes whose answers differ clearly from the right one and from each other."""
    kept: dict[str, Any] = {}
    expected = np.asarray(floats(right), dtype=np.float64)
    for note, value in wrong.items():
        numbers = np.asarray(floats(value), dtype=np.float64)
        others = (expected, *(np.asarray(v) for v in kept.values()))
        if all(np.abs(numbers - other).max() > 1e-3 * np.abs(expected).max() for other in others):
            kept[note] = numbers.tolist()
    case: dict[str, Any] = {"inputs": inputs, "expected": {name: expected.tolist()}}
    return {**case, "mistakes": {n: {name: v} for n, v in kept.items()}} if kept else case


def _mapped(H: Any, x: list[Any]) -> list[Any]:
    Y = H * mpmath.matrix([*x, 1])
    return [Y[0] / Y[2], Y[1] / Y[2]]


def _map_cost(H: Any, a: list[Any], b: list[Any]) -> Any:
    """Squared Sampson distance from a map."""
    e = mpmath.matrix(_mapped(H, a)) - mpmath.matrix(b)
    J = derivative(lambda x: _mapped(H, x), a)
    return (e.T * (mpmath.eye(2) + J * J.T) ** -1 * e)[0]


def _map_distance(rng: np.random.Generator) -> dict[str, Any]:
    H = digits(np.eye(3) + rng.uniform(-0.3, 0.3, (3, 3)), 6)
    a = digits(rng.uniform(-0.5, 0.5, 2), 6)
    M, x = matrix(H), vector(a)
    b = digits(np.array(floats(_mapped(M, x))) + rng.uniform(-0.05, 0.05, 2), 6)
    y, back = vector(b), M**-1
    one = sum((p - q) ** 2 for p, q in zip(_mapped(M, x), y, strict=True))
    other = sum((p - q) ** 2 for p, q in zip(_mapped(back, y), x, strict=True))
    wrong = {
        "one-image": one,
        "both-transfers": one + other,
        "homography-inverted": _map_cost(back, x, y),
    }
    inputs = {"H": H.tolist(), "x_a": a.tolist(), "x_b": b.tolist()}
    return answers(inputs, "squared", _map_cost(M, x, y), wrong)


def _motion(rng: np.random.Generator) -> tuple[Any, Any]:
    t = mpmath.matrix(vector(rng.normal(size=3)))
    return expm(hat(vector(rng.normal(0, 0.2, 3)))), t / mpmath.norm(t)


def _given(R: Any, t: Any) -> Array:
    """The motion as doubles; what follows starts from these."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = floats(R), [float(v) for v in t]
    return T


def _sampson(R: Any, t: Any, a: list[Any], b: list[Any]) -> tuple[Any, Any]:
    """Numerator and length of the gradient."""
    E = hat(list(t)) * R
    p, q = mpmath.matrix([*a, 1]), mpmath.matrix([*b, 1])
    line_b, line_a = E * p, E.T * q
    return (q.T * line_b)[0], mpmath.sqrt(line_b[0] ** 2 + line_b[1] ** 2 + line_a[0] ** 2 + line_a[1] ** 2)


def _turn_slope(rng: np.random.Generator) -> dict[str, Any]:
    T = _given(*_motion(rng))
    R, t = matrix(T[:3, :3]), mpmath.matrix(vector(T[:3, 3]))
    t = t / mpmath.norm(t)
    a, b = (digits(rng.uniform(-0.5, 0.5, 2), 6) for _ in range(2))
    x, y = vector(a), vector(b)

    def slope(part: Any, right: bool = False) -> list[Any]:
        def of(phi: list[Any]) -> list[Any]:
            return [part(*_sampson(R * expm(hat(phi)) if right else expm(hat(phi)) * R, t, x, y))]

        M = derivative(of, [mpf(0)] * 3)
        return [M[0, j] for j in range(3)]

    length = _sampson(R, t, x, y)[1]
    wrong = {
        "perturbed-from-the-right": slope(lambda e, g: e / g, True),
        "numerator-only": [v / length for v in slope(lambda e, g: e)],
    }
    e, g = _sampson(R, t, x, y)
    inputs = {"T_b_a": T.tolist(), "xn_a": a.tolist(), "xn_b": b.tolist()}
    case = answers(inputs, "J_turn", slope(lambda e, g: e / g), wrong)
    for answer in (case["expected"], *case.get("mistakes", {}).values()):
        answer["value"] = float(e / g)
    return case


def _direction_slope(rng: np.random.Generator) -> dict[str, Any]:
    T = _given(*_motion(rng))
    R, t = matrix(T[:3, :3]), mpmath.matrix(vector(T[:3, 3]))
    given = digits(np.cross(T[:3, 3], rng.uniform(-1, 1, 3)), 15)
    v = mpmath.matrix(vector(given))
    a, b = (digits(rng.uniform(-0.5, 0.5, 2), 6) for _ in range(2))
    x, y = vector(a), vector(b)

    def slope(part: Any) -> Any:
        def of(step: list[Any]) -> list[Any]:
            moved = t + step[0] * v
            return [part(*_sampson(R, moved / mpmath.norm(moved), x, y))]

        return derivative(of, [mpf(0)])[0]

    wrong = {"numerator-only": slope(lambda e, g: e) / _sampson(R, t, x, y)[1]}
    inputs = {"T_b_a": T.tolist(), "xn_a": a.tolist(), "xn_b": b.tolist(), "v": given.tolist()}
    return answers(inputs, "slope", slope(lambda e, g: e / g), wrong)


def _depths(rng: np.random.Generator) -> dict[str, Any]:
    while True:
        R, t = _motion(rng)
        X = mpmath.matrix(vector(rng.uniform(-1, 1, 3) * [1, 1, 1] + [0, 0, 4]))
        Y = R * X + t
        if Y[2] > 1 and mpmath.norm(hat(list(R * X)) * Y) > mpf("0.1") * mpmath.norm(X) * mpmath.norm(Y):
            break
    inputs = {"T_b_a": _given(R, t).tolist(), "xn_a": floats([X[0] / X[2], X[1] / X[2]]),
              "xn_b": floats([Y[0] / Y[2], Y[1] / Y[2]])}  # fmt: skip
    wrong = {"swapped": [Y[2], X[2]], "along-the-rays": [mpmath.norm(X), mpmath.norm(Y)]}
    return answers(inputs, "depths", [X[2], Y[2]], wrong)


def _cost(rng: np.random.Generator, behind: bool) -> dict[str, Any]:
    """A pair some hundredths off; the point in front of both cameras, or behind both."""
    while True:
        R, t = _motion(rng)
        X = mpmath.matrix(vector(rng.uniform(-1, 1, 3) + [0, 0, 4]))
        Y = R * X + (-t if behind else t)
        if Y[2] < 1:
            continue
        T = _given(R, t)
        a = digits(floats([X[0] / X[2], X[1] / X[2]]), 8)
        b = digits(np.array(floats([Y[0] / Y[2], Y[1] / Y[2]])) + rng.uniform(-0.01, 0.01, 2), 8)
        Rm, tm = matrix(T[:3, :3]), mpmath.matrix(vector(T[:3, 3]))
        x, y = vector(a), vector(b)
        p, q = Rm * mpmath.matrix([*x, 1]), mpmath.matrix([*y, 1])
        n = hat(list(p)) * q
        sides = [(n.T * (hat(list(ray)) * tm))[0] for ray in (q, p)]
        if min(abs(v) for v in sides) > mpf("1e-3") and all((v < 0) == behind for v in sides):
            break
    e, g = _sampson(Rm, tm / mpmath.norm(tm), x, y)
    sigma = float(digits(rng.uniform(0.002, 0.02), 3))
    line, infinity = (e / g / mpf(sigma)) ** 2, _map_cost(Rm, x, y) / mpf(sigma) ** 2
    inputs = {"T_b_a": T.tolist(), "xn_a": a.tolist(), "xn_b": b.tolist(), "sigma": sigma}
    return answers(
        inputs, "squared", infinity if behind else line, {"side-forgotten": line} if behind else {}
    )


def _draws(rng: np.random.Generator, k: int) -> dict[str, Any]:
    w, p = float(digits(rng.uniform(0.2, 0.8), 4)), float(digits(rng.choice([0.9, 0.95, 0.99, 0.999]), 4))
    m = (4, 5, 7, 8)[k % 4]
    miss = mpmath.log(1 - mpf(p))
    wrong = {
        "share-of-wrong-pairs": miss / mpmath.log(1 - (1 - mpf(w)) ** m),
        "one-clean-pair": miss / mpmath.log((1 - mpf(w)) ** m),
    }
    right = miss / mpmath.log(1 - mpf(w) ** m)
    return answers({"share": w, "size": m, "confidence": p}, "draws", right, wrong)


def _msac(rng: np.random.Generator, far: float = 0.0) -> dict[str, Any]:
    """Some squares; the first two are larger than any power of the limit, on demand."""
    e = digits(rng.exponential(2.0, 12), 6)
    e[:2] += far
    most = float(digits(rng.uniform(2.0, 6.0), 4))
    squared, c = vector(e), mpf(most)
    wrong = {
        "counted": c * sum(v > c for v in squared) / len(squared),
        "not-truncated": sum(squared) / len(squared),
    }
    right = sum(min(v, c) for v in squared) / len(squared)
    return answers({"squared": e.tolist(), "most": most}, "cost", right, wrong)


def _gric(rng: np.random.Generator, dimension: int) -> dict[str, Any]:
    e = digits(rng.exponential(2.5, 12), 6)
    unknowns = 8 if dimension == 2 else 5
    squared, n = vector(e), 12

    def criterion(cap: int, d: int) -> Any:
        fit = sum(min(v, mpf(cap)) for v in squared)
        return fit + mpmath.log(4) * d * n + mpmath.log(4 * n) * unknowns

    cap = 2 * (4 - dimension)
    wrong = {"unknowns-only": criterion(cap, 0), "same-threshold": criterion(2, dimension)}
    inputs = {"squared": e.tolist(), "dimension": dimension, "unknowns": unknowns}
    return answers(inputs, "criterion", criterion(cap, dimension), wrong)

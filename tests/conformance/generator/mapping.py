"""Mapping: where two rays come closest, what a depth is worth, and the curve of a ray, in 50 digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.curve_matches import NOTES as MATCH_NOTES
from generator.curve_matches import matches
from generator.draws import digits
from generator.exact import Matrix, column, derivative, floats, hat, matrix, vector
from generator.groups import SE3, Array
from generator.lenses import camera, project, unproject
from generator.se3 import case
from generator.views import pixel, sensor, unit

TOPIC, CHAPTER = "mapping", 11

NOTES = {
    "pose-inverted": ("your pose maps the other way: X_b = T_b_a X_a", "T_b_a^-1"),
    "swapped": ("your distances are exchanged: that along the first ray comes first", "(q, p)"),
    "not-turned": ("your first ray is not turned into the second camera", "a for R a"),
    "no-parallax": (
        "your result lacks the parallax: rays that cross at a small angle are worth little",
        "sin = 1",
    ),
    "cosine-forgotten": (
        "your first ray's own error counts in full; only its part along the ray does",
        "hypot(r_a eps_a, r_b eps_b) / sin",
    ),
    "other-ray-only": ("your first ray does not err", "r_b eps_b / sin"),
    "along-axis": ("your sigma is that of the coordinate z; along the ray was asked for", "(cov_zz)^(1/2)"),
    "one-pixel": ("your sigma is for one pixel of noise", "sigma = 1"),
    "midpoint": ("your point is the middle between the rays, not that of least squared pixels", "midpoint"),
    "straight-line": ("your ray appears as a straight line: the lens bends it", "pinhole for the lens"),
    "lens-on-one-side": ("you undistort the pixel, but do not distort its match", "f x/z + c"),
    "depth-for-distance": ("your length is the coordinate z; along the ray was asked for", "X = z (x, y, 1)"),
    "slope-without-lens": (
        "your distance has the slope of a pinhole: the lens changes how far a pixel reaches",
        "|e| / |de/du|, du of a pinhole",
    ),
    "not-divided": ("your distance is the algebraic error; divide by its slope", "|b^T E a|"),
    "translations": (
        "you compare translations of poses; the camera stands at -R^T t",
        "min |t_k - t| / depth",
    ),
    "mean-depth": ("you divide by the mean depth; the median was asked for", "mean of z"),
    "distance-for-depth": ("you divide by the median distance; depth is along the axis", "median |X|"),
    "farthest": ("your keyframe is the farthest", "max for min"),
    **MATCH_NOTES,
}


def build(rng: np.random.Generator) -> Topic:
    """All groups of mapping."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    why = "two equations, their condition 1 / parallax^2 below 1e3, times some 100 eps"
    rule = tolerance(1e-11, why, float32=1e-2)
    oracle = "normal equations of two lines, 50 digits"
    topic.group("mapping.ray_depths", "eq-ray-depths", oracle, rule, [_depths(rng) for _ in range(10)])
    cases = [_sigma(rng) for _ in range(10)]
    fine = tolerance(1e-13, "a dozen operations; the sine of a small angle")
    topic.group("mapping.depth_sigma", "eq-depth-sigma", "derivatives of a crossing, 50 digits", fine, cases)
    rule = tolerance(1e-8, "a minimum, to the condition of J times eps by its gradient", float32=1e-2)
    cases = [_triangulated(rng) for _ in range(6)]
    oracle = "Newton's iteration on the gradient, 50 digits"
    topic.group("mapping.triangulated_depth", "eq-triangulation-covariance", oracle, rule, cases)
    for model in ("pinhole", "fov", "radtan"):
        _curves(topic, rng, model)
    cases = [_keyframe(rng) for _ in range(8)]
    rule = tolerance(1e-13, "centres and depths: some hundred operations")
    topic.group("mapping.keyframe_distance", "eq-kept-pose", "exact poses, 50 digits", rule, cases)
    matches(topic, rng)
    return topic


def _pair(rng: np.random.Generator) -> Array:
    """Pose of a second camera some decimetres beside the first, turned by some degrees; 12 digits."""
    t = rng.choice([-1, 1]) * rng.uniform([0.3, -0.2, -0.2], [0.8, 0.2, 0.2])
    T = np.array(floats(SE3.exp(vector(digits([*t, *rng.uniform(-0.3, 0.3, 3)])))))
    return T


def _ahead(rng: np.random.Generator) -> Array:
    """A point in front of both cameras."""
    z = rng.uniform(2.0, 6.0)
    return digits([*(z * rng.uniform(-0.25, 0.25, 2)), z])


def _moved(T: Any, X: Any) -> list[Any]:
    there = T * mpmath.matrix([*X, 1])
    return [there[0], there[1], there[2]]


def _closest(a: list[Any], b: list[Any], T: Matrix) -> list[Any]:
    """Distances along both rays, from the normal equations of q b - p R a = t."""
    M = mpmath.matrix([[-v, w] for v, w in zip(_turned(T, a), b, strict=True)])
    t = mpmath.matrix([T[0, 3], T[1, 3], T[2, 3]])
    return column(mpmath.lu_solve(M.T * M, M.T * t))


def _turned(T: Matrix, a: list[Any]) -> list[Any]:
    return column(T[:3, :3] * mpmath.matrix(a))


def _depths(rng: np.random.Generator) -> dict[str, Any]:
    """Rays to nearly the same point: they pass each other by some milliradians."""
    T, X = _pair(rng), vector(_ahead(rng))
    exact = matrix(T)
    off = vector(digits(rng.normal(0, 3e-3, 3)))
    a, b = (
        np.array(floats(unit(v))) for v in (X, [p + q for p, q in zip(_moved(exact, X), off, strict=True)])
    )
    ra, rb = unit(vector(a)), unit(vector(b))
    right = _closest(ra, rb, exact)
    c = sum(p * q for p, q in zip(_turned(exact, ra), rb, strict=True))
    wrong = {
        "pose-inverted": _closest(ra, rb, exact**-1),
        "swapped": right[::-1],
        "not-turned": _closest(column(exact[:3, :3].T * mpmath.matrix(ra)), rb, exact),
        "no-parallax": [v * (1 - c * c) for v in right],
    }
    return case({"a": a, "b": b, "T_b_a": T}, "depths", right, {k: {"depths": v} for k, v in wrong.items()})


def _sigma(rng: np.random.Generator) -> dict[str, Any]:
    """A crossing in the plane: camera a at 0 looks along z; b stands where its ray has angle and length."""
    r = digits(rng.uniform(1.0, 8.0, 2))
    parallax = float(digits(np.exp(rng.uniform(np.log(0.01), np.log(0.8)))))
    eps = digits(rng.uniform(5e-4, 3e-3, 2))
    r_a, r_b, alpha = mpf(r[0]), mpf(r[1]), mpf(parallax)

    def crossing(turns: list[Any]) -> list[Any]:
        u = [mpmath.sin(turns[0]), mpmath.cos(turns[0])]
        at = [-r_b * mpmath.sin(alpha), r_a - r_b * mpmath.cos(alpha)]  # b's place: r_b before the point
        v = [mpmath.sin(alpha + turns[1]), mpmath.cos(alpha + turns[1])]
        return [(at[0] * v[1] - at[1] * v[0]) / (u[0] * v[1] - u[1] * v[0])]

    slope = derivative(crossing, [mpf(0), mpf(0)])
    e_a, e_b = (mpf(v) for v in eps)
    right = mpmath.hypot(slope[0, 0] * e_a, slope[0, 1] * e_b)
    by_b = r_b * e_b / mpmath.sin(alpha)
    wrong = {
        "no-parallax": mpmath.hypot(r_b * e_b, r_a * e_a * mpmath.cos(alpha)),
        "cosine-forgotten": mpmath.hypot(by_b, r_a * e_a / mpmath.sin(alpha)),
        "other-ray-only": by_b,
    }
    kept = {note: {"sigma": v} for note, v in wrong.items() if abs(v / right - 1) > 1e-6}
    given = {"depths": r, "parallax": parallax, "eps_a": float(eps[0]), "eps_b": float(eps[1])}
    return case(given, "sigma", right, kept)


def _triangulated(rng: np.random.Generator) -> dict[str, Any]:
    params, T, X, sigma = digits(sensor(rng)), _pair(rng), _ahead(rng), float(digits(rng.uniform(0.3, 2.5)))
    k, exact = vector(params), matrix(T)
    uv = [
        digits(floats(pixel(k, v)) + rng.normal(0, sigma, 2)) for v in (vector(X), _moved(exact, vector(X)))
    ]
    a, b = (unit([(u[0] - k[2]) / k[0], (u[1] - k[3]) / k[1], mpf(1)]) for u in map(vector, uv))
    right = _best(k, exact, [*vector(uv[0]), *vector(uv[1])], vector(X), a, mpf(sigma))
    X_best, J = right.pop("point"), right.pop("slopes")
    cov = mpf(sigma) ** 2 * (J.T * J) ** -1
    p, q = _closest(a, b, exact)
    there = [mpf(x) for x in column(exact**-1 * mpmath.matrix([*(q * v for v in b), 1]))[:3]]
    middle = [(p * v + w) / 2 for v, w in zip(a, there, strict=True)]
    wrong = {
        "along-axis": {"X": X_best, "sigma": mpmath.sqrt(cov[2, 2])},
        "one-pixel": {"X": X_best, "sigma": right["sigma"] / mpf(sigma)},
        "midpoint": {"X": middle, "sigma": right["sigma"]},
    }
    expected = {"X": floats(X_best), "sigma": float(right["sigma"])}
    mistakes = {n: {"X": floats(v["X"]), "sigma": float(v["sigma"])} for n, v in wrong.items()}
    given = {"params": params, "uv_a": uv[0], "uv_b": uv[1], "T_b_a": T, "sigma_px": sigma}
    return {"inputs": given, "expected": expected, "mistakes": mistakes}


def _best(k: list[Any], T: Matrix, flat: list[Any], x: list[Any], a: list[Any], sigma: Any) -> dict[str, Any]:
    """Point of least squared pixels in both views, its Jacobian, and its sigma along the bearing a."""

    def seen(v: list[Any]) -> list[Any]:
        return [*pixel(k, v), *pixel(k, _moved(T, v))]

    def gradient(v: list[Any]) -> list[Any]:
        r = mpmath.matrix([p - q for p, q in zip(seen(v), flat, strict=True)])
        return column(derivative(seen, v).T * r)

    for _ in range(15):
        step = mpmath.lu_solve(derivative(gradient, x), -mpmath.matrix(gradient(x)))
        x = [x[i] + step[i] for i in range(3)]
    assert max(abs(v) for v in gradient(x)) < mpf("1e-18")
    J = derivative(seen, x)
    along = mpmath.matrix(a)
    variance = (along.T * (J.T * J) ** -1 * along)[0]
    return {"point": x, "slopes": J, "sigma": sigma * mpmath.sqrt(variance)}


def _curves(topic: Topic, rng: np.random.Generator, model: str) -> None:
    """Points of a ray in the other picture, and how far pixels are from there."""
    rule = tolerance(1e-12, "an inverse lens, a motion, a lens: some hundred operations, condition below 30")
    oracle = "the lens's definition and Newton's iteration, 50 digits"
    cases = [_on_curve(rng, model) for _ in range(4)]
    topic.group("mapping.on_curve", "eq-curve-distance", oracle, rule, cases, flags=(model,))
    why = "a small error over its slope: it cancels to 1e-3 of its terms"
    rule = tolerance(1e-10, why, absolute=1e-10, float32=1e-2)
    cases = [_curve_distance(rng, model) for _ in range(5)]
    oracle = "differences of the error along the picture, 50 digits"
    topic.group("mapping.curve_distance", "eq-curve-distance", oracle, rule, cases, flags=(model,))


def _on_curve(rng: np.random.Generator, model: str) -> dict[str, Any]:
    params, T, X = digits(camera(rng, model)), _pair(rng), _ahead(rng)
    k, exact = vector(params), matrix(T)
    uv = digits(floats(project(model, k, vector(X))))
    distance = float(digits(np.linalg.norm(X)))
    bearing = unproject(model, k, vector(uv), X)
    plain = unproject("pinhole", k[:4], vector(uv), X)

    def there(ray: list[Any], T: Matrix, lens: str, stretch: Any = 1) -> list[Any]:
        X = [stretch * mpf(distance) * v for v in ray]
        return project(lens, k if lens == model else k[:4], _moved(T, X))

    right = there(bearing, exact, model)
    wrong = {
        "pose-inverted": there(bearing, exact**-1, model),
        "depth-for-distance": there(bearing, exact, model, 1 / bearing[2]),
    }
    if model != "pinhole":
        wrong["straight-line"] = there(plain, exact, "pinhole")
        wrong["lens-on-one-side"] = there(bearing, exact, "pinhole")
    given = {"model": model, "params": params, "uv_a": uv, "distance": distance, "T_b_a": T}
    return case(given, "uv", right, {note: {"uv": v} for note, v in wrong.items()})


def _curve_distance(rng: np.random.Generator, model: str) -> dict[str, Any]:
    params, T, X = digits(camera(rng, model)), _pair(rng), _ahead(rng)
    k, exact = vector(params), matrix(T)
    bearing = np.array(floats(unit(vector(X))))
    a, there = unit(vector(bearing)), _moved(exact, vector(X))
    near = np.array(floats(there))
    uv = digits(
        np.array(floats(project(model, k, there))) + rng.uniform(2.0, 6.0, 2) * rng.choice([-1, 1], 2)
    )

    def distance(T: Matrix, ray_model: str, slope_model: str) -> tuple[Any, Any]:
        E = hat([T[0, 3], T[1, 3], T[2, 3]]) * T[:3, :3]
        line = column(E * mpmath.matrix(a))

        def error(lens: str, u: list[Any]) -> Any:
            b = unproject(lens, k if lens == model else k[:4], u, near)
            return sum(p * q for p, q in zip(b, line, strict=True))

        e = error(ray_model, vector(uv))
        slope = derivative(lambda u: [error(slope_model, u)], vector(uv))
        return abs(e), abs(e) / mpmath.hypot(slope[0, 0], slope[0, 1])

    algebraic, right = distance(exact, model, model)
    wrong = {"not-divided": algebraic, "pose-inverted": distance(exact**-1, model, model)[1]}
    if model != "pinhole":
        wrong["straight-line"] = distance(exact, "pinhole", "pinhole")[1]
        wrong["slope-without-lens"] = distance(exact, model, "pinhole")[1]
    given = {"model": model, "params": params, "bearing_a": bearing, "uv_b": uv, "T_b_a": T}
    kept = {note: {"value": v} for note, v in wrong.items() if abs(v / right - 1) > 1e-4}
    return case(given, "value", right, kept)


def _keyframe(rng: np.random.Generator) -> dict[str, Any]:
    """Four keyframes and a camera around a place, and the points that it saw."""
    each = [SE3.exp(vector(digits([*rng.uniform(-1, 1, 3), *rng.uniform(-0.6, 0.6, 3)]))) for _ in range(5)]
    poses = np.array([floats(T) for T in each])
    exact = [matrix(T) for T in poses]
    depth = np.sort(rng.uniform(2.0, 9.0, 7))
    in_camera = [digits([*(z * rng.uniform(-0.6, 0.6, 2)), z]) for z in depth]
    X = np.array([floats(_moved(exact[4] ** -1, vector(p))) for p in in_camera])
    seen = [_moved(exact[4], vector(p)) for p in X]
    z, length = sorted(p[2] for p in seen), sorted(mpmath.sqrt(sum(v * v for v in p)) for p in seen)

    def apart(places: list[list[Any]]) -> list[Any]:
        last = places.pop()
        return [mpmath.sqrt(sum((p - q) ** 2 for p, q in zip(c, last, strict=True))) for c in places]

    away = apart([[(T**-1)[i, 3] for i in range(3)] for T in exact])
    shifts = apart([[T[i, 3] for i in range(3)] for T in exact])
    right = min(away) / z[3]
    wrong = {
        "translations": min(shifts) / z[3],
        "mean-depth": min(away) / (sum(z) / len(z)),
        "distance-for-depth": min(away) / length[3],
        "farthest": max(away) / z[3],
    }
    given = {"T_kfs": poses[:4], "pose": poses[4], "X_world": X}
    return case(given, "value", right, {note: {"value": v} for note, v in wrong.items()})

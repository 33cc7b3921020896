"""Scenes of cameras and points, and the groups whose oracles take more than a line.

Poses from three points come from all roots of Grunert's quartic, the best point of several views from
Newton's iteration on the sum of squares, both in 50 digits.
"""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.exact import derivative, floats, matrix, vector
from generator.groups import motion
from generator.se3 import case
from vslam_ref.arrays import Array

EPS = float(np.finfo(np.float64).eps)


def looking(rng: np.random.Generator, centre: Array, at: Array) -> Array:
    """Pose T_cam_world of a camera at a place that looks roughly at a point, rolled at will."""
    z = (at - centre) / np.linalg.norm(at - centre)
    x = np.cross(rng.standard_normal(3), z)
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(z, x), z])
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, -R @ centre
    return T


def cameras(rng: np.random.Generator, views: int, distance: float) -> Array:
    """Poses around a place, some metres apart, that look at the scene around the origin."""
    centres = np.array([0.0, 0.0, -distance]) + rng.uniform(-1.0, 1.0, (views, 3))
    while np.linalg.norm((centres[0] - centres[1])[:2]) < 0.8:
        centres = np.array([0.0, 0.0, -distance]) + rng.uniform(-1.0, 1.0, (views, 3))
    return np.stack([looking(rng, c, rng.uniform(-0.3, 0.3, 3)) for c in centres])


def scene_point(rng: np.random.Generator) -> Array:
    """A point near the origin."""
    return rng.uniform(-1.2, 1.2, 3)


def in_camera(T: Array, X: Any) -> list[Any]:
    """Exact coordinates in a camera."""
    moved = matrix(T) * mpmath.matrix([*vector(X), 1])
    return [moved[0], moved[1], moved[2]]


def unit(v: list[Any]) -> list[Any]:
    """Direction."""
    length = mpmath.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def rays(T: Array, X: Any) -> list[list[Any]]:
    """Exact unit bearings of a point in all cameras."""
    return [unit(in_camera(pose, X)) for pose in T]


def pixel(params: list[Any], X: list[Any]) -> list[Any]:
    """Pinhole."""
    return [params[0] * X[0] / X[2] + params[2], params[1] * X[1] / X[2] + params[3]]


def sensor(rng: np.random.Generator) -> Array:
    """fx, fy, cx, cy."""
    f = rng.uniform(400, 600)
    return np.array([f, f * rng.uniform(0.95, 1.05), rng.uniform(300, 340), rng.uniform(220, 260)])


def optimal_groups(topic: Topic, rng: np.random.Generator) -> None:
    """The best point of noisy pixels."""
    reason = (
        "a minimum is known to the root of eps in cost, but to the condition of J times eps by its gradient"
    )
    rule = tolerance(1e-8, reason, float32=1e-2)
    oracle = "Newton's iteration on the gradient, 50 digits"
    for flag, views in (("two_views", 2), ("many_views", 4)):
        cases = [_optimal(rng, views) for _ in range(8)]
        topic.group(
            "multiview.triangulate_optimal", "eq-triangulation-optimal", oracle, rule, cases, flags=(flag,)
        )


def _optimal(rng: np.random.Generator, views: int) -> dict[str, Any]:
    T, X, params = cameras(rng, views, distance=6.0), scene_point(rng), sensor(rng)
    k = vector(params)
    uv = np.array([floats(pixel(k, in_camera(pose, X))) for pose in T]) + rng.normal(0, 1.0, (views, 2))
    poses = [matrix(pose) for pose in T]

    def seen(x: list[Any]) -> list[Any]:
        moved = [pose * mpmath.matrix([*x, 1]) for pose in poses]
        return [v for p in moved for v in pixel(k, [p[0], p[1], p[2]])]

    flat = vector(uv)

    def gradient(x: list[Any]) -> list[Any]:
        r = mpmath.matrix([a - b for a, b in zip(seen(x), flat, strict=True)])
        g = derivative(seen, x).T * r
        return [g[0], g[1], g[2]]

    x = vector(X)
    for _ in range(12):
        step = mpmath.lu_solve(derivative(gradient, x), -mpmath.matrix(gradient(x)))
        x = [x[i] + step[i] for i in range(3)]
    assert max(abs(v) for v in gradient(x)) < mpf("1e-20")
    J = derivative(seen, x)
    middle = _midpoint(T, k, uv)
    J_middle = derivative(seen, middle)
    right = {"X": floats(x), "covariance": floats((J.T * J) ** -1)}
    mistakes = {
        "midpoint": {"X": floats(middle), "covariance": floats((J_middle.T * J_middle) ** -1)},
        "information": {"X": right["X"], "covariance": floats(J.T * J)},
    }
    return {"inputs": {"T_cams": T, "params": params, "uv": uv}, "expected": right, "mistakes": mistakes}


def _midpoint(T: Array, k: list[Any], uv: Array) -> list[Any]:
    """Point with the least sum of squared distances to the rays."""
    A, b = mpmath.zeros(3, 3), mpmath.zeros(3, 1)
    for pose, row in zip(T, uv, strict=True):
        R, t = matrix(pose[:3, :3]), mpmath.matrix(vector(pose[:3, 3]))
        u = vector(row)
        d = mpmath.matrix(unit(list(R.T * mpmath.matrix([(u[0] - k[2]) / k[0], (u[1] - k[3]) / k[1], 1]))))
        P = mpmath.eye(3) - d * d.T
        A, b = A + P, b + P * -(R.T * t)
    X = mpmath.lu_solve(A, b)
    return [X[0], X[1], X[2]]


def pose_groups(topic: Topic, rng: np.random.Generator) -> None:
    """Poses from points."""
    oracle = "the scene's own pose, projected in 50 digits"
    for flag, count, sizes in (("general", 10, (6, 11)), ("few_points", 6, (4, 6)), ("planar", 8, (4, 9))):
        made = [_pnp(rng, int(rng.integers(*sizes)), planar=flag == "planar") for _ in range(count)]
        worst = max(error for _, error in made)
        reason = f"pixels rounded to half an ulp move the pose by {worst:.0e} at most; times 100"
        rule = tolerance(0.0, reason, absolute=100 * worst)
        rule["float32"] = {"relative": 1e-2, "absolute": 1e-2}
        topic.group(
            "multiview.pnp", "eq-resection-refined", oracle, rule, [c for c, _ in made], flags=(flag,)
        )
    rule = tolerance(1e-9, "roots of a quartic that lie a hundredth apart at least, times eps", float32=5e-2)
    oracle = "all roots of Grunert's quartic, 50 digits"
    cases = [_three(rng) for _ in range(16)]
    topic.group("multiview.p3p", "eq-p3p-distances", oracle, rule, cases)


def _pnp(rng: np.random.Generator, n: int, *, planar: bool) -> tuple[dict[str, Any], float]:
    """A case, and how far the rounding of its pixels may move the pose."""
    params, k = sensor(rng), []
    k = vector(params)
    while True:
        X = rng.uniform(-1.5, 1.5, (n, 3)) * ([1, 1, 0] if planar else [1, 1, 1])
        tilt = motion(rng)[:3, :3] if planar else np.eye(3)
        X = X @ tilt.T + rng.uniform(-0.5, 0.5, 3)
        direction = rng.standard_normal(3)
        T = looking(rng, 6.0 * direction / np.linalg.norm(direction), rng.uniform(-0.3, 0.3, 3))
        flat = planar and abs(tilt[:, 2] @ direction) / np.linalg.norm(direction)
        X_cam = X @ T[:3, :3].T + T[:3, 3]
        J = _pose_jacobian(params, X_cam)
        weakest = float(np.linalg.svd(J, compute_uv=False)[-1])
        if weakest > 3.0 and (not planar or 0.4 < flat < 0.9):
            break
    uv = np.array([floats(pixel(k, in_camera(T, x))) for x in X])
    error = float(np.sqrt(2 * n) * 0.5 * np.spacing(np.abs(uv).max()) / weakest) * 4.0
    centre, axes = T.copy(), T.copy()
    centre[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    axes[1:3] = -T[1:3]
    wrong = {"centre-for-translation": centre, "other-axes": axes, "world-from-cam": np.linalg.inv(T)}
    inputs = {"params": params, "X_world": X, "uv": uv}
    return case(inputs, "pose", matrix(T), {note: {"pose": matrix(M)} for note, M in wrong.items()}), error


def _pose_jacobian(params: Array, X: Array) -> Array:
    """Of all pixels in (rho, phi), in doubles: only its smallest singular value is used."""
    x, y, z = X.T
    zero = np.zeros_like(x)
    u = np.stack([params[0] / z, zero, -params[0] * x / z**2], 1)
    v = np.stack([zero, params[1] / z, -params[1] * y / z**2], 1)
    J = np.concatenate([u, v])
    return np.concatenate([J, np.cross(np.concatenate([X, X]), J)], 1)


def _three(rng: np.random.Generator) -> dict[str, Any]:
    """Three points with well separated solutions; every second drawn until there are two and more."""
    most = int(rng.integers(1, 5))
    for attempt in range(2000):
        T = cameras(rng, 2, distance=4.0)[0]
        X = rng.uniform(-1.5, 1.5, (3, 3))
        b = np.array(floats([unit(in_camera(T, x)) for x in X]))
        found = grunert(b, X)
        if found is None or (len(found[0]) != most and attempt < 60):
            continue
        front, behind = found
        wrong = {"world-from-cam": {"poses": [T**-1 for T in front]}}
        if behind:
            wrong["points-behind"] = {"poses": [*front, *behind]}
        return case({"bearings": b, "X_world": X}, "poses", front, wrong)
    raise ArithmeticError("no scene with separate solutions found")


def grunert(b: Array, X: Array) -> tuple[list[Any], list[Any]] | None:
    """Poses with all three points in front, and those with a point behind; None where roots nearly meet.

    With u = d_2/d_1 and v = d_3/d_1 the law of cosines gives two conics; their difference is linear in u, and
    u put into the first leaves a quartic in v.
    """
    B, P = [mpmath.matrix(unit(vector(row))) for row in b], [mpmath.matrix(vector(row)) for row in X]

    def cosine(i: int, j: int) -> Any:
        return (B[i].T * B[j])[0]

    def side(i: int, j: int) -> Any:
        return ((P[i] - P[j]).T * (P[i] - P[j]))[0]

    c12, c13, c23 = cosine(0, 1), cosine(0, 2), cosine(1, 2)
    k, m = side(0, 1) / side(0, 2), side(1, 2) / side(0, 2)
    q = [mpf(1), -2 * c13, mpf(1)]  # 1 + v^2 - 2 v c13, lowest power first
    top = [(k - m) * q[0] - 1, (k - m) * q[1], (k - m) * q[2] + 1]
    bottom = [-2 * c12, 2 * c23]
    rest = [1 - k * q[0], -k * q[1], -k * q[2]]
    quartic = _add(
        _add(_mul(top, top), [-2 * c12 * v for v in _mul(top, bottom)]), _mul(rest, _mul(bottom, bottom))
    )
    roots = mpmath.polyroots(
        [quartic[i] if i < len(quartic) else mpf(0) for i in (4, 3, 2, 1, 0)], 500, extraprec=400
    )
    if min(abs(a - c) for i, a in enumerate(roots) for c in roots[:i]) < 0.02:
        return None
    front: list[Any] = []
    behind: list[Any] = []
    for root in roots:
        if abs(mpmath.im(root)) > mpf("1e-30"):
            continue
        v = mpmath.re(root)
        u = _at(top, v) / _at(bottom, v)
        if min(abs(u), abs(v), abs(_at(bottom, v))) < 0.02:
            return None
        d = mpmath.sqrt(side(0, 2) / _at(q, v))
        distances = [d, u * d, v * d]
        T = _placed([B[i] * distances[i] for i in range(3)], P)
        (front if u > 0 and v > 0 else behind).append(T)
    return (front, behind) if front else None


def _placed(Y: list[Any], P: list[Any]) -> Any:
    """Motion that takes the triangle P to the triangle Y of the same sides."""
    F, G = _frame(Y), _frame(P)
    T = mpmath.eye(4)
    R = F * G.T
    t = Y[0] - R * P[0]
    T[0:3, 0:3] = R
    for i in range(3):
        T[i, 3] = t[i]
    assert max(abs(v) for i in range(3) for v in (R * P[i] + t - Y[i])) < mpf("1e-25")
    return T


def _frame(P: list[Any]) -> Any:
    a = unit(list(P[1] - P[0]))
    f = list(P[2] - P[0])
    c = unit(_cross(a, f))
    return mpmath.matrix([a, _cross(c, a), c]).T


def _cross(a: list[Any], b: list[Any]) -> list[Any]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _mul(a: list[Any], b: list[Any]) -> list[Any]:
    out = [mpf(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            out[i + j] += x * y
    return out


def _add(a: list[Any], b: list[Any]) -> list[Any]:
    n = max(len(a), len(b))
    return [(a[i] if i < len(a) else mpf(0)) + (b[i] if i < len(b) else mpf(0)) for i in range(n)]


def _at(a: list[Any], v: Any) -> Any:
    return sum(c * v**i for i, c in enumerate(a))

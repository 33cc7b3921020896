"""Several views: points from rays, poses from points, similarities; scenes that are exact, in 50 digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator import similarity
from generator.building import Topic, tolerance
from generator.draws import digits
from generator.exact import column, floats, hat, matrix, vector
from generator.groups import motion, turned
from generator.pairs import pair_groups
from generator.resecting import pose_case
from generator.se3 import case
from generator.similarity import Similarity
from generator.views import (
    Array,
    cameras,
    optimal_groups,
    pose_groups,
    rays,
    scene_point,
)

TOPIC, CHAPTER = "multiview", 1

NOTES = {
    "first-camera-frame": (
        "your point is given in the frame of the first camera; it must be in the world's",
        "T_0 X",
    ),
    "midpoint": (
        "your point is the one nearest to the rays in space; the reprojection error is not the least there",
        "X with the least sum of squared distances to the rays",
    ),
    "information": ("your covariance is its inverse", "J^T J"),
    "centre-for-translation": (
        "the last column of your pose is the camera's centre; it must be t = -R p",
        "[R, p; 0, 1]",
    ),
    "other-axes": (
        "your camera looks along -z with y up, as in computer graphics; here z is ahead and y down",
        "diag(1, -1, -1) R",
    ),
    "world-from-cam": ("your poses are T_world_cam", "T^-1"),
    "points-behind": (
        "you keep solutions with a point behind the camera, on the other side of its ray",
        "distances of either sign",
    ),
    "other-image": (
        "you measure the distance in image a; image b is asked for",
        "x_b^T F x_a / |(F^T x_b)_12|",
    ),
    "algebraic": ("you answer u_b^T F u_a; it must be divided by the length of its gradient", "u_b^T F u_a"),
    "one-image": ("your gradient is that in one image only", "u_b^T F u_a / |(F u_a)_12|"),
    "fundamental-transposed": ("your matrix relates the images the other way round", "u_a^T F u_b"),
    "on-the-first-line": ("your point lies on the first line, nearest to the second", "p_a + s b_a"),
    "length-forgotten": ("you differentiate in the unit direction; the given one has a length", "|b| dX/db"),
    "start-kept": ("your pose is the start", "no step"),
    "one-step": ("you take one step of Gauss-Newton; the least error is further on", "Exp(xi) T_0, once"),
    "mean-for-root-mean-square": ("you take the mean distance; its root mean square is wanted", "mean |e|"),
    "sum-not-divided": ("you do not divide by the number of points", "(sum |e|^2)^(1/2)"),
    "factors-swapped": ("your essential matrix is R hat(t); hat(t) must stand on the left", "R hat(t)"),
    "other-way-round": ("your essential matrix is the transposed one: x_a^T E x_b = 0", "E^T"),
    "element-wise": ("you multiply entry by entry: * between arrays for @", "hat(t) * R"),
    "mirrored": (
        "your rotation is a mirror: det R = -1; the last singular vector must change its sign",
        "R = U V^T",
    ),
    "scale-of-mirror": (
        "your scale adds all singular values, also where the last one counts negatively",
        "tr(D) / var_source",
    ),
    "other-variance": ("your scale divides by the spread of the target", "tr(D S) / var_target"),
    "ratio-of-spreads": (
        "your scale is the ratio of the spreads: symmetric, but not that of least squares",
        "(var_target / var_source)^(1/2)",
    ),
    "target-to-source": ("your similarity maps the target to the source", "S^-1"),
    "translation-not-scaled": ("your translation forgets the scale", "mean_target - R mean_source"),
    "centre-added": ("you add the centre; it must be subtracted", "R (X + p)"),
    "centre-not-turned": ("you subtract the centre after the turn, as if it were -t", "R X - p"),
    "turned-back": ("you turn by R^T", "R^T (X - p)"),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    _triangulate(topic, rng)
    optimal_groups(topic, rng)
    pose_groups(topic, rng)
    fine = tolerance(2e-15, "sums of a few products", absolute=1e-15)
    cases = [_essential(motion(rng)) for _ in range(12)]
    topic.group("multiview.essential", "eq-essential", "50-digit product", fine, cases)
    cases = [_camera_from_world(rng) for _ in range(12)]
    topic.group("multiview.camera_from_world", "eq-a1-1", "definition, 50 digits", fine, cases)
    reason = (
        "products of order 100 eps, over the gap of the singular values, at least a thousandth of the largest"
    )
    rule = tolerance(1e-12, reason, float32=1e-2)
    oracle = "Horn's quaternion: largest eigenvector of a 4 x 4 matrix, 50 digits"
    for flag in ("generic", "noisy", "mirrored", "planar"):
        for with_scale in (True, False):
            cases = [_umeyama(rng, flag, with_scale) for _ in range(6 if with_scale else 4)]
            flags = (flag, "sim3" if with_scale else "se3")
            topic.group("multiview.umeyama", "eq-umeyama", oracle, rule, cases, flags=flags)
    pair_groups(topic, rng)
    cases = [pose_case(rng, int(rng.integers(5, 9))) for _ in range(8)]
    reason = "a minimum found by its gradient: condition of J, below 1e4, times a hundred eps of pixels"
    best = tolerance(1e-8, reason, float32=1e-2)
    oracle = "Gauss-Newton to the end, 50 digits"
    topic.group("multiview.pose_optimal", "eq-resection-refined", oracle, best, cases)
    fine = tolerance(1e-14, "a dozen operations")
    cases = [_pose_from_centre(motion(rng)[:3, :3], rng.uniform(-3, 3, 3)) for _ in range(6)]
    topic.group("multiview.pose_from_centre", "eq-centre", "definition, 50 digits", fine, cases)
    oracle = "Horn's quaternion: largest eigenvector of a 4 x 4 matrix, 50 digits"
    for with_scale in (True, False):
        cases = [_alignment_error(rng, with_scale) for _ in range(6)]
        mode = "sim3" if with_scale else "se3"
        topic.group("multiview.alignment_error", "eq-umeyama", oracle, rule, cases, flags=(mode,))
    _sizes(topic, rng, rule, oracle)
    return topic


def _sizes(topic: Topic, rng: np.random.Generator, rule: dict[str, Any], oracle: str) -> None:
    """Three views and more; three pairs of points and many, and those on one line."""
    for views in (2, 3, 4, 8):
        cases = [_bare(_point(rng, views, 1.0)) for _ in range(3)]
        own = tolerance(1e-12, "a parallax above 0.1: eps over its square, times the depth", float32=1e-2)
        where = "the scene's own point, projected in 50 digits"
        topic.group(
            "multiview.triangulate", "eq-triangulation-linear", where, own, cases, flags=("any_size",)
        )
    for with_scale in (True, False):
        mode = "sim3" if with_scale else "se3"
        cases = [_bare(_umeyama(rng, "noisy", with_scale, n)) for n in (3, 3, 20)]
        topic.group("multiview.umeyama", "eq-umeyama", oracle, rule, cases, flags=("any_size", mode))
    line = digits(np.outer([0.0, 1.0, 2.5, 4.0], [1.0, 2.0, -1.0]) + [0.5, 0.0, 3.0])
    bad = [(line, line + 1.0), (line[:2], line[:2] + 1.0), (np.ones((4, 3)), line)]
    cases = [
        {"inputs": {"source": a, "target": b, "with_scale": True}, "expected": {}, "result": "invalid"}
        for a, b in bad
    ]
    topic.group("multiview.umeyama", "eq-umeyama", "definition", rule, cases, flags=("degenerate",))


def _bare(case_: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in case_.items() if key != "mistakes"}


def _triangulate(topic: Topic, rng: np.random.Generator) -> None:
    oracle = "the scene's own point, projected in 50 digits"
    near = "a parallax above 0.1: eps over its square, times the depth"
    distant = "a parallax of 0.002 to 0.01: eps over its square, times the depth"
    for flag, views, far, reason, relative in (
        ("two_views", 2, 1.0, near, 1e-12),
        ("many_views", 5, 1.0, near, 1e-12),
        ("small_parallax", 2, 60.0, distant, 1e-6),
    ):
        rule = tolerance(relative, reason, float32=1e-2)
        cases = [_point(rng, views, far) for _ in range(10)]
        topic.group("multiview.triangulate", "eq-triangulation-linear", oracle, rule, cases, flags=(flag,))
    cases = [_no_point(rng, "behind") for _ in range(3)] + [_no_point(rng, "parallel") for _ in range(3)]
    rule = tolerance(0.0, "no number")
    topic.group(
        "multiview.triangulate", "eq-triangulation-linear", "definition", rule, cases, flags=("degenerate",)
    )


def _point(rng: np.random.Generator, views: int, far: float) -> dict[str, Any]:
    T = cameras(rng, views, distance=6.0 * far)
    X = scene_point(rng)
    b = np.array(floats(rays(T, X)))
    first = list(matrix(T[0]) * mpmath.matrix([*vector(X), 1]))[:3]
    return case({"T_cams": T, "bearings": b}, "X", vector(X), {"first-camera-frame": {"X": first}})


def _no_point(rng: np.random.Generator, what: str) -> dict[str, Any]:
    T = cameras(rng, 2, distance=6.0)
    b = np.array(floats(rays(T, scene_point(rng))))
    if what == "behind":
        b = -b  # the lines meet where they did, the rays do not
    else:
        ahead = np.array([0.0, 0.0, 1.0])
        T[1, :3, :3] = T[0, :3, :3]  # the same ray, seen from another place
        b = np.stack([ahead, ahead])
    return {"inputs": {"T_cams": T, "bearings": b}, "expected": {}, "result": "invalid"}


def _essential(T: Array) -> dict[str, Any]:
    R, t = turned(T)
    R = matrix(T[:3, :3])
    H = hat(t)
    product = mpmath.matrix([[H[i, j] * R[i, j] for j in range(3)] for i in range(3)])
    wrong = {"factors-swapped": R * H, "other-way-round": (H * R).T, "element-wise": product}
    return case({"T_b_a": T}, "E", H * R, {note: {"E": E} for note, E in wrong.items()})


def _camera_from_world(rng: np.random.Generator) -> dict[str, Any]:
    R, p, X = motion(rng)[:3, :3], rng.uniform(-3, 3, 3), rng.uniform(-5, 5, 3)
    Rm, pm, Xm = matrix(R), mpmath.matrix(vector(p)), mpmath.matrix(vector(X))
    wrong = {
        "centre-added": Rm * (Xm + pm),
        "centre-not-turned": Rm * Xm - pm,
        "turned-back": Rm.T * (Xm - pm),
    }
    inputs = {"R_cam_world": R, "p_world": p, "X_world": X}
    return case(inputs, "X_cam", column(Rm * (Xm - pm)), {n: {"X_cam": column(v)} for n, v in wrong.items()})


def _umeyama(rng: np.random.Generator, flag: str, with_scale: bool, n: int = 0) -> dict[str, Any]:
    n = n or int(rng.integers(4, 9))
    source = rng.uniform(-3, 3, (n, 3)) * [1.0, 0.8, 0.6] + rng.uniform(-2, 2, 3)
    if flag == "planar":
        source[:, 2] = 0.5
    truth = motion(rng)
    scale = float(rng.uniform(0.3, 3.0)) if with_scale else 1.0
    flip = np.diag([1.0, 1.0, -1.0]) if flag == "mirrored" else np.eye(3)
    target = scale * (source @ flip) @ truth[:3, :3].T + truth[:3, 3]
    target = target + {"generic": 0.0, "planar": 0.02}.get(flag, 0.1) * rng.standard_normal((n, 3))
    right = similarity.align(source, target, with_scale=with_scale)
    M, moves_x, moves_y = similarity.products(source, target)
    wrong = {"target-to-source": similarity.align(target, source, with_scale=with_scale)}
    if with_scale:
        R = right.R
        top = similarity.inner(R, M)
        for note, s in (
            ("other-variance", top / moves_y),
            ("ratio-of-spreads", mpmath.sqrt(moves_y / moves_x)),
        ):
            if abs(s - right.scale) > mpf("1e-6"):
                wrong[note] = similarity.placed(s, R, source, target)
        wrong["translation-not-scaled"] = Similarity(
            right.scale, R, similarity.placed(mpf(1), R, source, target).t
        )
    if flag == "mirrored":
        U, D, V = mpmath.svd_r(M)
        mirror = U * V
        s = sum(D) / moves_x if with_scale else mpf(1)
        wrong["mirrored"] = similarity.placed(s, mirror, source, target)
        if with_scale:
            wrong["scale-of-mirror"] = similarity.placed(s, right.R, source, target)
    mistakes = {note: _answer(S) for note, S in wrong.items()}
    inputs = {"source": source, "target": target, "with_scale": with_scale}
    return {"inputs": inputs, "expected": _answer(right), "mistakes": mistakes}


def _answer(S: Similarity) -> dict[str, Any]:
    return {"scale": float(S.scale), "R": floats(S.R), "t": floats(S.t)}


def _pose_from_centre(R: Array, p: Array) -> dict[str, Any]:
    M, t = matrix(R), -(matrix(R) * mpmath.matrix(vector(p)))
    right, wrong = mpmath.eye(4), mpmath.eye(4)
    right[0:3, 0:3] = wrong[0:3, 0:3] = M
    for i in range(3):
        right[i, 3], wrong[i, 3] = t[i], mpf(p[i])
    inputs = {"R_cam_world": R, "p_world": p}
    return case(inputs, "pose", right, {"centre-for-translation": {"pose": wrong}})


def _alignment_error(rng: np.random.Generator, with_scale: bool) -> dict[str, Any]:
    n = int(rng.integers(5, 9))
    source, T = rng.uniform(-3, 3, (n, 3)), motion(rng)
    target = (
        (1.7 if with_scale else 1.0) * source @ T[:3, :3].T + T[:3, 3] + 0.2 * rng.standard_normal((n, 3))
    )
    S = similarity.align(source, target, with_scale=with_scale)
    pairs = zip(similarity.rows(source), similarity.rows(target), strict=True)
    e = [mpmath.norm(mpmath.matrix([a - b for a, b in zip(S.act(x), y, strict=True)])) for x, y in pairs]
    total = sum(v * v for v in e)
    wrong = {
        "mean-for-root-mean-square": {"rmse": sum(e) / n},
        "sum-not-divided": {"rmse": mpmath.sqrt(total)},
    }
    inputs = {"source": source, "target": target, "with_scale": with_scale}
    return case(inputs, "rmse", mpmath.sqrt(total / n), wrong)

"""Two views: matrices from pairs, motions from matrices, distances and costs; scenes exact in 50 digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.draws import digits
from generator.exact import column, expm, floats, hat, matrix, vector
from generator.two_views_costs import answers, cost_groups

TOPIC, CHAPTER = "two_views", 9

NOTES = {
    "transposed": ("your matrix leads from picture b to picture a", "M^T"),
    "inverted": ("your homography maps picture b to picture a", "H^-1"),
    "unequal-singular-values": (
        "you set the smallest singular value to zero and leave the others unequal: not essential",
        "U diag(s_1, s_2, 0) V^T, scaled",
    ),
    "singular-values-kept": (
        "you set the smallest singular value to zero and keep the others as they are",
        "U diag(s_1, s_2, 0) V^T",
    ),
    "mirrored-accepted": (
        "your translation has the other sign: the points lie behind both cameras",
        "(R, -t)",
    ),
    "twisted-accepted": (
        "your rotation is half a turn about the baseline further: a point lies behind one camera",
        "U W^T V^T for U W V^T",
    ),
    "other-way-round": ("your motion leads from b to a: that of E^T, or of H^-1", "T_a_b"),
    "twin-accepted": (
        "your motion is the homography's other one: its plane lies behind the camera at a point",
        "the answer with n^T x < 0 for a point",
    ),
    "translation-subtracted": ("your plane has the other sign", "R - t n^T / d"),
    "normal-first": ("your product is n t^T; it must be t n^T", "R + n t^T / d"),
    "distance-forgotten": ("you do not divide by the plane's distance", "R + t n^T"),
    "calibration-not-inverted": ("you multiply by the cameras; their inverses are needed", "K_b^T E K_a"),
    "cameras-swapped": ("you take camera a for camera b", "K_a^-T E K_b^-1"),
    "one-image": ("you move the point in picture b only", "|H x_a - x_b|^2"),
    "both-transfers": (
        "you add the errors in both pictures, each with the other point fixed",
        "|H x_a - x_b|^2 + |H^-1 x_b - x_a|^2",
    ),
    "homography-inverted": ("your homography is used the other way round", "the same with H^-1"),
    "perturbed-from-the-right": ("you differentiate for R Exp(phi)", "J R"),
    "numerator-only": ("you differentiate the numerator and keep the length fixed", "de / |g|"),
    "swapped": ("your depths are those of the other camera", "(depth_b, depth_a)"),
    "along-the-rays": ("your depths are distances from the centres, along the rays", "depth |x|"),
    "side-forgotten": (
        "a point behind a camera costs you its distance from the line only: a mirrored motion is free",
        "Sampson's distance on either side",
    ),
    "share-of-wrong-pairs": ("your share is that of the wrong pairs", "log(1 - p) / log(1 - (1 - w)^m)"),
    "one-clean-pair": ("one right pair in the sample is enough for you; all m must be right",
                       "log(1 - p) / log((1 - w)^m)"),
    "counted": ("you count the pairs beyond the threshold (RANSAC)", "share of e^2 > c^2, times c^2"),
    "not-truncated": ("your cost is the plain mean: one wrong pair decides", "mean e^2"),
    "unknowns-only": ("you charge for the unknowns of the model only", "no term in d N"),
    "same-threshold": ("your threshold is the same for each kind of model", "min(e^2, 2)"),
}  # fmt: skip


def build(rng: np.random.Generator) -> Topic:
    """All groups of two views."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    _matrices(topic, rng)
    _motions(topic, rng)
    cost_groups(topic, rng)
    return topic


def turn(phi: Any) -> Any:
    """Rotation of a rotation vector, by the series of the exponential."""
    return expm(hat(vector(phi)))


def scene(
    rng: np.random.Generator, points: int, plane: bool = False
) -> tuple[Any, Any, list[Any], list[Any]]:
    """Rotation, unit translation, and normalised positions of points in front of both cameras."""
    while True:
        R, t = turn(rng.normal(0, 0.2, 3)), mpmath.matrix(vector(rng.normal(size=3)))
        t = t / mpmath.norm(t)
        X = rng.uniform(-1, 1, (points, 3)) * [2, 2, 1.5] + [0, 0, 5]
        if plane:
            X[:, 2] = 5.0 + 0.4 * X[:, 0] - 0.2 * X[:, 1]
        cam_a = [mpmath.matrix(vector(x)) for x in X]
        if plane:
            for x in cam_a:
                x[2] = 5 + mpf("0.4") * x[0] - mpf("0.2") * x[1]
        cam_b = [R * x + t for x in cam_a]
        if min(x[2] for x in cam_b) > 1:
            return R, t, [_seen(x) for x in cam_a], [_seen(x) for x in cam_b]


def _seen(X: Any) -> list[Any]:
    return [X[0] / X[2], X[1] / X[2]]


def _unit(M: Any, size: Any = 1) -> Any:
    """A matrix of the given norm whose largest entry is positive."""
    entries = sorted(column(_flat(M)), key=abs)
    norm = mpmath.sqrt(sum(v * v for v in entries))
    return M * (size / norm * mpmath.sign(entries[-1]))


def _flat(M: Any) -> Any:
    return mpmath.matrix([M[i, j] for i in range(3) for j in range(3)])


def _clear(M: Any) -> bool:
    """Whether the largest entry is clearly the largest."""
    sizes = sorted(abs(v) for v in column(_flat(M)))
    return bool(sizes[-1] > mpf("1.05") * sizes[-2])


def _matrices(topic: Topic, rng: np.random.Generator) -> None:
    oracle = "the scene's own motion, 50 digits"
    reason = "eps times the condition of the linear equations, below 1e5, and of the roots, below 1e2"
    rule = tolerance(1e-9, reason, float32=1e-2)
    for name, points, label in (("eight_point", 12, "eq-eight-point"), ("five_point", 6, "eq-action-matrix")):
        topic.group(f"two_views.{name}", label, oracle, rule, [_essential(rng, points) for _ in range(10)])
    cases = [_homography(rng, 4 + k % 4) for k in range(10)]
    reason = "eps times the condition of the linear equations, below 1e5"
    rule = tolerance(1e-10, reason, float32=1e-2)
    topic.group("two_views.homography", "eq-homography-dlt", "the scene's own plane, 50 digits", rule, cases)
    few = tolerance(1e-13, "a singular value decomposition of 3 x 3, and a gap of its values above 0.1")
    cases = [_nearest(rng) for _ in range(10)]
    topic.group("two_views.nearest_essential", "eq-nearest-essential", "mpmath's SVD, 50 digits", few, cases)
    few = tolerance(1e-14, "sums of three products, twice, over focal lengths", absolute=1e-16)
    cases = [_fundamental(rng) for _ in range(8)]
    topic.group("two_views.fundamental", "eq-fundamental", "definition, 50 digits", few, cases)
    cases = [_of_plane(rng) for _ in range(8)]
    topic.group("two_views.homography_of_plane", "eq-plane-homography", "definition, 50 digits", few, cases)


def _essential(rng: np.random.Generator, points: int) -> dict[str, Any]:
    while True:
        R, t, a, b = scene(rng, points)
        E = hat(t) * R
        rows = np.array([np.kron([*floats(y), 1], [*floats(x), 1]) for x, y in zip(a, b, strict=True)])
        s = np.linalg.svd(rows, compute_uv=False)
        if _clear(E) and s[min(points, 8) - 1] > 1e-3 * s[0]:
            break
    size = mpmath.sqrt(2)
    inputs = {"xn_a": floats(a), "xn_b": floats(b)}
    return answers(inputs, "E", _unit(E, size), {"transposed": _unit(E.T, size)})


def _homography(rng: np.random.Generator, points: int) -> dict[str, Any]:
    while True:
        R, t, a, b = scene(rng, points, plane=True)
        P = np.array([[*floats(x), 1] for x in a])
        picks = [[i, j, k] for i in range(4) for j in range(i) for k in range(j)]
        if min(abs(np.linalg.det(P[p])) for p in picks) > 0.02:
            break
    H = R + t * mpmath.matrix([mpf("-0.4"), mpf("0.2"), 1]).T / 5
    size = mpmath.sqrt(sum(v * v for v in column(_flat(H))))
    back = H**-1
    length = mpmath.sqrt(sum(v * v for v in column(_flat(back))))
    wrong = {"transposed": H.T / size, "inverted": back / length}
    return answers({"x_a": floats(a), "x_b": floats(b)}, "H", H / size, wrong)


def _nearest(rng: np.random.Generator) -> dict[str, Any]:
    while True:
        M = digits(rng.uniform(-2, 2, (3, 3)), 6)
        s = np.linalg.svd(M, compute_uv=False)
        if s[1] - s[2] > 0.3 and s[0] - s[1] > 0.3:
            break
    U, S, V = mpmath.svd_r(matrix(M))
    right = U * mpmath.diag([1, 1, 0]) * V
    scale = mpmath.sqrt(2 / (S[0] ** 2 + S[1] ** 2))
    uneven = U * mpmath.diag([S[0] * scale, S[1] * scale, 0]) * V
    wrong = {
        "unequal-singular-values": uneven,
        "singular-values-kept": U * mpmath.diag([S[0], S[1], 0]) * V,
        "transposed": right.T,
    }
    return answers({"M": M.tolist()}, "E", right, wrong)


def _fundamental(rng: np.random.Generator) -> dict[str, Any]:
    E = digits(rng.uniform(-1, 1, (3, 3)), 6)
    params = [digits([*rng.uniform(300, 700, 2), *rng.uniform(200, 350, 2)], 6) for _ in range(2)]
    K = [matrix([[p[0], 0, p[2]], [0, p[1], p[3]], [0, 0, 1]]) for p in params]
    right = (K[1] ** -1).T * matrix(E) * K[0] ** -1
    wrong = {
        "transposed": right.T,
        "calibration-not-inverted": K[1].T * matrix(E) * K[0],
        "cameras-swapped": (K[0] ** -1).T * matrix(E) * K[1] ** -1,
    }
    inputs = {"E": E.tolist(), "params_a": params[0].tolist(), "params_b": params[1].tolist()}
    # the smallest entries are those of two focal lengths: judged beside the largest entry
    kept = {n: {"F": floats(v)} for n, v in wrong.items()}
    return {"inputs": inputs, "expected": {"F": floats(right)}, "mistakes": kept}


def _of_plane(rng: np.random.Generator) -> dict[str, Any]:
    R = np.array(floats(turn(rng.normal(0, 0.5, 3))))
    t, n = digits(rng.uniform(-1, 1, 3), 6), digits(rng.uniform(-1, 1, 3), 6)
    d = float(digits(rng.uniform(1.5, 4.0), 6))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    tm, nm, Rm = mpmath.matrix(vector(t)), mpmath.matrix(vector(n)), matrix(R)
    H = Rm + tm * nm.T / mpf(d)
    wrong = {
        "translation-subtracted": Rm - tm * nm.T / mpf(d),
        "normal-first": Rm + nm * tm.T / mpf(d),
        "distance-forgotten": Rm + tm * nm.T,
        "inverted": H**-1,
    }
    return answers({"T_b_a": T.tolist(), "normal": n.tolist(), "d": d}, "H", H, wrong)


def rigid(R: Any, t: Any) -> Any:
    """Motion of a rotation and a translation."""
    T = mpmath.eye(4)
    T[0:3, 0:3] = R
    for i in range(3):
        T[i, 3] = t[i]
    return T


def _motions(topic: Topic, rng: np.random.Generator) -> None:
    oracle = "the scene's own motion, 50 digits"
    rule = tolerance(1e-12, "a singular value decomposition of 3 x 3 with two equal values: some 100 eps")
    cases = [_motion(rng) for _ in range(12)]
    topic.group("two_views.motion_from_essential", "eq-essential-motions", oracle, rule, cases)
    rule = tolerance(1e-9, "gaps of the singular values above 0.02: eps over their square root and square")
    told, refused = [], []
    while len(told) < 8 or len(refused) < 4:
        case = _planar(rng)
        if case is not None:
            (refused if case.get("result") == "invalid" else told).append(case)
    for flag, cases in (("told_apart", told[:8]), ("ambiguous", refused[:4])):
        oracle, flags = "both answers by the eigenvectors of H^T H, 50 digits", (flag,)
        topic.group(
            "two_views.motion_from_homography", "eq-homography-motions", oracle, rule, cases, flags=flags
        )


def _motion(rng: np.random.Generator) -> dict[str, Any]:
    R, t, a, b = scene(rng, 5)
    scale = float(digits(rng.uniform(0.3, 3.0) * rng.choice([-1, 1]), 4))
    E = hat(t) * R * mpf(scale)
    half = 2 * t * t.T - mpmath.eye(3)  # half a turn about the baseline
    wrong = {
        "mirrored-accepted": rigid(R, -t),
        "twisted-accepted": rigid(half * R, t),
        "other-way-round": rigid(R.T, -(R.T * t)),
    }
    return answers({"E": floats(E), "xn_a": floats(a), "xn_b": floats(b)}, "T_b_a", rigid(R, t), wrong)


def _planar(rng: np.random.Generator) -> dict[str, Any] | None:
    """A homography whose twin is refuted by a point, or is possible, too; None near either boundary."""
    R, t, a, _ = scene(rng, 8, plane=True)
    n = mpmath.matrix([mpf("-0.4"), mpf("0.2"), 1])
    length = mpmath.norm(n)
    n, t = n / length, t * length / 5  # in units of the plane's distance
    H = R + t * n.T
    values, V = mpmath.eigsy(H.T * H)  # rising
    middle = values[1]
    s = [v / middle for v in values]
    if min(1 - s[0], s[2] - 1) < mpf("0.05"):
        return None
    G = H / mpmath.sqrt(middle)
    v3, v2, v1 = (V[:, k] for k in range(3))
    p, q = mpmath.sqrt(1 - s[0]), mpmath.sqrt(s[2] - 1)
    root = mpmath.sqrt(s[2] - s[0])
    both = []
    for sign in (1, -1):
        u = (p * v1 + sign * q * v3) / root
        m = hat(v2) * u
        Gv, Gu = G * v2, G * u
        W, U = mpmath.zeros(3, 3), mpmath.zeros(3, 3)
        for k, (x, y) in enumerate(((Gv, v2), (Gu, u), (hat(Gv) * Gu, m))):
            W[:, k], U[:, k] = x, y
        turned = W * U.T
        both.append((turned, (G - turned) * m, m))
    twin = max(both, key=lambda answer: mpmath.mnorm(answer[0] - R, "f"))
    if mpmath.mnorm(twin[0] - R, "f") < mpf("0.05"):
        return None
    fronts = [(twin[2].T * mpmath.matrix([*x, 1]))[0] for x in a]
    if min(abs(v) for v in fronts) < mpf("0.02") or sum(v > 0 for v in fronts) * 2 == len(fronts):
        return None
    factor = float(digits(rng.uniform(0.3, 3.0) * rng.choice([-1, 1]), 3))
    inputs = {"H": floats(H * mpf(factor)), "xn_a": floats(a)}
    if all(v > 0 for v in fronts) or all(v < 0 for v in fronts):
        return {"inputs": inputs, "expected": {}, "result": "invalid"}
    side = 1 if sum(v > 0 for v in fronts) * 2 > len(fronts) else -1
    wrong = {"twin-accepted": rigid(twin[0], twin[1] * side), "other-way-round": rigid(R.T, -(R.T * t))}
    return answers(inputs, "T_b_a", rigid(R, t), wrong)

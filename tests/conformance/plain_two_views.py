"""Chapter 09 in plain NumPy and SciPy, and its known mistakes on demand.

Matrices from pairs come from a search over rotations and directions, motions from Horn's formula with
cofactors, answers of a homography from a search over normals: not the generator's ways, nor the library's.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from plain_motions import skew
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

Array = Any


def _lift(x: Array) -> Array:
    return np.append(x, np.ones((*np.shape(x)[:-1], 1)), axis=-1)


def _rigid(R: Array, t: Array) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    return T


def _signed(E: Array, size: float) -> Array:
    E = E / np.linalg.norm(E) * size
    return E * np.sign(E.flat[np.argmax(np.abs(E))])


def essential_of_pairs(xn_a: Array, xn_b: Array, wrong: str | None = None) -> Array:
    E = _searched(xn_a.tobytes(), xn_b.tobytes())
    return _signed(E.T if wrong == "transposed" else E, math.sqrt(2))


@functools.cache
def _searched(bytes_a: bytes, bytes_b: bytes) -> Array:
    """Rotation and direction by least squares from many starts, until nothing is left."""
    a, b = (_lift(np.frombuffer(x).reshape(-1, 2)) for x in (bytes_a, bytes_b))
    rng = np.random.default_rng(0)

    def left(x: Array) -> Array:
        E = skew(x[3:] / np.linalg.norm(x[3:])) @ Rotation.from_rotvec(x[:3]).as_matrix()
        return np.einsum("ni,ij,nj->n", b, E, a)

    for _ in range(400):
        start = np.append(rng.normal(0, 0.4, 3), rng.normal(size=3))
        found = least_squares(left, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=60)
        if found.cost < 1e-24:
            break
    t = found.x[3:] / np.linalg.norm(found.x[3:])
    return skew(t) @ Rotation.from_rotvec(found.x[:3]).as_matrix()


def homography(x_a: Array, x_b: Array, wrong: str | None = None) -> Array:
    """Cross products of x_b and H x_a, three rows a pair."""
    rows = np.concatenate([np.kron(skew(q), p) for p, q in zip(_lift(x_a), _lift(x_b), strict=True)])
    H = np.linalg.svd(rows)[2][-1].reshape(3, 3)
    H = H * np.sign((_lift(x_a) @ H.T)[0, 2])
    H = np.linalg.inv(H) if wrong == "inverted" else H.T if wrong == "transposed" else H
    return H / np.linalg.norm(H)


def nearest_essential(M: Array, wrong: str | None = None) -> Array:
    values, V = np.linalg.eigh(M.T @ M)
    U = M @ V[:, 1:] / np.sqrt(values[1:])
    if wrong == "unequal-singular-values":
        U = U * np.sqrt(2 * values[1:] / values[1:].sum())
    if wrong == "singular-values-kept":
        U = U * np.sqrt(values[1:])
    E = U @ V[:, 1:].T
    return E.T if wrong == "transposed" else E


def _K(params: Array) -> Array:
    fx, fy, cx, cy = params
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def fundamental(E: Array, params_a: Array, params_b: Array, wrong: str | None = None) -> Array:
    K_a, K_b = _K(params_a), _K(params_b)
    if wrong == "cameras-swapped":
        K_a, K_b = K_b, K_a
    if wrong == "calibration-not-inverted":
        return K_b.T @ E @ K_a
    F = np.linalg.solve(K_b.T, np.linalg.solve(K_a.T, E.T).T)
    return F.T if wrong == "transposed" else F


def homography_of_plane(T_b_a: Array, normal: Array, d: float, wrong: str | None = None) -> Array:
    R, t = T_b_a[:3, :3], T_b_a[:3, 3]
    d = 1.0 if wrong == "distance-forgotten" else -d if wrong == "translation-subtracted" else d
    H = R + (np.outer(normal, t) if wrong == "normal-first" else np.outer(t, normal)) / d
    return np.linalg.inv(H) if wrong == "inverted" else H


def motion_from_essential(E: Array, xn_a: Array, xn_b: Array, wrong: str | None = None) -> Array:
    """Horn: the longest cross product of columns is t, and |t|^2 R = cofactors - hat(t) E."""
    E = E * math.sqrt(2) / np.linalg.norm(E)
    products = [np.cross(E[:, i], E[:, j]) for i, j in ((0, 1), (1, 2), (2, 0))]
    t = max(products, key=np.linalg.norm)
    t = t / np.linalg.norm(t)
    cofactors = np.stack([np.cross(E[(i + 1) % 3], E[(i + 2) % 3]) for i in range(3)])
    for sign in (1, -1):
        for u in (t, -t):
            R = cofactors - skew(sign * u) @ E
            if all((_depths(_rigid(R, u), p, q) > 0).all() for p, q in zip(xn_a, xn_b, strict=True)):
                half = 2 * np.outer(u, u) - np.eye(3)
                if wrong == "other-way-round":
                    return _rigid(R.T, -R.T @ u)
                if wrong == "twisted-accepted":
                    return _rigid(half @ R, u)
                return _rigid(R, -u if wrong == "mirrored-accepted" else u)
    raise ValueError("no motion has the points in front")


def _depths(T: Array, a: Array, b: Array) -> Array:
    """Least squares of depth_b x_b = depth_a R x_a + t."""
    A = np.stack([T[:3, :3] @ _lift(a), -_lift(b)], 1)
    return np.linalg.lstsq(A, -T[:3, 3], rcond=None)[0]


def depths(T_b_a: Array, xn_a: Array, xn_b: Array, wrong: str | None = None) -> Array:
    found = _depths(T_b_a, xn_a, xn_b)
    if wrong == "along-the-rays":
        return found * [np.linalg.norm(_lift(xn_a)), np.linalg.norm(_lift(xn_b))]
    return found[::-1] if wrong == "swapped" else found


def motion_from_homography(H: Array, xn_a: Array, wrong: str | None = None) -> Array:
    H = H / np.linalg.svd(H, compute_uv=False)[1] * np.sign(np.linalg.det(H))
    answers = []
    for n, t in _normals(H.tobytes()):
        side = 1.0 if np.sum(np.sign(_lift(xn_a) @ n)) >= 0 else -1.0
        answers.append((side * n, side * t))
    good = [(n, t) for n, t in answers if (_lift(xn_a) @ n > 0).all()]
    if len(good) != 1:
        raise ValueError("both answers are possible")
    n, t = next(a for a in answers if a[0] is not good[0][0]) if wrong == "twin-accepted" else good[0]
    T = _rigid(H - np.outer(t, n), t)
    return np.linalg.inv(T) if wrong == "other-way-round" else T


@functools.cache
def _normals(bytes_H: bytes) -> list[tuple[Array, Array]]:
    """Normals for which H - t n^T is a rotation, by least squares from many starts; one of n, -n."""
    H, rng = np.frombuffer(bytes_H).reshape(3, 3), np.random.default_rng(1)

    def left(x: Array) -> Array:
        R = H - np.outer(x[3:], x[:3] / np.linalg.norm(x[:3]))
        return (R @ R.T - np.eye(3))[np.triu_indices(3)]

    answers: list[tuple[Array, Array]] = []
    for _ in range(60):
        found = least_squares(left, rng.normal(size=6), xtol=1e-15, ftol=1e-15, gtol=1e-15)
        n, t = found.x[:3] / np.linalg.norm(found.x[:3]), found.x[3:]
        if found.cost > 1e-22 or np.linalg.det(H - np.outer(t, n)) < 0:
            continue
        if all(min(np.abs(n - m).max(), np.abs(n + m).max()) > 1e-4 for m, _ in answers):
            answers.append((n, t))
        if len(answers) == 2:
            break
    return answers


def _map(H: Array, x: Array) -> Array:
    Y = H @ np.append(x, 1)
    return Y[:2] / Y[2]


def homography_distance(H: Array, x_a: Array, x_b: Array, wrong: str | None = None) -> float:
    """The constraint in four unknowns, its derivatives by complex steps."""
    if wrong in ("one-image", "both-transfers"):
        there = np.sum((_map(H, x_a) - x_b) ** 2)
        return float(there + (np.sum((_map(np.linalg.inv(H), x_b) - x_a) ** 2) if wrong[0] == "b" else 0))
    if wrong == "homography-inverted":
        H, x_a, x_b = np.linalg.inv(H), x_a, x_b
    G = np.stack([_map(H, x_a + 1e-40j * e).imag / 1e-40 for e in np.eye(2)], 1)
    G = np.append(G, -np.eye(2), axis=1)
    e = _map(H, x_a) - x_b
    return float(e @ np.linalg.solve(G @ G.T, e))


def _parts(R: Array, t: Array, a: Array, b: Array) -> tuple[Any, Any]:
    E = skew(t) @ R
    p, q = np.append(a, 1), np.append(b, 1)
    g = np.concatenate([(E @ p)[:2], (E.T @ q)[:2]])
    return q @ E @ p, np.sqrt(np.sum(g * g))


def sampson_turn_jacobian(T_b_a: Array, xn_a: Array, xn_b: Array, wrong: str | None = None) -> Any:
    """Complex steps."""
    R, t = T_b_a[:3, :3], T_b_a[:3, 3] / np.linalg.norm(T_b_a[:3, 3])
    slopes = []
    for axis in np.eye(3):
        step = np.eye(3) + 1e-40j * skew(axis)
        turned = R @ step if wrong == "perturbed-from-the-right" else step @ R
        e, g = _parts(turned, t, xn_a, xn_b)
        slopes.append((e / (_parts(R, t, xn_a, xn_b)[1] if wrong == "numerator-only" else g)).imag / 1e-40)
    e, g = _parts(R, t, xn_a, xn_b)
    return {"J_turn": np.array(slopes), "value": float(e / g)}


def sampson_direction_derivative(
    T_b_a: Array, xn_a: Array, xn_b: Array, v: Array, wrong: str | None = None
) -> float:
    """Complex step."""
    R, t = T_b_a[:3, :3], T_b_a[:3, 3]
    e, g = _parts(R, t + 1e-40j * v, xn_a, xn_b)
    g = _parts(R, t, xn_a, xn_b)[1] if wrong == "numerator-only" else g
    return float((e / g).imag / 1e-40)


def cheirality_cost(T_b_a: Array, xn_a: Array, xn_b: Array, sigma: float, wrong: str | None = None) -> float:
    R, t = T_b_a[:3, :3], T_b_a[:3, 3]
    if wrong == "side-forgotten" or (_depths(T_b_a, xn_a, xn_b) > 0).all():
        e, g = _parts(R, t / np.linalg.norm(t), xn_a, xn_b)
        return float((e / g / sigma) ** 2)
    return homography_distance(R, xn_a, xn_b) / sigma**2


def draws(share: float, size: float, confidence: float, wrong: str | None = None) -> float:
    if wrong == "one-clean-pair":
        return math.log(1 - confidence) / (size * math.log(1 - share))
    share = 1 - share if wrong == "share-of-wrong-pairs" else share
    return math.log(1 - confidence, 1 - share**size)


def truncated_cost(squared: Array, most: float, wrong: str | None = None) -> float:
    if wrong == "counted":
        return float(most * np.mean(squared > most))
    return float(np.mean(squared if wrong == "not-truncated" else np.where(squared > most, most, squared)))


def model_criterion(squared: Array, dimension: float, unknowns: float, wrong: str | None = None) -> float:
    cap = 2.0 if wrong == "same-threshold" else 8.0 - 2 * dimension
    n = len(squared)
    d = 0 if wrong == "unknowns-only" else dimension
    return float(
        np.where(squared > cap, cap, squared).sum() + d * n * math.log(4) + unknowns * math.log(4 * n)
    )


PROGRAM = {
    "two_views.eight_point": essential_of_pairs,
    "two_views.five_point": essential_of_pairs,
    "two_views.homography": homography,
    "two_views.nearest_essential": nearest_essential,
    "two_views.fundamental": fundamental,
    "two_views.homography_of_plane": homography_of_plane,
    "two_views.motion_from_essential": motion_from_essential,
    "two_views.motion_from_homography": motion_from_homography,
    "two_views.homography_distance": homography_distance,
    "two_views.sampson_turn_jacobian": sampson_turn_jacobian,
    "two_views.sampson_direction_derivative": sampson_direction_derivative,
    "two_views.depths": depths,
    "two_views.cheirality_cost": cheirality_cost,
    "two_views.draws": draws,
    "two_views.truncated_cost": truncated_cost,
    "two_views.model_criterion": model_criterion,
}

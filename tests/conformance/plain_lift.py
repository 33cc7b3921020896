"""The lifted and the reduced filter from the printed rows, in doubles, and their mistakes.

As :mod:`plain_filters`: no library, no generator; B16, B18, B26 and the derivatives in U typed in by hand.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from plain_filters import Answer, Array, arrays
from scipy.linalg import block_diag


def vehicle(x: Any, P: Any, wrong: str = "") -> Answer:
    (px, py, th), P = arrays(x, P)
    s, c = np.sin(th), np.cos(th)
    Z = np.array([px, py, s, c, s * s, c * c, px * s, px * c, py * s, py * c, s * c])
    J = np.zeros((11, 3))
    J[:, 0] = [1, 0, 0, 0, 0, 0, s, c, 0, 0, 0]
    J[:, 1] = [0, 1, 0, 0, 0, 0, 0, 0, s, c, 0]
    slopes = [c, -s, 2 * s * c, -2 * s * c, px * c, -px * s, py * c, -py * s, c * c - s * s]
    J[:, 2] = [0, 0, *slopes]
    P_Z = J @ P @ J.T
    if wrong == "no-products":
        P_Z[4:], P_Z[:, 4:] = 0, 0
    if wrong == "cos-before-sin":
        swap = [0, 1, 3, 2, 5, 4, 7, 6, 9, 8, 10]
        Z, P_Z = Z[swap], P_Z[np.ix_(swap, swap)]
    return {"Z": Z, "P_Z": P_Z}


def pose(z: Any, P: Any, wrong: str = "") -> Answer:
    (px, py, s, c), P = arrays(z, P)
    J = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, c, -s]])
    if wrong != "length-forgotten":
        J[2] /= s * s + c * c
    if wrong == "atan2-swapped":
        J[2] = -J[2]
    angle = np.arctan2(c, s) if wrong == "atan2-swapped" else np.arctan2(s, c)
    return {"x": [px, py, angle], "P": J @ P @ J.T}


def rows(u1: float, u2: float, u3: float) -> Array:
    """B16."""
    M = np.zeros((11, 11))
    M[0, [0, 3]] = 1, u1
    M[1, [1, 2]] = 1, u1
    M[2, [2, 3]] = u3, u2
    M[3, [3, 2]] = u3, -u2
    M[4, [4, 10, 5]] = u3**2, 2 * u2 * u3, u2**2
    M[5, [5, 10, 4]] = u3**2, -2 * u2 * u3, u2**2
    M[6, [6, 7, 5, 10]] = u3, u2, u1 * u2, u1 * u3
    M[7, [7, 6, 5, 10]] = u3, -u2, u1 * u3, -u1 * u2
    M[8, [8, 9, 4, 10]] = u3, u2, u1 * u3, u1 * u2
    M[9, [9, 8, 10, 4]] = u3, -u2, u1 * u3, -u1 * u2
    M[10, [10, 4, 5]] = u3**2 - u2**2, -u2 * u3, u2 * u3
    return M


def slopes(z: Array, u1: float, u2: float, u3: float) -> Array:
    """Derivative of B16 in U."""
    _, _, z3, z4, z5, z6, z7, z8, z9, z10, z11 = z
    return np.array(
        [
            [z4, 0, 0],
            [z3, 0, 0],
            [0, z4, z3],
            [0, -z3, z4],
            [0, 2 * z11 * u3 + 2 * z6 * u2, 2 * z5 * u3 + 2 * z11 * u2],
            [0, -2 * z11 * u3 + 2 * z5 * u2, 2 * z6 * u3 - 2 * z11 * u2],
            [z6 * u2 + z11 * u3, z8 + z6 * u1, z7 + z11 * u1],
            [z6 * u3 - z11 * u2, -z7 - z11 * u1, z8 + z6 * u1],
            [z5 * u3 + z11 * u2, z10 + z11 * u1, z9 + z5 * u1],
            [z11 * u3 - z5 * u2, -z9 - z5 * u1, z10 + z11 * u1],
            [0, (z6 - z5) * u3 - 2 * z11 * u2, 2 * z11 * u3 + (z6 - z5) * u2],
        ]
    )


def predict(Z: Any, P: Any, increment: Any, cov: Any, wrong: str = "") -> Answer:
    Z, P, (ds, turn), cov = arrays(Z, P, increment, cov)
    n, u2, u3 = (len(Z) - 11) // 6, np.sin(turn), np.cos(turn)
    G = np.array([[1, 0], [0, u3], [0, -u2]])
    Q = G @ cov @ G.T
    if wrong == "three-noises":
        Q = np.diag(np.diag(Q))
    if wrong == "control-sin-cos-swapped":
        u2, u3 = u3, u2
    sign = 1 if wrong == "b18-as-printed" else -1
    M_L = block_diag(np.eye(2), [[u3, u2], [-u2, u3]], [[u3, u2], [sign * u2, u3]])
    M = block_diag(rows(ds, u2, u3), *[M_L] * n)
    J = [slopes(Z[:11], ds, u2, u3)]
    for z in Z[11:].reshape(n, 6):
        _, _, z3, z4, z5, z6 = z
        J.append(np.array([[0, 0, 0], [0, 0, 0], [0, z4, z3], [0, -z3, z4], [0, z6, z5], [0, sign * z5, z6]]))
    noise = np.vstack(J) @ Q @ np.vstack(J).T * (wrong != "no-control-noise")
    if wrong == "no-common-noise":
        noise = block_diag(*[j @ Q @ j.T for j in J])
    after = M.T @ P @ M + noise if wrong == "gtpg" else M @ P @ M.T + noise
    if wrong == "no-cross-blocks":
        edges = [0, *range(11, len(Z) + 1, 6)]
        after = block_diag(*[after[i:j, i:j] for i, j in itertools.pairwise(edges)])
    return {"Z": M @ Z, "P": after}


def update(Z: Any, P: Any, ids: Any, z: Any, cov_z: Any, wrong: str = "") -> Answer:
    Z, P, z, cov_z = arrays(Z, P, z, cov_z)
    H = np.zeros((2 * len(ids), len(Z)))
    for k, i in enumerate(map(int, ids)):
        a, b, at = 2 * k, 2 * k + 1, 11 + 6 * i
        if wrong == "global-measurement":
            H[a, [at, 0]] = H[b, [at + 1, 1]] = 1, -1
        else:
            H[a, [at + 3, at + 4, 7, 8]] = 1, 1, -1, -1
            H[b, [at + 2, at + 5, 6, 9]] = -1, 1, 1, -1
    S = H @ P @ H.T + block_diag(*[cov_z] * len(ids))
    K = np.linalg.solve(S, H @ P).T
    step = K @ (z.ravel() - H @ Z)
    after = Z - step if wrong == "innovation-sign" else Z + step
    if wrong == "heading-renormalised":
        after[2:4] /= np.hypot(*after[2:4])
    return {"Z": after, "P": P - K @ S @ K.T}


def augment(Z: Any, P: Any, z: Any, cov_z: Any, wrong: str = "") -> Answer:
    Z, P, (a, b), cov_z = arrays(Z, P, z, cov_z)
    _, _, z3, z4, z5, z6, _, _, _, _, z11 = Z[:11]
    sign = -1 if wrong == "b26-as-printed" else 1
    G = np.zeros((6, len(Z)))
    G[0, [0, 2, 3]] = 1, -b, a
    G[1, [1, 2, 3]] = 1, a, b
    G[2, [4, 6, 10]] = -b, 1, a
    G[3, [5, 7, 10]] = a, 1, -b
    G[4, [4, 8, 10]] = a, 1, sign * b
    G[5, [5, 9, 10]] = b, 1, a
    new = np.array([[z4, -z3], [z3, z4], [z11, -z5], [z6, -z11], [z5, sign * z11], [z11, z6]])
    own, cross = G @ P @ G.T + new @ cov_z @ new.T, G @ P
    if wrong == "identity-landmark":
        own = np.eye(6)
    if wrong in ("identity-landmark", "no-cross-covariance"):
        cross = 0 * cross
    return {"Z": np.concatenate([Z, G @ Z]), "P": np.block([[P, cross.T], [cross, own]])}


def reduced_predict(m: Any, P: Any, increment: Any, cov: Any, wrong: str = "") -> Answer:
    m, P, (ds, turn), cov = arrays(m, P, increment, cov)
    n, s, c = (len(m) - 4) // 2, np.sin(turn), np.cos(turn)
    own = np.array([[1, 0, 0, ds], [0, 1, ds, 0], [0, 0, c, s], [0, 0, -s, c]])
    R, dR = np.array([[c, s], [-s, c]]), np.array([[-s, c], [-c, -s]])
    if wrong == "landmarks-turn-left":
        R, dR = R.T, dR.T
    M = block_diag(own, *[R] * n)
    J = np.zeros((len(m), 2))
    after = M @ m
    J[:4, 0] = [m[3], m[2], 0, 0]
    J[2:4, 1] = [after[3], -after[2]]
    ahead = np.array([1.0, 0.0])
    for k in range(4, len(m), 2):
        shift = ahead if wrong == "turn-before-drive" else R @ ahead
        after[k : k + 2] -= ds * shift
        J[k : k + 2, 0] = -shift
        J[k : k + 2, 1] = dR @ (m[k : k + 2] - (0 if wrong == "turn-before-drive" else ds) * ahead)
    noise = J @ cov @ J.T
    if wrong == "no-common-noise":
        edges = [0, *range(4, len(m) + 1, 2)]
        pairs = itertools.pairwise(edges)
        noise = block_diag(*[noise[i:j, i:j] for i, j in pairs])
    kept = M.T @ P @ M + noise if wrong == "gtpg" else M @ P @ M.T + noise
    return {"m": after, "P": kept}


def trace(
    x: Any, P: Any, wheelbase: float, dt: float, controls: Any, cov_u: Any, sightings: Any, cov_z: Any,
    wrong: str = "", spoiled: int = -1,
) -> Answer:  # fmt: skip
    """A run; ``spoiled`` is a step after which the first entry of P is 0.1 % too large."""
    Z, P = vehicle(x, P).values()
    places: dict[int, int] = {}
    steps = []
    for k, (u, seen) in enumerate(zip(controls, sightings, strict=True)):
        (v, phi), t = u, np.tan(u[1])
        D = np.array([[dt, 0], [dt * t / wheelbase, v * dt * (1 + t * t) / wheelbase]])
        moved = [v * dt, v * dt * np.tan(phi) / wheelbase]
        Z, P = predict(Z, P, moved, D @ np.array(cov_u) @ D.T, wrong).values()
        both = list(zip(seen["ids"], seen["z"], strict=True))
        known = [(places[i], z) for i, z in both if i in places]
        if known:
            Z, P = update(Z, P, [i for i, _ in known], [z for _, z in known], cov_z, wrong).values()
        for i, z in both:
            if i not in places:
                places[i] = len(places)
                Z, P = augment(Z, P, z, cov_z, wrong).values()
        if k == spoiled:
            P[0, 0] *= 1.001
        steps.append({key: np.array(value).tolist() for key, value in pose(Z[:4], P[:4, :4]).items()})
    return {"steps": steps}


def landmark(x: Any, landmark: Any, wrong: str = "") -> Answer:
    (_, _, angle), (X, Y) = x, landmark
    s, c = np.sin(angle), np.cos(angle)
    if wrong == "cos-before-sin":
        s, c = c, s
    return {"Z": [X, Y, s * X, c * X, s * Y, c * Y]}


# -- exact moments, by quadrature --------------------------------------------------------------------

_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(24)


def quadrature(function: Any, mean: Array, cov: Array) -> tuple[Array, Array]:
    """Mean and covariance of a function of a Gaussian, by Gauss and Hermite with 24 points in each direction.

    For exp(i k theta), k up to 4, and a standard deviation of 0.5 the error of 24 points is below 1e-16.
    The covariance is that of what is left after the value at the mean is taken off.
    """
    values, vectors = np.linalg.eigh(cov)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    axes = np.meshgrid(*[_NODES] * len(mean), indexing="ij")
    at = mean + np.stack([a.ravel() for a in axes], -1) @ root.T
    weights = np.ones(1)
    for _ in mean:
        weights = np.outer(weights, _WEIGHTS / _WEIGHTS.sum()).ravel()
    centre = function(mean[None])[0]
    off = function(at) - centre
    first = weights @ off
    second = (off * weights[:, None]).T @ off - np.outer(first, first)
    return centre + first, second


def _products(p: Array) -> Array:
    x, y, s, c = p[:, 0], p[:, 1], np.sin(p[:, 2]), np.cos(p[:, 2])
    return np.stack([x, y, s, c, s * s, c * c, x * s, x * c, y * s, y * c, s * c], -1)


def gaussian(x: Any, P: Any, wrong: str = "") -> Answer:
    if wrong == "first-order":
        return vehicle(x, P)
    Z, P_Z = quadrature(_products, *arrays(x, P))
    return {"Z": Z, "P_Z": P_Z}


def start(x: Any, P: Any, wrong: str = "") -> Answer:
    Z, P_Z = gaussian(x, P, wrong).values()
    return {"m": Z[:4], "P": P_Z[:4, :4]}


def _control_moments(increment: Array, cov: Array, wrong: str) -> tuple[Array, Array]:
    """Of u1, u2, u3, u2 u2, u2 u3, u3 u3, u1 u2, u1 u3."""

    def monomials(u: Array) -> Array:
        d, s, c = u[:, 0], np.sin(u[:, 1]), np.cos(u[:, 1])
        return np.stack([d, s, c, s * s, s * c, c * c, d * s, d * c], -1)

    w, C = quadrature(monomials, increment, cov)
    if wrong == "product-of-means":
        d, s, c = w[:3]
        w = np.array([d, s, c, s * s, s * c, c * c, d * s, d * c])
    return w, C


def gaussian_predict(Z: Any, P: Any, increment: Any, cov: Any, wrong: str = "") -> Answer:
    """B16 and B18 are linear in the monomials: their coefficients are differences of what U gives."""
    Z, P, increment, cov = arrays(Z, P, increment, cov)
    n = (len(Z) - 11) // 6
    w, C = _control_moments(increment, cov, wrong)

    def whole(u1: float, u2: float, u3: float) -> Array:
        M_L = block_diag(np.eye(2), [[u3, u2], [-u2, u3]], [[u3, u2], [-u2, u3]])
        return np.asarray(block_diag(rows(u1, u2, u3), *[M_L] * n))

    M0 = whole(0, 0, 0)
    one = [whole(*u) - M0 for u in np.eye(3)]
    minus = [whole(*-u) - M0 for u in np.eye(3)]
    linear = [(a - b) / 2 for a, b in zip(one, minus, strict=True)]
    square = [(a + b) / 2 for a, b in zip(one, minus, strict=True)]

    def mixed(i: int, j: int) -> Array:
        return np.asarray(whole(*(np.eye(3)[i] + np.eye(3)[j])) - M0 - one[i] - one[j])

    parts = [*linear, square[1], mixed(1, 2), square[2], mixed(0, 1), mixed(0, 2)]
    M = M0 + sum(value * part for value, part in zip(w, parts, strict=True))
    J = np.stack([part @ Z for part in parts], 1)
    return {"Z": M @ Z, "P": M @ P @ M.T + J @ C @ J.T}


def reduced_gaussian_predict(m: Any, P: Any, increment: Any, cov: Any, wrong: str = "") -> Answer:
    m, P, increment, cov = arrays(m, P, increment, cov)
    w, C = _control_moments(increment, cov, wrong)
    used = [0, 1, 2, 6, 7]
    (d, s, c, ds, dc), C = w[used], C[np.ix_(used, used)]
    n = (len(m) - 4) // 2
    own = np.array([[1, 0, 0, d], [0, 1, d, 0], [0, 0, c, s], [0, 0, -s, c]])
    M = block_diag(own, *[[[c, s], [-s, c]]] * n)
    J = np.zeros((len(m), 5))
    J[:4, :3] = [[m[3], 0, 0], [m[2], 0, 0], [0, m[3], m[2]], [0, -m[2], m[3]]]
    after = M @ m
    for k in range(4, len(m), 2):
        J[k], J[k + 1] = [0, m[k + 1], m[k], 0, -1], [0, -m[k], m[k + 1], 1, 0]
        after[k : k + 2] += [-dc, ds]
    return {"m": after, "P": M @ P @ M.T + J @ C @ J.T}

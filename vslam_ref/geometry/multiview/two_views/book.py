"""Two views, one pair of pictures at a time, as the chapter derives them.

::

    a row a pair          x_b (x) x_a, nine numbers       its product with vec(E) is zero
    eight pairs           one null vector                 then the nearest essential matrix
    five pairs            four null vectors               ten cubics, ten eigenvalues
    E                     four motions                    one has the points in front
    H                     two motions, two planes         sometimes one is possible
    wrong pairs           samples                         the cheapest model wins

Positions are normalised and homogeneous, rows x (N, 3) = (x, y, 1); translations have length 1.  The fast
forms do the same for many samples at once; a test asserts that they agree.
"""

from __future__ import annotations

from collections import Counter
from itertools import combinations_with_replacement, permutations

import numpy as np

from vslam_ref.arrays import Array

Polynomial = dict[str, float]
"""Coefficients of monomials, written as sorted letters: x x y is ``"xxy"``, the constant the empty word."""

THIRD = ["".join(m) for m in combinations_with_replacement("xyz", 3)]
BELOW = ["xx", "xy", "xz", "yy", "yz", "zz", "x", "y", "z", ""]


def rows(x_a: Array, x_b: Array) -> Array:
    """One equation a pair, (N, 9), for the nine numbers of E row by row; ``x (N, 3)`` normalised."""
    return np.array([np.kron(b, a) for a, b in zip(x_a, x_b, strict=True)])  # eq-epipolar-row


def nearest_essential(M: Array) -> Array:
    """E (3, 3) with singular values 1, 1, 0 nearest to a multiple of M (3, 3); no unit."""
    U, _, Vt = np.linalg.svd(M)
    return np.asarray(U @ np.diag([1.0, 1.0, 0.0]) @ Vt)  # eq-nearest-essential


def eight_point(x_a: Array, x_b: Array) -> Array:
    """E (3, 3) of eight or more pairs ``x (N, 3)``, normalised."""
    T_a, T_b = conditioner(x_a), conditioner(x_b)
    M = np.linalg.svd(rows(x_a @ T_a.T, x_b @ T_b.T))[2][-1].reshape(3, 3)  # eq-eight-point
    U, d, Vt = np.linalg.svd(M)
    return nearest_essential(T_b.T @ (U @ np.diag([d[0], d[1], 0.0]) @ Vt) @ T_a)


def conditioner(x: Array) -> Array:
    """Scaling and shift (3, 3) that bring ``x (N, 3)`` to centre 0 and mean distance sqrt(2)."""
    centre = x[:, :2].mean(axis=0)
    s = np.sqrt(2.0) / np.linalg.norm(x[:, :2] - centre, axis=1).mean()
    return np.array([[s, 0, -s * centre[0]], [0, s, -s * centre[1]], [0, 0, 1]])  # eq-normalisation


def times(p: Polynomial, q: Polynomial) -> Polynomial:
    """Product of two polynomials in x, y, z."""
    total: Counter[str] = Counter()
    for a, c in p.items():
        for b, d in q.items():
            total["".join(sorted(a + b))] += c * d  # type: ignore[assignment]
    return dict(total)


def plus(*terms: tuple[float, Polynomial]) -> Polynomial:
    """Sum of multiples of polynomials."""
    total: Counter[str] = Counter()
    for factor, p in terms:
        for a, c in p.items():
            total[a] += factor * c  # type: ignore[assignment]
    return dict(total)


# from five pairs to matrices


def five_point(x_a: Array, x_b: Array) -> list[Array]:
    """All real E (3, 3), of norm sqrt(2), that fit five pairs ``x (5, 3)``, normalised."""
    X, Y, Z, W = np.linalg.svd(rows(x_a, x_b))[2][5:].reshape(4, 3, 3)  # eq-null-space
    E = [[{"x": X[i, j], "y": Y[i, j], "z": Z[i, j], "": W[i, j]} for j in range(3)] for i in range(3)]
    three = range(3)
    EEt = [[plus(*[(1.0, times(E[i][k], E[j][k])) for k in three]) for j in three] for i in three]
    trace = plus(*[(1.0, EEt[i][i]) for i in three])
    ten = []
    for i in three:  # eq-essential-manifold
        for j in three:
            cubic = plus(*[(2.0, times(EEt[i][k], E[k][j])) for k in three], (-1.0, times(trace, E[i][j])))
            ten.append(cubic)
    signs = [(float(np.linalg.det(np.eye(3)[list(p)])), p) for p in permutations(three)]
    ten.append(plus(*[(s, times(times(E[0][p[0]], E[1][p[1]]), E[2][p[2]])) for s, p in signs]))
    A = np.array([[equation.get(m, 0.0) for m in THIRD + BELOW] for equation in ten])
    B = np.linalg.solve(A[:, :10], A[:, 10:])  # each monomial of degree three is -B times those below
    M = np.zeros((10, 10))  # x m = M m for the ten monomials below
    for i, m in enumerate(BELOW):
        product = "".join(sorted("x" + m))
        if len(product) == 3:
            M[i] = -B[THIRD.index(product)]  # eq-action-matrix
        else:
            M[i, BELOW.index(product)] = 1.0
    values, vectors = np.linalg.eig(M)
    found = []
    for value, v in zip(values, vectors.T, strict=True):
        if abs(value.imag) <= 1e-9 * (1 + abs(value)):
            x, y, z = np.real(v[6:9] / v[9])
            E_k = x * X + y * Y + z * Z + W
            found.append(E_k * np.sqrt(2.0) / np.linalg.norm(E_k))
    return found


# from the matrix to the motion


def motions(E: Array) -> list[tuple[Array, Array]]:
    """Four pairs R_b_a (3, 3) and t_b_a (3,) of ``E (3, 3)``; t has length 1."""
    U, _, Vt = np.linalg.svd(E)
    W = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    both = [U @ W @ Vt, U @ W.T @ Vt]  # eq-essential-motions
    return [(R * np.sign(np.linalg.det(R)), sign * U[:, 2]) for sign in (1.0, -1.0) for R in both]


def cost(R: Array, t: Array, x_a: Array, x_b: Array) -> float:
    """Squared distance of one pair ``x_a (3,)``, ``x_b (3,)`` from a point in front; normalised positions.

    ``R (3, 3)``, ``t (3,)`` of length 1.
    """
    a, b = R @ x_a, x_b
    n = np.cross(a, b)
    E = np.cross(np.eye(3), t).T @ R  # hat(t) R, a column at a time
    line_b, line_a = E @ x_a, E.T @ x_b
    if n @ np.cross(b, t) > 0 and n @ np.cross(a, t) > 0:  # eq-two-view-depths
        return float((x_b @ line_b) ** 2 / (line_b[:2] @ line_b[:2] + line_a[:2] @ line_a[:2]))
    e = a[:2] / a[2] - b[:2]
    J = (R[:2, :2] - np.outer(a[:2] / a[2], R[2, :2])) / a[2]
    return float(e @ np.linalg.solve(np.eye(2) + J @ J.T, e))  # eq-homography-sampson


def homography(x_a: Array, x_b: Array) -> Array:
    """H (3, 3) with x_b ~ H x_a of four or more pairs ``x (N, 3)``, by linear equations."""
    T_a, T_b = conditioner(x_a), conditioner(x_b)
    equations = []
    for a, b in zip(x_a @ T_a.T, x_b @ T_b.T, strict=True):
        equations += [np.kron([1, 0, -b[0]], a), np.kron([0, 1, -b[1]], a)]  # eq-homography-dlt
    H = np.linalg.svd(np.array(equations))[2][-1].reshape(3, 3)
    H = np.linalg.inv(T_b) @ H @ T_a
    return np.asarray(H * np.sign(np.sum(x_a @ H[2])) / np.linalg.norm(H))


def consensus(x_a: Array, x_b: Array, sigma: float, draws: int, rng: np.random.Generator) -> Array:
    """E (3, 3) of the smallest truncated cost over samples of five of the pairs ``x (N, 3)``."""
    best, least = np.zeros((3, 3)), np.inf
    for _ in range(draws):
        five = rng.choice(len(x_a), 5, replace=False)
        for E in five_point(x_a[five], x_b[five]):
            line_b, line_a = x_a @ E.T, x_b @ E
            e = np.sum(x_b * line_b, axis=1)
            squared = e**2 / (np.sum(line_b[:, :2] ** 2, axis=1) + np.sum(line_a[:, :2] ** 2, axis=1))
            price = np.minimum(squared / sigma**2, 3.84).mean()  # eq-msac
            if price < least:
                best, least = E, price
    return best

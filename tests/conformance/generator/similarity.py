"""The similarity of least squares by Horn's quaternions, in 50 digits, and what wrong formulas would give.

The rotation is the eigenvector of the largest eigenvalue of a symmetric 4 x 4 matrix made of the sums
of products; the scale and the translation follow from setting derivatives to zero.  No singular value
decomposition is used.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import mpmath
import numpy as np
from mpmath import mpf

from generator.exact import Matrix, column, vector


class Similarity(NamedTuple):
    """target ~ scale R source + t; R a 3 x 3 matrix, t a list."""

    scale: Any
    R: Matrix
    t: list[Any]

    def act(self, x: list[Any]) -> list[Any]:
        """Map one point."""
        moved = self.R * mpmath.matrix(x)
        return [self.scale * moved[i] + self.t[i] for i in range(3)]


def rows(points: Any) -> list[list[Any]]:
    """Points as lists of exact numbers."""
    return [vector(p) for p in np.asarray(points, dtype=np.float64)]


def mean(points: list[list[Any]]) -> list[Any]:
    """Their mean."""
    return [sum(p[i] for p in points) / len(points) for i in range(3)]


def products(source: Any, target: Any) -> tuple[Matrix, Any, Any]:
    """Sum of q p^T about the means, and the sums of squares of both."""
    x, y = rows(source), rows(target)
    a, b = mean(x), mean(y)
    M = mpmath.zeros(3, 3)
    moves_x = moves_y = mpf(0)
    for p, q in zip(x, y, strict=True):
        for i in range(3):
            moves_x += (p[i] - a[i]) ** 2
            moves_y += (q[i] - b[i]) ** 2
            for j in range(3):
                M[i, j] += (q[i] - b[i]) * (p[j] - a[j])
    return M, moves_x, moves_y


def rotation(M: Matrix) -> Matrix:
    """Rotation of the largest trace(R^T M), by Horn's quaternion."""
    trace = M[0, 0] + M[1, 1] + M[2, 2]
    spin = [M[2, 1] - M[1, 2], M[0, 2] - M[2, 0], M[1, 0] - M[0, 1]]
    N = mpmath.zeros(4, 4)
    N[0, 0] = trace
    for i in range(3):
        N[0, i + 1] = N[i + 1, 0] = spin[i]
        for j in range(3):
            N[i + 1, j + 1] = M[i, j] + M[j, i] - (trace if i == j else 0)
    values, vectors = mpmath.eigsy(N)
    assert values[3] - values[2] > mpf("1e-3") * abs(values[3]), "the rotation is not well determined"
    w, x, y, z = [vectors[i, 3] for i in range(4)]
    return mpmath.matrix(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )


def align(source: Any, target: Any, *, with_scale: bool) -> Similarity:
    """Least squares of target - (scale R source + t)."""
    M, moves_x, _ = products(source, target)
    R = rotation(M)
    scale = inner(R, M) / moves_x if with_scale else mpf(1)
    return placed(scale, R, source, target)


def inner(a: Matrix, b: Matrix) -> Any:
    """Sum of products of entries."""
    return sum(a[i, j] * b[i, j] for i in range(3) for j in range(3))


def placed(scale: Any, R: Matrix, source: Any, target: Any) -> Similarity:
    """With the translation that brings the means together."""
    a, b = mean(rows(source)), mean(rows(target))
    turned = column(R * mpmath.matrix(a))
    return Similarity(scale, R, [b[i] - scale * turned[i] for i in range(3)])


def inverse(S: Similarity) -> Similarity:
    """The map back."""
    t = column(S.R.T * mpmath.matrix(S.t))
    return Similarity(1 / S.scale, S.R.T, [-v / S.scale for v in t])

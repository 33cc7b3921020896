"""Fifty-digit arithmetic: definitions, not series that were tuned.

Matrices are mpmath's.  A matrix exponential is the sum of its power series; a logarithm is checked by the
exponential of what it gives.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mpmath
import numpy as np
from mpmath import mp, mpf

DIGITS = 50
mp.dps = DIGITS
Matrix = Any


def vector(values: Any) -> list[Any]:
    """Numbers of 50 digits, each exactly the double it was."""
    return [mpf(v) for v in np.asarray(values, dtype=np.float64).ravel().tolist()]


def matrix(rows: Any) -> Matrix:
    """Matrix of 50-digit numbers from nested lists or an array."""
    return mpmath.matrix(np.asarray(rows, dtype=np.float64).tolist())


def floats(value: Any) -> Any:
    """Nearest doubles, as nested lists."""
    if isinstance(value, mpmath.matrix):
        return [[float(value[i, j]) for j in range(value.cols)] for i in range(value.rows)]
    if isinstance(value, list | tuple | np.ndarray):
        return [floats(v) for v in value]
    return float(value)


def column(M: Matrix) -> list[Any]:
    """Entries of a matrix of one column."""
    return [M[i] for i in range(len(M))]


def hat(phi: Sequence[Any]) -> Matrix:
    """Matrix of the cross product."""
    x, y, z = phi
    return mpmath.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def expm(M: Matrix) -> Matrix:
    """Exponential of a matrix, by its power series; more digits inside.

    A large matrix is halved until it is small, and its exponential squared as often: the terms of the series
    would grow to e^|M| before they fall.
    """
    halvings = max(0, int(mpmath.log(mpmath.mnorm(M, 1) / 16 + 1, 2)))
    with mp.workdps(DIGITS + 20 + halvings):
        part = M / 2**halvings if halvings else M
        total, term, k = mpmath.eye(M.rows), mpmath.eye(M.rows), 0
        while k < 10 or mpmath.mnorm(term, 1) > mpf(10) ** (-DIGITS - 10 - halvings):
            k += 1
            term = term * part / k
            total = total + term
        for _ in range(halvings):
            total = total * total
        return +total


def integrated(M: Matrix) -> Matrix:
    """Sum of M^k / (k + 1)!: the integral of exp(u M) for u from 0 to 1; more digits inside."""
    with mp.workdps(DIGITS + 20):
        total, term, k = mpmath.eye(M.rows), mpmath.eye(M.rows), 0
        while k < 10 or mpmath.mnorm(term, 1) > mpf(10) ** (-DIGITS - 10):
            k += 1
            term = term * M / (k + 1)
            total = total + term
        return +total


def derivative(function: Any, at: Sequence[Any], columns: int | None = None) -> Matrix:
    """Jacobian of a function of a list, by central differences of 50-digit numbers.

    With h = 1e-15 the error is of the order h^2 = 1e-30: far below a double.
    """
    h = mpf(10) ** -15
    n = len(at) if columns is None else columns
    slopes = []
    for j in range(n):
        ahead, behind = list(at), list(at)
        ahead[j], behind[j] = ahead[j] + h, behind[j] - h
        f, g = function(ahead), function(behind)
        slopes.append([(a - b) / (2 * h) for a, b in zip(f, g, strict=True)])
    return mpmath.matrix(slopes).T

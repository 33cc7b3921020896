"""Arrays of 50-digit numbers: NumPy's object arrays, so that a filter reads as its formulas do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from mpmath import mp, mpf

from generator.exact import derivative, floats

Big = Any
"""Array of mpmath's numbers."""


def big(values: Any) -> Big:
    """Array of 50-digit numbers, each exactly the double it was."""
    doubles = np.asarray(values, dtype=np.float64)
    out = np.empty(doubles.shape, dtype=object)
    out.ravel()[:] = [mpf(v) for v in doubles.ravel().tolist()]
    return out


def stack(values: list[Any]) -> Big:
    """Vector of given numbers."""
    out = np.empty(len(values), dtype=object)
    out[:] = values
    return out


def eye(n: int) -> Big:
    """Identity of 50-digit numbers."""
    return big(np.eye(n))


def zeros(*shape: int) -> Big:
    """Zeros of 50-digit numbers."""
    return big(np.zeros(shape))


def from_matrix(M: Any) -> Big:
    """Array of an mpmath matrix."""
    out = np.empty((M.rows, M.cols), dtype=object)
    for i in range(M.rows):
        for j in range(M.cols):
            out[i, j] = mpf(M[i, j])
    return out


def inverse(A: Big) -> Big:
    """Inverse of a square array, by elimination in 50 digits."""
    return from_matrix(mpmath.matrix(A.tolist()) ** -1)


def block_diagonal(blocks: list[Big]) -> Big:
    """Square blocks along the diagonal."""
    out, at = zeros(*(2 * (sum(len(b) for b in blocks),))), 0
    for block in blocks:
        out[at : at + len(block), at : at + len(block)] = block
        at += len(block)
    return out


def jacobian(function: Callable[[Big], Big], at: Big) -> Big:
    """Jacobian by central differences of 50-digit numbers: see :func:`.exact.derivative`."""
    return from_matrix(derivative(lambda values: list(function(stack(values))), list(at)))


def wrap(angle: Any) -> Any:
    """Angle in (-pi, pi]."""
    return angle - 2 * mp.pi * mpmath.ceil((angle - mp.pi) / (2 * mp.pi))


def doubles(value: Big) -> Any:
    """Nearest doubles, nested lists."""
    return floats(value.tolist()) if isinstance(value, np.ndarray) else floats(value)

r"""Solving for the views: dense, or by a band where views only meet their neighbours.

The band is that of all columns before the border, S = [[A, F], [F^T, G]] with A banded and F, G those of
shared lenses.  With Y = A^-1 F, what is left for the border is G - F^T Y: a Schur complement once more.
A factor has the square root of the unit of S.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from vslam_ref.arrays import Array

Method = Literal["dense", "banded"]

BAND_PRICE = 4.0
"""How much longer an operation takes in a band than in a dense matrix, which has larger blocks to work on."""


@dataclass(frozen=True)
class Factor:
    """A factored reduced system.

    Attributes
    ----------
    method : {"dense", "banded"}
    parts : tuple
        LAPACK factors.
    """

    method: Method
    parts: tuple[Any, ...]

    def solve(self, rhs: Array) -> Array:
        """Solve for one or more right sides, (D,) or (D, m)."""
        from scipy.linalg import cho_solve, cho_solve_banded, solve_triangular

        if self.method == "dense":
            return np.asarray(cho_solve((self.parts[0], True), rhs, check_finite=False))
        band, Y, root = self.parts
        border = band.shape[1]
        x = np.empty_like(rhs)
        inner = cho_solve_banded((band, True), rhs[:border], check_finite=False)
        if Y.shape[1] == 0:
            return np.asarray(inner)
        # Y^T rhs = F^T A^-1 rhs: what the rest already explains of the border's right side
        left = rhs[border:] - Y.T @ rhs[:border]
        half = solve_triangular(root, left, lower=True, check_finite=False)
        x[border:] = solve_triangular(root, half, lower=True, trans="T", check_finite=False)
        x[:border] = inner - Y @ x[border:]
        return x


def choose(size: int, border: int, bandwidth: int) -> Method:
    """Return the method that should be quicker, by a count of operations.

    Examples
    --------
    >>> choose(size=1800, border=1800, bandwidth=150), choose(size=144, border=144, bandwidth=143)
    ('banded', 'dense')
    """
    dense = size**3 / 3.0
    shared = size - border
    banded = border * bandwidth * (bandwidth + 4.0 * shared) + border * shared**2
    return "banded" if BAND_PRICE * banded < dense else "dense"


def factor(S: Array, border: int, bandwidth: int, method: Method) -> Factor | None:
    """Cholesky factor of the lower triangle of S (D, D); None where S is not positive definite."""
    from scipy.linalg import LinAlgError, cho_solve_banded, cholesky, cholesky_banded

    try:
        if method == "dense":
            # the upper triangle of the transpose is the lower one of S: LAPACK works on it in place
            return Factor("dense", (cholesky(S, lower=True, check_finite=False),))
        band = cholesky_banded(_band(S, border, bandwidth), lower=True, check_finite=False, overwrite_ab=True)
        F = S[border:, :border].T
        Y = cho_solve_banded((band, True), F, check_finite=False) if F.shape[1] else np.zeros((border, 0))
        G = np.tril(S[border:, border:])
        G = G + np.tril(G, -1).T - F.T @ Y
        root = cholesky(G, lower=True, check_finite=False) if len(G) else np.zeros((0, 0))
        return Factor("banded", (band, Y, root))
    except LinAlgError:
        return None


def _band(S: Array, border: int, bandwidth: int) -> Array:
    """Lower band (bandwidth + 1, border): row k holds the k-th diagonal below the main one."""
    band = np.zeros((bandwidth + 1, border), order="F")
    for k in range(min(bandwidth + 1, border)):
        band[k, : border - k] = np.diagonal(S[:border, :border], -k)
    return band

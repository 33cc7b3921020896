r"""The linear algebra of one step, by orthogonal transformations.

The damped step solves :math:`(J^T J + \lambda D^2)\,\delta = -J^T r`.  These are the normal equations of

.. math::

    \begin{bmatrix} J \\ \sqrt\lambda\,D \end{bmatrix} \delta \approx
    \begin{bmatrix} -r \\ 0 \end{bmatrix} ,

and solving *this* by QR loses as many digits as J has condition, not twice as many.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array

EPS = float(np.finfo(np.float64).eps)


class Covariance(NamedTuple):
    """Covariance of the parameters at a solution.

    Attributes
    ----------
    matrix : ndarray, shape (n, n), or None
        None where it does not exist.
    sigma : float
        Standard deviation of one residual: as given, or from the residuals.
    rank : int
        Numerical rank of the Jacobian, its columns scaled to length 1.
    reason : str
        Empty, or why there is no covariance.
    """

    matrix: Array | None
    sigma: float
    rank: int
    reason: str


def column_lengths(jacobian: Array) -> Array:
    """Lengths (n,) of the columns, without overflow; 1 for a column of zeros."""
    largest = np.abs(jacobian).max(axis=0, initial=0.0)
    safe = np.where(largest > 0.0, largest, 1.0)
    lengths: Array = safe * np.linalg.norm(jacobian / safe, axis=0)
    return np.where(largest > 0.0, lengths, 1.0)


def damped_step(jacobian: Array, residual: Array, damping: float, scale: Array) -> Array | None:
    r"""Levenberg-Marquardt's step.

    Implements :eq:`eq-augmented`.

    Parameters
    ----------
    jacobian : ndarray, shape (m, n)
    residual : ndarray, shape (m,)
    damping : float
        lambda >= 0.
    scale : ndarray, shape (n,)
        Diagonal of D, > 0.

    Returns
    -------
    ndarray, shape (n,), or None
        None where the system is singular to working precision, as it can be for lambda = 0 only.

    Notes
    -----
    The columns are divided by ``scale`` first, so lambda meets columns of like length.

    Examples
    --------
    >>> J, r = np.array([[1.0, 0.0], [0.0, 2.0]]), np.array([2.0, 2.0])
    >>> damped_step(J, r, 0.0, np.ones(2)).round(12).tolist()
    [-2.0, -1.0]
    >>> damped_step(J, r, 1.0, np.ones(2)).round(12).tolist()
    [-1.0, -0.8]
    """
    n = jacobian.shape[1]
    rows, target = jacobian / scale, -residual
    if damping > 0.0:
        rows = np.concatenate([rows, math.sqrt(damping) * np.eye(n)])
        target = np.concatenate([target, np.zeros(n)])
    q, r = np.linalg.qr(rows)
    diagonal = np.abs(np.diag(r))
    if len(rows) < n or diagonal.min(initial=math.inf) <= max(rows.shape) * EPS * diagonal.max(initial=0.0):
        return None
    # LU of a triangular matrix exchanges no rows, so this is back substitution
    step: Array = np.linalg.solve(r, q.T @ target) / scale
    return step if np.isfinite(step).all() else None


def covariance(jacobian: ArrayLike, residual: ArrayLike, sigma: float | None = None) -> Covariance:
    r"""Covariance of fitted parameters, :math:`\sigma^2 (J^T J)^{-1}`.

    Implements :eq:`eq-covariance`.

    Parameters
    ----------
    jacobian : array_like, shape (m, n)
        At the solution; with a robust loss, weighted rows.
    residual : array_like, shape (m,)
        At the solution; weighted likewise.
    sigma : float, optional
        Known standard deviation of one residual.  Without it, the root of ||r||² / (m - n).

    Returns
    -------
    Covariance

    Raises
    ------
    ValueError
        If shapes do not fit or a number is not finite.

    Notes
    -----
    Computed from the QR factor, :math:`(J^T J)^{-1} = R^{-1} R^{-T}`, with columns scaled to length 1.
    Right to first order in the noise.  A rank below n means a direction that no measurement sees.

    Examples
    --------
    >>> covariance(np.ones((4, 1)), [1.0, -1.0, 1.0, -1.0], sigma=1.0).matrix.round(12).tolist()
    [[0.25]]
    >>> covariance(np.ones((4, 2)), np.ones(4)).reason
    'rank 1 of 2: a combination of the parameters is not measured'
    """
    J, r = np.asarray(jacobian, dtype=np.float64), np.asarray(residual, dtype=np.float64)
    if J.ndim != 2 or r.shape != J.shape[:1]:
        raise ValueError(f"Jacobian {J.shape} and residual {r.shape}: need (m, n) and (m,)")
    if not (np.isfinite(J).all() and np.isfinite(r).all()):
        raise ValueError("Jacobian and residual must be finite")
    m, n = J.shape
    scale = column_lengths(J)
    singular = np.linalg.svd(J / scale, compute_uv=False)
    rank = int(np.count_nonzero(singular > max(m, n) * EPS * singular.max(initial=0.0)))
    if sigma is None:
        sigma = float(np.linalg.norm(r)) / math.sqrt(m - n) if m > n else math.inf
    if rank < n:
        reason = f"rank {rank} of {n}: a combination of the parameters is not measured"
        return Covariance(None, sigma, rank, reason)
    if math.isinf(sigma):
        return Covariance(None, sigma, rank, f"{m} residuals for {n} parameters: the noise is unknown")
    root = np.linalg.solve(np.linalg.qr(J / scale, mode="r"), np.eye(n)) / scale[:, None]
    return Covariance(sigma**2 * root @ root.T, sigma, rank, "")

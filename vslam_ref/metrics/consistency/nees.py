"""Normalised squares of errors: NEES of a state, NIS of an innovation.

``q = e^T P^-1 e`` for an error e (..., d) and its claimed covariance P (..., d, d).  It has no
unit and does not depend on the coordinates: with ``e' = A e`` and ``P' = A P A^T`` it is the same
number.  If e is Gaussian with covariance P, q is chi-squared with d degrees of freedom.

A covariance that is not positive definite has no q.  Such a sample is counted in
:attr:`NormalisedSquare.invalid` and its value is NaN, so that a mean over it cannot pass for a number.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array

EPS = float(np.finfo(np.float64).eps)

ASYMMETRY = EPS**0.5
"""A correlation may differ from its transposed twin by this much.

Rounding makes a difference of about eps per step, 2e-12 after 10^4 steps; a lost transpose makes one
of order one.  The square root of eps lies between the two with room on either side.
"""


@dataclass(frozen=True)
class NormalisedSquare:
    """Squared errors in units of their claimed covariance.

    Attributes
    ----------
    value : ndarray, shape (...)
        ``e^T P^-1 e``; NaN where ``invalid``.
    dof : ndarray of int, shape (...)
        Degrees of freedom: the dimension of e, or the rank of P in :func:`nees_singular`.
    invalid : ndarray of bool, shape (...)
        Samples without a value: P has a non-finite entry, is not symmetric or not positive
        definite (for :func:`nees_singular`: has a negative eigenvalue), or e is not finite.
    outside : ndarray, shape (...)
        Length of the part of the error that P declares impossible, each coordinate in its own
        standard deviations.  Zero for a regular P; NaN where ``invalid``.
    """

    value: Array
    dof: NDArray[np.int64]
    invalid: NDArray[np.bool_]
    outside: Array

    @property
    def invalid_count(self) -> int:
        """How many samples have no value."""
        return int(np.count_nonzero(self.invalid))


def nees(error: ArrayLike, cov: ArrayLike) -> NormalisedSquare:
    r"""Normalised estimation error squared, ``e^T P^-1 e``.

    Implements :eq:`eq-nees`.

    Parameters
    ----------
    error : array_like, shape (..., d)
        Truth minus estimate, or the negative; angles already wrapped.
    cov : array_like, shape (..., d, d)
        Claimed covariance of the error.

    Returns
    -------
    NormalisedSquare
        Batch shapes broadcast; ``dof`` is d.

    Raises
    ------
    ValueError
        If the last axes do not fit together.

    Notes
    -----
    Coordinates are scaled to unit variance first, so metres and radians do not spoil the condition.
    P = L D L^T without square roots then gives :math:`q = \sum_j y_j^2 / D_j` with L y = e, and by
    Sylvester's criterion P is positive definite exactly when every pivot D_j is positive.  The pivots of
    a matrix with unit diagonal carry a rounding error of at most d eps or so: a pivot below that is
    not distinguished from zero, and the sample is invalid.

    Examples
    --------
    >>> nees([3.0, 4.0], [[9.0, 0.0], [0.0, 4.0]]).value.item()
    5.0
    """
    e, P = _checked(error, cov)
    e, C, valid, _ = _unit_variance(e, P)
    d = e.shape[-1]
    value = np.zeros(e.shape[:-1])
    for j in range(d):
        pivot = C[..., j, j]
        positive = pivot > d * EPS
        valid &= positive
        pivot = np.where(positive, pivot, 1.0)
        value += e[..., j] ** 2 / pivot  # eq-nees
        column = C[..., j + 1 :, j] / pivot[..., None]
        e[..., j + 1 :] -= column * e[..., j, None]
        C[..., j + 1 :, j + 1 :] -= column[..., :, None] * C[..., None, j + 1 :, j]
    return _result(value, np.full(value.shape, d), valid, np.zeros(value.shape))


def nis(innovation: ArrayLike, S: ArrayLike) -> NormalisedSquare:
    """Normalised innovation squared, ``nu^T S^-1 nu``, chi-squared with m dof for an honest filter.

    Parameters
    ----------
    innovation : array_like, shape (..., m)
        Measured minus predicted.
    S : array_like, shape (..., m, m)
        Innovation covariance ``H P H^T + cov_z``.

    Returns
    -------
    NormalisedSquare
    """
    return nees(innovation, S)


def nees_singular(error: ArrayLike, cov: ArrayLike, *, steps: int = 1) -> NormalisedSquare:
    r"""NEES under a covariance that may be singular: ``e^T P^+ e`` with rank P degrees of freedom.

    Implements :eq:`eq-nees`, with the pseudo-inverse where P is singular.

    Parameters
    ----------
    error : array_like, shape (..., d)
        Truth minus estimate.
    cov : array_like, shape (..., d, d)
        Positive semi-definite covariance.
    steps : int
        Number of updates that P has been through; they all add rounding.

    Returns
    -------
    NormalisedSquare
        ``dof`` is the rank found for every sample.  ``outside`` is the length of the error's part in the
        null space, which the pseudo-inverse leaves out and P declares impossible.

    Raises
    ------
    ValueError
        If the last axes do not fit together or ``steps`` is less than 1.

    Notes
    -----
    The lifted pose (x, y, sin theta, cos theta) has four coordinates and three freedoms.  Lifted by its
    Jacobian, a covariance has the null vector (0, 0, sin theta, cos theta): the heading vector may
    turn, not stretch.  The truth, on the circle, leaves the tangent by 1 - cos(delta theta), which is
    what ``outside`` shows.

    Rank: coordinates are scaled to unit variance, the eigenvalues then sum to d.  An eigenvalue solver is
    backward stable, so each is exact to ``d eps lambda_max``; every one of ``steps`` updates adds as much.
    Eigenvalues below ``k = d * steps * eps * lambda_max`` are taken for zero; one below ``-k`` is
    negative, and the sample is invalid.
    """
    if steps < 1:
        raise ValueError(f"steps must be at least 1, got {steps}")
    e, P = _checked(error, cov)
    e, C, valid, known = _unit_variance(e, P, semidefinite=True)
    C = np.where(valid[..., None, None], C, 0.0)
    eigenvalues, V = np.linalg.eigh(C)
    tolerance = e.shape[-1] * steps * EPS * eigenvalues[..., -1:]
    valid &= np.all(eigenvalues >= -tolerance, axis=-1)
    inside = eigenvalues > tolerance
    y = np.einsum("...ij,...i->...j", V, e)
    value = np.sum(np.where(inside, y**2 / np.where(inside, eigenvalues, 1.0), 0.0), axis=-1)
    outside = np.sqrt(np.sum(np.where(inside, 0.0, y) ** 2, axis=-1))
    outside = np.where(known, np.inf, outside)
    return _result(value, np.count_nonzero(inside, axis=-1), valid, outside)


def _checked(error: ArrayLike, cov: ArrayLike) -> tuple[Array, Array]:
    """Float copies of error and covariance, broadcast to one batch shape."""
    e, P = np.asarray(error, dtype=np.float64), np.asarray(cov, dtype=np.float64)
    if e.ndim < 1 or P.ndim < 2 or e.shape[-1] < 1 or P.shape[-2:] != (e.shape[-1], e.shape[-1]):
        raise ValueError(f"need an error (..., d) and a covariance (..., d, d), got {e.shape} and {P.shape}")
    batch = np.broadcast_shapes(e.shape[:-1], P.shape[:-2])
    d = e.shape[-1]
    return np.broadcast_to(e, (*batch, d)).copy(), np.broadcast_to(P, (*batch, d, d)).copy()


def _unit_variance(
    e: Array, P: Array, semidefinite: bool = False
) -> tuple[Array, Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Scale to unit variances.

    Returns e and P scaled and symmetric, which samples are usable so far, and which have an error in a
    coordinate that P knows exactly (a zero variance, allowed when ``semidefinite``).
    """
    variance = np.einsum("...ii->...i", P).copy()
    usable = np.all(np.isfinite(P), axis=(-1, -2)) & np.all(np.isfinite(e), axis=-1)
    least = variance >= 0.0 if semidefinite else variance > 0.0
    usable &= np.all(least, axis=-1)
    positive = usable[..., None] & (variance > 0.0)
    scale = np.where(positive, 1.0 / np.sqrt(np.where(positive, variance, 1.0)), 1.0)
    known = usable & np.any(~positive & (e != 0.0), axis=-1)
    e = np.where(usable[..., None], e, 0.0) * scale
    C = np.where(usable[..., None, None], P, 0.0) * scale[..., :, None] * scale[..., None, :]
    usable &= np.all(np.abs(C - np.swapaxes(C, -1, -2)) <= ASYMMETRY, axis=(-1, -2))
    return e, (C + np.swapaxes(C, -1, -2)) / 2, usable, known


def _result(
    value: Array, dof: NDArray[np.int64] | NDArray[np.intp], valid: NDArray[np.bool_], outside: Array
) -> NormalisedSquare:
    """Put NaN where there is no value."""
    return NormalisedSquare(
        value=np.where(valid, value, np.nan),
        dof=np.asarray(dof, dtype=np.int64),
        invalid=~valid,
        outside=np.where(valid, outside, np.nan),
    )

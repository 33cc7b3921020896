"""Errors of planar poses, and their NEES: by coordinates, and on SE(2).

The NEES has no unit, as in :mod:`~vslam_ref.metrics.consistency.nees`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.geometry import se2, so2
from vslam_ref.metrics.consistency.nees import NormalisedSquare, nees


def pose_error(truth: ArrayLike, mean: ArrayLike) -> Array:
    """Truth minus estimate in (x, y, theta), the heading wrapped to (-pi, pi].

    Parameters
    ----------
    truth, mean : array_like, shape (..., 3)
        Poses in the world: metres, metres, radians.

    Returns
    -------
    ndarray, shape (..., 3)
    """
    truth, mean = np.asarray(truth, dtype=np.float64), np.asarray(mean, dtype=np.float64)
    e = truth - mean
    return np.concatenate([e[..., :2], so2.wrap(e[..., 2:])], axis=-1)


def nees_pose(truth: ArrayLike, mean: ArrayLike, cov: ArrayLike) -> NormalisedSquare:
    """NEES of a pose in (x, y, theta): the curve of B's figures 2 and 3, 3 dof.

    Parameters
    ----------
    truth, mean : array_like, shape (..., 3)
        Poses in the world: metres, metres, radians.
    cov : array_like, shape (..., 3, 3)
        Claimed covariance in the same coordinates.

    Returns
    -------
    NormalisedSquare
    """
    return nees(pose_error(truth, mean), cov)


def nees_se2(truth: ArrayLike, mean: ArrayLike, cov: ArrayLike) -> NormalisedSquare:
    r"""NEES of a pose in the logarithm of SE(2), 3 dof.

    Parameters
    ----------
    truth, mean : array_like, shape (..., 3)
        Poses in the world: metres, metres, radians.
    cov : array_like, shape (..., 3, 3)
        Claimed covariance of (x, y, theta); mapped here to the tangent space.

    Returns
    -------
    NormalisedSquare

    Notes
    -----
    The error is taken in the axes of the estimated vehicle, :math:`\xi = \mathrm{Log}(\hat T^{-1} T)`
    (the left-invariant error).  To first order, with R of the estimated heading,
    :math:`\xi = (R^T (\delta x, \delta y), \delta\theta)`, so the covariance is ``J P J^T`` with
    ``J = blkdiag(R^T, 1)``.

    The house perturbs on the left, :math:`T = \mathrm{Exp}(\xi_w) \hat T` (errors in world axes).  It
    makes no difference here: :math:`\xi_w = \mathrm{Ad}_{\hat T}\,\xi` holds exactly and the two
    covariances are related by the same matrix, so both give the same number.

    Against :func:`nees_pose` only the logarithm's curvature is new: the translation is
    ``V(phi)^-1`` times the chord, an arc in place of a straight line.  The two agree to a factor
    1 + O(phi).
    """
    mean = np.asarray(mean, dtype=np.float64)
    xi = se2.log(se2.between(mean, truth))
    J = np.zeros((*mean.shape[:-1], 3, 3))
    J[..., :2, :2] = np.swapaxes(so2.exp(mean[..., 2]), -1, -2)
    J[..., 2, 2] = 1.0
    return nees(xi, J @ np.asarray(cov, dtype=np.float64) @ np.swapaxes(J, -1, -2))


def heading_vector_error(truth: ArrayLike, lifted_mean: ArrayLike) -> Array:
    """Error in the lifted coordinates (x, y, sin theta, cos theta) of B5.

    Parameters
    ----------
    truth : array_like, shape (..., 3)
        True pose (x, y, theta).
    lifted_mean : array_like, shape (..., 4)
        The filter's z1 ... z4.

    Returns
    -------
    ndarray, shape (..., 4)
        Truth minus estimate.
    """
    truth = np.asarray(truth, dtype=np.float64)
    lifted = np.concatenate([truth[..., :2], np.sin(truth[..., 2:]), np.cos(truth[..., 2:])], axis=-1)
    return lifted - np.asarray(lifted_mean, dtype=np.float64)

r"""When two pictures do not tell the motion, and why.

Four models explain a set of pairs: the camera stood still (no unknowns), it turned (three numbers), it saw
a plane (a homography, eight numbers), or it moved among points in space (an essential matrix, five
numbers, and one more for each point).  The more a model may bend, the better it fits; what counts is
whether the better fit is worth the unknowns.  Torr's criterion charges for both,

.. math:: \mathrm{GRIC} = \sum_j \min\bigl(e_j^2/\sigma^2,\; 2 (4 - d)\bigr) + \log(4)\, d N + \log(4 N)\, k ,

with four coordinates a pair, d the dimension of the manifold that the pairs lie on (two for a map from
picture to picture, three for epipolar lines) and k the unknowns of the model.  The cheapest model is the
name of the case.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.geometry.multiview.two_views._pairs import checked_pairs, checked_sigma, homogeneous
from vslam_ref.geometry.multiview.two_views.sampson_distance import essential_sampson, homography_squared

MAP, LINES = 2, 3
"""Dimension of the manifold of pairs of a map from picture to picture, and of an epipolar geometry."""
LEAST = 5


class Degeneracy(Enum):
    """What the pairs tell; the value is the sentence."""

    NONE = ""
    TOO_FEW = "too few pairs"
    NO_PARALLAX = "no parallax: both pictures are the same, up to the noise"
    PURE_ROTATION = "pure rotation: a turn alone explains the pairs, the direction of motion is not seen"
    PLANE = "all points lie on a plane: two motions may explain it"


@dataclass(frozen=True)
class Verdict:
    """Which model explains the pairs most cheaply.

    Attributes
    ----------
    degeneracy : Degeneracy
    criterion : dict of str to float
        Torr's criterion of ``still``, ``rotation``, ``plane`` and ``space``; no unit.  Empty for too few
        pairs.
    R_b_a : ndarray, shape (3, 3)
        The rotation that fits best without any translation.
    """

    degeneracy: Degeneracy
    criterion: dict[str, float]
    R_b_a: Array

    @property
    def reason(self) -> str:
        """Empty, or what is wrong."""
        return self.degeneracy.value


def degeneracy(xn_a: ArrayLike, xn_b: ArrayLike, E: ArrayLike, H: ArrayLike, *, sigma: float) -> Verdict:
    """Name the case that the right pairs are.

    Implements :eq:`eq-gric`.

    Parameters
    ----------
    xn_a, xn_b : array_like, shape (N, 2)
        Normalised positions of the pairs that count, those of either model's consensus.
    E, H : array_like, shape (3, 3)
        The best essential matrix and homography of these pairs.
    sigma : float
        Standard deviation of one coordinate, pixels over focal length.

    Returns
    -------
    Verdict

    Raises
    ------
    ValueError
        If shapes do not fit, a number is not finite, or ``sigma`` is not positive.

    Examples
    --------
    >>> a = np.array([[x, y] for x in (-0.4, 0.0, 0.4) for y in (-0.3, 0.0, 0.3)])
    >>> E = [[0, 0, 0], [0, 0, -1], [0, 1, 0.0]]
    >>> degeneracy(a, a, E, np.eye(3), sigma=1e-3).degeneracy.name
    'NO_PARALLAX'
    """
    a, b = checked_pairs(xn_a, xn_b)
    sigma = checked_sigma(sigma)
    if len(a) < LEAST:
        return Verdict(Degeneracy.TOO_FEW, {}, np.eye(3))
    R = best_rotation(a, b)
    criterion = {
        "still": torr_criterion(_map(np.eye(3), a, b, sigma), MAP, 0),
        "rotation": torr_criterion(_map(R, a, b, sigma), MAP, 3),
        "plane": torr_criterion(_map(np.asarray(H, dtype=np.float64), a, b, sigma), MAP, 8),
        "space": torr_criterion(essential_sampson(E, a, b) ** 2 / sigma**2, LINES, 5),
    }
    names = (Degeneracy.NO_PARALLAX, Degeneracy.PURE_ROTATION, Degeneracy.PLANE, Degeneracy.NONE)
    return Verdict(names[int(np.argmin(list(criterion.values())))], criterion, R)


def torr_criterion(squared: ArrayLike, dimension: int, unknowns: int) -> float:
    """Torr's criterion of squared distances (N,) in units of sigma^2; the result has no unit.

    Implements :eq:`eq-gric`.  ``dimension`` of the manifold: 2 for a map, 3 for epipolar lines.

    >>> round(torr_criterion(np.zeros(10), 2, 8), 6)
    57.236923
    """
    e = np.asarray(squared, dtype=np.float64)
    fit = np.minimum(e, 2.0 * (4 - dimension)).sum()
    return float(fit + math.log(4.0) * dimension * len(e) + math.log(4.0 * max(len(e), 1)) * unknowns)


def best_rotation(xn_a: ArrayLike, xn_b: ArrayLike) -> Array:
    """Rotation (3, 3) that turns the bearings of a onto those of b, in least squares.

    ``xn_a (N, 2)`` and ``xn_b (N, 2)`` are normalised positions.

    Implements :eq:`eq-rotation-only`.

    >>> (best_rotation([[0.0, 0.0], [0.1, 0.2]], [[0.0, 0.0], [0.1, 0.2]]).round(9) + 0.0).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    a, b = checked_pairs(xn_a, xn_b, 2)
    rays = [homogeneous(x) for x in (a, b)]
    rays = [r / np.linalg.norm(r, axis=-1, keepdims=True) for r in rays]
    U, _, Vt = np.linalg.svd(rays[1].T @ rays[0])
    return np.asarray(U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt)


def _map(H: Array, a: Array, b: Array, sigma: float) -> Array:
    return np.asarray(homography_squared(H, a, b) / sigma**2)

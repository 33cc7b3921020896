r"""Of several motions the one that has the points in front, far points not punished.

For a motion (R, t) the depths of a pair along both rays are, with :math:`a = R x_a` and :math:`b = x_b`,

.. math:: \lambda_a = -\frac{(b \times a) \cdot (b \times t)}{\lVert b \times a \rVert^2}, \qquad
          \lambda_b = \frac{(a \times b) \cdot (a \times t)}{\lVert a \times b \rVert^2} ,

and their signs need no division.  A far point has almost parallel rays, and noise decides on which side of
infinity they meet.  To count it as wrong would throw away the best witnesses of the rotation, and let a
motion win that has fewer far points.  So ask for the nearest point that *is* in front: its inverse depth
must not be negative.  If the rays meet in front, the pair costs its Sampson distance.  If not, the best
allowed inverse depth is zero: the pair costs its distance to the image of infinity,
:math:`x_b \sim R x_a`.  For a far point that is the same to the noise; for a near one behind the camera it
is large.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array, times
from vslam_ref.geometry import se3
from vslam_ref.geometry.multiview.epipolar import essential_from_motion
from vslam_ref.geometry.multiview.two_views._pairs import checked_pairs, checked_sigma, homogeneous
from vslam_ref.geometry.multiview.two_views.sampson_distance import essential_sampson, homography_squared


class Cheirality(NamedTuple):
    """What pairs cost under motions.

    Attributes
    ----------
    squared : ndarray, shape (..., N)
        Squared distances in units of sigma^2: Sampson's in front, to the image of infinity behind.
    front : ndarray of bool, shape (..., N)
        Whether the rays meet in front of both cameras.
    parallax : ndarray, shape (..., N)
        Angle between both rays, radians, in [0, pi].
    """

    squared: Array
    front: BoolArray
    parallax: Array


def cheirality(T_b_a: ArrayLike, xn_a: ArrayLike, xn_b: ArrayLike, sigma: float = 1.0) -> Cheirality:
    """Squared distance of each pair from the nearest point in front of both cameras.

    Implements :eq:`eq-cheirality-cost`.

    Parameters
    ----------
    T_b_a : array_like, shape (..., 4, 4)
        Motions; only the direction of a translation counts, and without one every point is at infinity.
    xn_a, xn_b : array_like, shape (N, 2)
        Normalised positions.
    sigma : float
        Standard deviation of one coordinate of them: pixels over focal length.

    Returns
    -------
    Cheirality

    Raises
    ------
    ValueError
        If shapes do not fit, a number is not finite, or ``sigma`` is not positive.

    Examples
    --------
    >>> T = se3.exp([-1.0, 0, 0, 0, 0, 0])  # near points move to the left
    >>> at = cheirality(T, [[0.0, 0.0], [0.0, 0.0]], [[-0.2, 0.0], [0.2, 0.0]], sigma=0.1)
    >>> at.front.tolist(), (at.squared.round(9) + 0.0).tolist()  # the second one moves to the right
    ([True, False], [0.0, 2.0])
    """
    T = as_array("T_b_a", T_b_a, 4, 4)
    xa, xb = checked_pairs(xn_a, xn_b)
    sigma = checked_sigma(sigma)
    a = homogeneous(xa) @ np.swapaxes(se3.rotation(T), -1, -2)  # (..., N, 3)
    b, t = homogeneous(xb), se3.translation(T)[..., None, :]
    across = np.cross(a, b)
    front = (np.sum(across * np.cross(b, t), axis=-1) > 0) & (np.sum(across * np.cross(a, t), axis=-1) > 0)
    at_infinity = homography_squared(se3.rotation(T), xa, xb)
    on_line = essential_sampson(essential_from_motion(T), xa, xb) ** 2
    # to first order the constraint of infinity holds the epipolar one; rounding must not make it cheaper
    squared = np.where(front, on_line, np.maximum(at_infinity, on_line)) / sigma**2
    parallax = np.arctan2(np.linalg.norm(across, axis=-1), np.sum(a * b, axis=-1))
    return Cheirality(squared, front, parallax)


def depths(T_b_a: ArrayLike, xn_a: ArrayLike, xn_b: ArrayLike) -> Array:
    """Depths (..., N, 2) of pairs ``xn (N, 2)`` in cameras a and b, in the unit of the translation.

    Implements :eq:`eq-two-view-depths`.  ``T_b_a (..., 4, 4)``.  Infinite where the rays are parallel.
    """
    T = as_array("T_b_a", T_b_a, 4, 4)
    xa, xb = checked_pairs(xn_a, xn_b)
    a, b = times(se3.rotation(T)[..., None, :, :], homogeneous(xa)), homogeneous(xb)
    t = se3.translation(T)[..., None, :]
    across = np.cross(a, b)
    square = np.sum(across**2, axis=-1)
    both = [np.sum(across * np.cross(ray, t), axis=-1) for ray in (b, a)]
    safe = np.where(square > 0, square, 1.0)
    return np.stack([np.where(square > 0, top / safe, np.inf) for top in both], axis=-1)

r"""What a point in one image says about the other: it lies on a line.

The centres of two cameras and a point span a plane.  In the frame of camera b the plane holds the bearing
:math:`b_b`, the baseline :math:`t = t_{ba}`, and the other bearing turned into this frame,
:math:`R b_a`.  Three vectors of one plane have no volume:

.. math:: b_b^T (t \times R\, b_a) = b_b^T E\, b_a = 0, \qquad E = \hat t R .
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array, times, transpose
from vslam_ref.geometry import se3, so3


def relative_motion(T_a_world: ArrayLike, T_b_world: ArrayLike) -> Array:
    """``T_b_a`` (..., 4, 4) of ``T_a_world (..., 4, 4)`` and ``T_b_world (..., 4, 4)``.

    T_b_a = T_b_world T_a_world^-1; translations in any unit.
    """
    return se3.compose(T_b_world, se3.inverse(T_a_world))


def essential_from_motion(T_b_a: ArrayLike) -> Array:
    """Essential matrix E = hat(t) R of a motion (..., 4, 4), with b_b^T E b_a = 0 for bearings of one point.

    Implements :eq:`eq-essential`.  E (..., 3, 3) has the unit of the translation, any; bearings have none.

    Examples
    --------
    >>> T_b_a = se3.exp([-1.0, 0, 0, 0, 0, 0])  # camera b stands one to the right
    >>> E = essential_from_motion(T_b_a)
    >>> X_a = np.array([0.3, -0.2, 4.0])
    >>> bool(abs(se3.act(T_b_a, X_a) @ E @ X_a) < 1e-15)
    True
    """
    T = as_array("T_b_a", T_b_a, 4, 4)
    return np.asarray(so3.hat(se3.translation(T)) @ se3.rotation(T))


def fundamental_from_essential(E: ArrayLike, K_a: ArrayLike, K_b: ArrayLike) -> Array:
    """F = K_b^-T E K_a^-1, (..., 3, 3): the same relation between the pixels (u, v, 1) of pinholes.

    Implements :eq:`eq-fundamental`.
    ``E (..., 3, 3)``, ``K_a (..., 3, 3)``, ``K_b (..., 3, 3)``; focal lengths and centres in pixels.
    """
    inverse_a = np.asarray(np.linalg.inv(as_array("K_a", K_a, 3, 3)), dtype=np.float64)
    inverse_b = np.asarray(np.linalg.inv(as_array("K_b", K_b, 3, 3)), dtype=np.float64)
    return np.asarray(transpose(inverse_b) @ as_array("E", E, 3, 3) @ inverse_a)


def epipolar_distance(F: ArrayLike, uv_a: ArrayLike, uv_b: ArrayLike) -> Array:
    """Signed distance (...), pixels, of ``uv_b (..., 2)`` from the line F (u_a, v_a, 1) in image b.

    ``F (..., 3, 3)``, ``uv_a (..., 2)`` in pixels.

    Implements :eq:`eq-epipolar-distance`.
    At the epipole there is no line; the distance is then 0, as every line passes.
    """
    value, _, line_b = _lines(F, uv_a, uv_b)
    return _quotient(value, np.linalg.norm(line_b, axis=-1))


def sampson_distance(F: ArrayLike, uv_a: ArrayLike, uv_b: ArrayLike) -> Array:
    """Signed length, pixels, of the smallest change of both pixels that makes them fit, to first order.

    Implements :eq:`eq-sampson`: x_b^T F x_a over the length of its gradient in (u_a, v_a, u_b, v_b).

    Parameters
    ----------
    F : array_like, shape (..., 3, 3)
    uv_a, uv_b : array_like, shape (..., 2)
        Pixels, or normalised positions with E in the place of F.

    Examples
    --------
    >>> F = essential_from_motion(se3.exp([-1.0, 0, 0, 0, 0, 0]))  # rows are epipolar lines
    >>> round(float(sampson_distance(F, [0.1, 0.2], [0.0, 0.26])), 12)  # 0.06 apart, shared by two
    0.042426406871
    """
    value, line_a, line_b = _lines(F, uv_a, uv_b)
    return _quotient(value, np.sqrt((line_a**2).sum(-1) + (line_b**2).sum(-1)))


def _lines(F: ArrayLike, uv_a: ArrayLike, uv_b: ArrayLike) -> tuple[Array, Array, Array]:
    """x_b^T F x_a, and the normals (..., 2) of both epipolar lines, which are its gradients."""
    F, a, b = as_array("F", F, 3, 3), _homogeneous("uv_a", uv_a), _homogeneous("uv_b", uv_b)
    line_b, line_a = times(F, a), times(transpose(F), b)
    value: Array = np.sum(b * line_b, axis=-1)
    return value, line_a[..., :2], line_b[..., :2]


def _homogeneous(name: str, uv: ArrayLike) -> Array:
    uv = as_array(name, uv, 2)
    return np.concatenate([uv, np.ones((*uv.shape[:-1], 1))], -1)


def _quotient(value: Array, length: Array) -> Array:
    return np.where(length > 0, value / np.where(length > 0, length, 1.0), 0.0)

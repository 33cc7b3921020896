"""Unit quaternions (w, x, y, z), Hamilton's product: rotations of space in four numbers.

``q = (cos(theta/2), sin(theta/2) a)`` turns by theta about the unit axis a.  q and -q are the same
rotation.  Products read as those of the matrices, ``matrix(compose(a, b)) = matrix(a) @ matrix(b)``.  Batch
axes come first.  Quaternions have no unit, rotation vectors are in radians; arrays of other shapes raise
ValueError.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array
from vslam_ref.geometry.coefficients import rotation_coefficients
from vslam_ref.geometry.orthonormal import rotation_of


def identity(shape: tuple[int, ...] = ()) -> Array:
    """Quaternions of no rotation, shape (*shape, 4)."""
    q = np.zeros((*shape, 4))
    q[..., 0] = 1.0
    return q


def normalise(q: ArrayLike) -> Array:
    """Divide by the length, shape (..., 4).

    Raises
    ------
    ValueError
        If a quaternion is zero or not finite.
    """
    q = as_array("q", q, 4)
    # of very large or small numbers the squares would leave the range
    size = np.abs(q).max(-1, keepdims=True)
    if not np.all((size > 0.0) & np.isfinite(size)):
        raise ValueError("a quaternion is zero or not finite: it is not a rotation")
    scaled = q / size
    return np.asarray(scaled / np.linalg.norm(scaled, axis=-1, keepdims=True))


def canonical(q: ArrayLike) -> Array:
    """Of q and -q (..., 4) the one with w > 0; where w = 0, with the first other nonzero number positive."""
    q = as_array("q", q, 4)
    first = np.argmax(q != 0.0, axis=-1)[..., None]
    return np.where(np.take_along_axis(q, first, -1) < 0.0, -q, q)


def compose(a: ArrayLike, b: ArrayLike) -> Array:
    """Hamilton's product of ``a (..., 4)`` and ``b (..., 4)``: first b, then a.

    >>> compose([0, 1, 0, 0], [0, 0, 1, 0]).tolist()  # i j = k
    [0.0, 0.0, 0.0, 1.0]
    """
    a, b = as_array("a", a, 4), as_array("b", b, 4)
    aw, av, bw, bv = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    w = aw * bw - np.sum(av * bv, -1, keepdims=True)
    return np.concatenate([w, aw * bv + bw * av + np.cross(av, bv)], -1)


def inverse(q: ArrayLike) -> Array:
    """Conjugate of a unit quaternion, shape (..., 4)."""
    conjugate: Array = as_array("q", q, 4) * np.array([1.0, -1.0, -1.0, -1.0])
    return conjugate


def act(q: ArrayLike, x: ArrayLike) -> Array:
    """Turn points ``x (..., 3)`` by unit quaternions ``q (..., 4)``: x + w t + v x t with t = 2 v x x."""
    q, x = as_array("q", q, 4), as_array("x", x, 3)
    v = q[..., 1:]
    t = 2.0 * np.cross(v, x)
    return np.asarray(x + q[..., :1] * t + np.cross(v, t))


def matrix(q: ArrayLike) -> Array:
    """Rotation matrix of a unit quaternion, shape (..., 4) -> (..., 3, 3)."""
    w, x, y, z = np.moveaxis(as_array("q", q, 4), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def from_matrix(R: ArrayLike, *, project: bool = False) -> Array:
    """Quaternion of a rotation matrix, :func:`canonical`, shape (..., 3, 3) -> (..., 4).

    Raises
    ------
    ValueError
        If a matrix is no rotation up to rounding; with ``project`` the nearest rotation is taken, and only
        a matrix without one is refused.

    Examples
    --------
    >>> from_matrix([[-1, 0, 0], [0, 1, 0], [0, 0, -1]]).tolist()  # half a turn about y
    [0.0, 0.0, 1.0, 0.0]
    """
    return of_rotation(rotation_of("R", R, project))


def of_rotation(R: Array) -> Array:
    """:func:`from_matrix` of what is known to be rotations ``R (..., 3, 3)``: nothing is checked.

    The ten sums below are 4 q q^T.  Each row of it is q times one of q's own entries; the row of
    the largest entry, which is at least 1/2, loses no digits at any angle.
    """
    d = np.diagonal(R, axis1=-2, axis2=-1)
    K = np.empty((*R.shape[:-2], 4, 4))
    K[..., 0, 0] = 1.0 + d.sum(-1)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        K[..., i + 1, i + 1] = 1.0 + d[..., i] - d[..., j] - d[..., k]
        K[..., j + 1, k + 1] = K[..., k + 1, j + 1] = R[..., j, k] + R[..., k, j]
        K[..., 0, i + 1] = K[..., i + 1, 0] = R[..., k, j] - R[..., j, k]
    largest = np.argmax(np.diagonal(K, axis1=-2, axis2=-1), axis=-1)  # eq-log-rotation
    row = np.take_along_axis(K, largest[..., None, None], -2)[..., 0, :]
    return canonical(row / np.linalg.norm(row, axis=-1, keepdims=True))


def exp(phi: ArrayLike) -> Array:
    """Unit quaternion of a rotation vector, radians, shape (..., 3) -> (..., 4).

    (cos(theta/2), sin(theta/2) a) for the angle theta about the unit axis a.
    """
    half = as_array("phi", phi, 3) / 2.0
    c = rotation_coefficients(np.sum(half * half, -1))
    return np.concatenate([c[0][..., None], c[1][..., None] * half], -1)


def log(q: ArrayLike) -> Array:
    """Rotation vector of length 0 to pi, radians, shape (..., 4) -> (..., 3).

    2 atan2(|v|, w) is well conditioned at every angle, and does not mind a length that is not quite 1.  At
    half a turn both ends of the axis are right; :func:`canonical` says which one is returned.
    """
    q = canonical(q)
    w, v = q[..., :1], q[..., 1:]
    n = np.linalg.norm(v, axis=-1, keepdims=True)
    zero = n == 0.0  # also where the squares underflow: then sin = tan = angle
    factor = np.where(zero, 2.0 / np.where(w > 0.0, w, 1.0), 2.0 * np.arctan2(n, w) / np.where(zero, 1.0, n))
    return np.asarray(factor * v)  # eq-log-rotation


def interpolate(a: ArrayLike, b: ArrayLike, fraction: ArrayLike) -> Array:
    """Turn at constant speed from a (fraction 0) to b (1), the short way round; shapes (..., 4), (...)."""
    fraction = np.asarray(fraction, dtype=np.float64)[..., None]
    return compose(a, exp(fraction * log(compose(inverse(a), b))))


def random(rng: np.random.Generator, shape: tuple[int, ...] = ()) -> Array:
    """Uniform rotations, shape (*shape, 4), either sign: four Gaussians have no preferred direction."""
    return normalise(rng.standard_normal((*shape, 4)))

"""How wide, how thin and how stretched a set of points is.

::

      . :.                                            *   a far point: beyond FAR times the usual
     . m  .   . . . drawn near . .x . . . . . . .         distance from the middle m; its direction
      :. .                                                is what counts
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array

FAR = 10.0
"""Distance from the middle of the points, in medians of these distances, beyond which a point is far.

Up to there the equations find the pose without weights; beyond, what a far point says of the translation is
less than a tenth of what the others say.
"""


def nearness(X_world: ArrayLike) -> Array:
    """Weights (N,) of the points' equations: 1, and for a far point the usual distance over its own.

    Distances are those from the median point, and the usual one is their median; a point is far beyond
    :data:`FAR` of it.

    Parameters
    ----------
    X_world : array_like, shape (N, 3)

    Examples
    --------
    >>> X = np.array([[0, 0, 4], [1, 0, 5], [0, 2, 5], [-1, 1, 5], [0, 0, 2005.0]])
    >>> nearness(X)
    array([1.   , 1.   , 1.   , 1.   , 0.0005])
    """
    X = as_array("X_world", X_world, 3)
    if len(X) == 0:
        return np.ones(0)
    distance = np.linalg.norm(X - np.median(X, axis=0), axis=1)
    usual = float(np.median(distance))
    far = distance > FAR * usual
    return np.where(far, usual / np.where(far, distance, 1.0), 1.0) if usual > 0 else np.ones(len(X))


def point_shape(X: Array) -> tuple[Array, Array, Array, float]:
    """Middle, extents along three axes (falling), the axes (rows), and the root mean square distance.

    A far point is drawn near, towards the middle of the others: it leaves neither their plane nor their line.
    """
    if len(X) == 0:
        return np.zeros(3), np.zeros(3), np.eye(3), 1.0
    weight = nearness(X)
    middle = X[weight == 1.0].mean(axis=0)
    _, s, axes = np.linalg.svd((X - middle) * weight[:, None], full_matrices=True)
    axes[2] = np.cross(axes[0], axes[1])  # right-handed
    extent = np.pad(s, (0, 3 - len(s))) / np.sqrt(len(X))
    rounding = 8 * np.finfo(np.float64).eps * float(np.abs(X).max())
    extent = np.where(extent > rounding, extent, 0.0)
    size = float(np.sqrt(np.sum(extent**2)))
    return middle, extent, axes, size if size > 0 else 1.0

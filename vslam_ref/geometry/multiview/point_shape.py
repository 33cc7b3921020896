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

FAR = 20.0
"""Distance from the centre of the densest third, in its radii, beyond which a point is far.

Points that are ten times as far from the camera as the others do no harm unweighted; beyond, what a far point
says of the translation is less than a tenth of what the others say.
"""
COMPARED = 200
"""So many points at most are compared with each other to find the densest third."""


def nearness(X_world: ArrayLike) -> Array:
    """Weights (N,) of the points' equations: 1, and for a far point the usual distance over its own.

    The *densest third* is the smallest ball around one of the points that holds a third of them (and three
    at least): its centre and its radius are the middle and the usual distance.  So even where most points
    are far it is the near ones that set the scale.

    Parameters
    ----------
    X_world : array_like, shape (N, 3)

    Examples
    --------
    >>> X = np.array([[0, 0, 5], [0, 3, 5], [0, -4, 5], [0, 0, 8], [0, 0, 2005.0]])
    >>> nearness(X)
    array([1.    , 1.    , 1.    , 1.    , 0.0015])
    """
    X = as_array("X_world", X_world, 3)
    if len(X) < 4:
        return np.ones(len(X))
    some = X[np.linspace(0, len(X) - 1, min(len(X), COMPARED)).round().astype(int)]
    apart = np.sort(np.linalg.norm(some[:, None] - some, axis=-1), axis=1)
    reach = apart[:, max(2, -(-len(some) // 3) - 1)]  # the point itself is the first
    usual = float(reach.min())
    distance = np.linalg.norm(X - some[np.argmin(reach)], axis=1)
    far = distance > FAR * usual
    return np.where(far, usual / np.where(far, distance, 1.0), 1.0) if usual > 0 else np.ones(len(X))


def point_shape(X: Array) -> tuple[Array, Array, Array, float]:
    """Of ``X (N, 3)``: middle, extents along three axes (falling), axes (rows), root mean square distance.

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

"""The pinhole: straight lines stay straight, xd = (x/z, y/z)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import BoolArray, as_array
from vslam_ref.geometry.cameras.camera import Camera
from vslam_ref.geometry.cameras.interface import (
    MAX_TAN,
    Distorted,
    DistortedJacobians,
    Lens,
    Rays,
    normalise,
    normalise_jacobian,
    rays_through,
)


def distort(k: ArrayLike, X_cam: ArrayLike) -> Distorted:
    """Normalised position (..., 2) of points ``X_cam (..., 3)`` in any unit; ``k`` is empty, (..., 0).

    Examples
    --------
    >>> distort([], [2.0, 1.0, 4.0]).xd
    array([0.5 , 0.25])
    """
    return Distorted(*normalise(X_cam))


def distort_jacobian(k: ArrayLike, X_cam: ArrayLike) -> DistortedJacobians:
    """:func:`distort`, ``k (..., 0)``, and its Jacobian (..., 2, 3) in the point, per unit of X.

    [[1, 0, -x/z], [0, 1, -y/z]] / z.
    """
    return normalise_jacobian(X_cam)


def undistort(k: ArrayLike, xd: ArrayLike) -> Rays:
    """Ray (..., 3) through a normalised position (..., 2), no unit."""
    xd = as_array("xd", xd, 2)
    valid: BoolArray = np.all(np.abs(xd) < MAX_TAN, axis=-1)
    return rays_through(xd, valid)


def max_angle(k: ArrayLike) -> float:
    """Half of the field, a number in radians: a right angle less 1e-6; ``k (0,)``."""
    return float(np.arctan(MAX_TAN))


LENS = Lens((), distort, distort_jacobian, undistort, max_angle)


@dataclass(frozen=True)
class Pinhole(Camera):
    """Pinhole camera.

    Implements :eq:`eq-a1-2` (A1.2).

    Parameters
    ----------
    fx, fy : float
        Focal lengths, pixels.
    cx, cy : float
        Principal point, pixels; (0, 0) is the centre of the top-left pixel.

    Examples
    --------
    >>> Pinhole(fx=500.0, fy=500.0, cx=319.5, cy=239.5).project([0.2, -0.1, 2.0]).uv
    array([369.5, 214.5])
    """

    lens: ClassVar[Lens] = LENS

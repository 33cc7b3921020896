"""Cameras that look along -z with y up, as OpenGL's, BAL's and Bundler's: the conversion to ours.

::

    file    P = R X + t,   p = -(P_x, P_y) / P_z,   (u, v) = f (1 + k1 |p|^2 + k2 |p|^4) p,   v up
    ours    z ahead, y down, v down:   X_cam = F P,   (u, v) -> (u, -v),   F = diag(1, -1, -1)

F is half a turn about x, its own inverse.  With X_cam = (P_x, -P_y, -P_z) the normalised position is
(P_x, -P_y) / -P_z = (p_x, -p_y): the same point of the image, its second coordinate counted downwards.  So
f, k1 and k2 stay, and the pixel's origin, the principal point, stays where it is.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.bundle.problem import Freedom, Scene, freedom
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Radtan

FLIP = np.diag([1.0, -1.0, -1.0])
DOWN = np.array([1.0, -1.0])
FREE = ("f", "k1", "k2")


def scene(R: Array, t: Array, lenses: Array, X_world: Array) -> Scene:
    """Scene of cameras that look back.

    Parameters
    ----------
    R, t : ndarray, shapes (V, 3, 3) and (V, 3)
        World to camera, as in the file.
    lenses : ndarray, shape (V, 3)
        f, k1, k2.
    X_world : ndarray, shape (N, 3)
    """
    params = np.zeros((len(lenses), len(Radtan.names())))
    f, k1, k2 = lenses.T
    columns = {"fx": f, "fy": f, "k1": k1, "k2": k2}
    for name, values in columns.items():
        params[:, Radtan.names().index(name)] = values
    return Scene(se3.from_rt(FLIP @ R, t @ FLIP), X_world, params)


def free(scene: Scene) -> Freedom:
    """Freedom of such a problem: everything, with f, k1, k2 of each camera."""
    return freedom(Radtan, scene, intrinsics=FREE)

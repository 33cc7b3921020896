r"""The seven coordinates that no image shows: where the world's frame is, how it is turned, and its scale.

Move, turn and scale the world and all cameras with it: every image stays the same.  A reconstruction is
therefore a whole family, and its normal matrix has rank seven too few.  Three ways to live with it:

* *free*: leave it to the damping.  In its metric, steps have no part along the family, since the gradient has
  none; the answer lies near the start.
* *fixed*: :func:`fix_gauge` holds six coordinates of one view and one of another.
* *tied*: fixed points or views, as in local adjustment.

The minimum, the images and every angle and ratio of lengths are the same with a free and with a fixed gauge;
the covariances of single coordinates are not (:mod:`.covariance`).  What is tied at more than seven
coordinates is bent to fit them: its minimum is higher.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.bundle.problem import BundleProblem, Freedom, Scene
from vslam_ref.geometry import camera_pose, se3, so3

DIRECTIONS = ("x", "y", "z", "turn x", "turn y", "turn z", "scale")


def gauge_directions(scene: Scene) -> tuple[Array, Array]:
    """How views and points move with the world, to first order.

    Implements :eq:`eq-gauge`.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    views : ndarray, shape (V, 6, 7)
        Tangent vector of each view, for a unit of each of ``DIRECTIONS``.
    points : ndarray, shape (N, 3, 7)

    Notes
    -----
    With Exp(eps) on the world, a point becomes X + rho + phi x X and a view T Exp(-eps) = Exp(-Ad_T eps) T.
    With the world 1 + s times as large, a point becomes X + s X and a view has the translation t + s t.
    """
    T, X = scene.T_cam_world, scene.X_world
    views, points = np.zeros((len(T), 6, 7)), np.zeros((len(X), 3, 7))
    views[:, :, :6] = -se3.adjoint(T)
    views[:, :3, 6] = se3.translation(T)
    points[:, :, :3], points[:, :, 3:6], points[:, :, 6] = np.eye(3), -so3.hat(X), X
    return views, points


def fix_gauge(problem: BundleProblem, view: int = 0) -> BundleProblem:
    """Hold a view, and one coordinate of the view farthest from it.

    Parameters
    ----------
    problem : BundleProblem
    view : int
        The view that is held.

    Returns
    -------
    BundleProblem
        The other view's coordinate is the one of its translation that a change of scale would move most.

    Raises
    ------
    ValueError
        If there is no such view, or no second one at another place.
    """
    T = problem.scene.T_cam_world
    if not 0 <= view < len(T):
        raise ValueError(f"view {view}: there are {len(T)} (numbers 0 to {len(T) - 1})")
    centres = camera_pose.centre_from_pose(T)
    distance = np.linalg.norm(centres - centres[view], axis=1)
    other = int(np.argmax(distance))
    if not distance[other] > 0.0:
        raise ValueError("the scale cannot be held: all views are at one place")
    pulled = T[other, :3, :3] @ (centres[other] - centres[view])
    pose = problem.free.pose.copy()
    pose[view] = False
    pose[other, int(np.argmax(np.abs(pulled)))] = False
    return replace(problem, free=Freedom(pose, problem.free.point, problem.free.intrinsics))

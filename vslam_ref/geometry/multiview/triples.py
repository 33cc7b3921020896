"""A pose from few or badly spread points: all triples are tried, and the best pose is kept."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.geometry import se3
from vslam_ref.geometry.multiview.linear_pose import LinearPose, PoseState, checked_rays, no_pose
from vslam_ref.geometry.multiview.three_points import p3p

TRIED = 12
"""Of so many points, spread from the nearest to the farthest, all triples are tried."""


def best_of_three(bearings: ArrayLike, X_world: ArrayLike) -> LinearPose:
    """Of the poses of triples the one in which all points lie best on their rays, and in front.

    Angles from rays are what is compared, so a far point counts as any other.  At most ``TRIED`` points
    give triples.  Parameters, returns and errors as for :func:`resect_linear`; at least four points.

    Examples
    --------
    >>> X = np.array([[0, 0, 4], [1, 0, 5], [0, 2, 6], [-100, 100, 5000.0]])
    >>> best_of_three(X / np.linalg.norm(X, axis=1, keepdims=True), X).T_cam_world.round(6) + 0.0
    array([[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., 0.], [0., 0., 0., 1.]])
    """
    b, X = checked_rays(bearings, X_world)
    if len(X) < 4:
        return no_pose(PoseState.TOO_FEW, "p3p")
    tried = np.arange(len(X))
    if len(X) > TRIED:
        order = np.argsort(np.linalg.norm(X - np.median(X, axis=0), axis=1), kind="stable")
        tried = order[np.linspace(0, len(X) - 1, TRIED).round().astype(int)]
    triples = np.array(list(combinations(tried.tolist(), 3)))
    found = p3p(b[triples], X[triples])
    poses = found.T_cam_world[found.valid]
    X_cam = se3.act(poses[:, None], X)
    front = (np.sum(X_cam * b, axis=-1) > 0).all(axis=1)
    if not front.any():
        return no_pose(PoseState.BEHIND if len(poses) else PoseState.AMBIGUOUS, "p3p")
    poses, X_cam = poses[front], X_cam[front]
    sine = np.linalg.norm(np.cross(X_cam, b), axis=-1) / np.linalg.norm(X_cam, axis=-1)
    order = np.argsort(np.sum(sine**2, axis=1))
    return LinearPose(poses[order[0]], PoseState.OK, "p3p", 0.0)

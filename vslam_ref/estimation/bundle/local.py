"""Local bundle adjustment: the newest view and its neighbours move, the views around them hold them in place.

Adjusting a whole map takes longer the larger it is.  After a new keyframe, almost everything that changes
is near it::

    active views     the newest and its neighbours: they move
    their points     all points that an active view sees: they move
    fixed ring       other views that see one of these points: they stay, and tie the rest to the map
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.bundle.problem import BundleProblem, Freedom, Scene
from vslam_ref.geometry import camera_pose


class Local(NamedTuple):
    """A part of a problem, and which views, points and observations of the whole it holds.

    Attributes
    ----------
    problem : BundleProblem
        Views: the active ones, then the ring.  Lenses are all kept, and do not move.
    active, ring : ndarray of int, shapes (a,), (r,)
        Numbers (indices, no unit) of views in the whole problem.
    points, observations : ndarray of int, shapes (N,), (n,)
        Numbers of points and observations in the whole problem.
    """

    problem: BundleProblem
    active: IntArray
    ring: IntArray
    points: IntArray
    observations: IntArray

    def put_back(self, whole: BundleProblem, scene: Scene) -> BundleProblem:
        """Return the whole problem with the part's active views and points at a scene of the part."""
        T, X = whole.scene.T_cam_world.copy(), whole.scene.X_world.copy()
        T[self.active] = scene.T_cam_world[: len(self.active)]
        X[self.points] = scene.X_world
        return whole.at(Scene(T, X, whole.scene.intrinsics))


def nearest_views(T_cam_world: ArrayLike, view: int, count: int = 4) -> IntArray:
    """Numbers of the ``count`` views whose centres are nearest to that of ``view``, nearest first.

    PTAM adjusts the newest keyframe and its four nearest.

    Examples
    --------
    >>> from vslam_ref.geometry import se3
    >>> T = se3.from_rt(np.eye(3), [[0.0, 0, 0], [3, 0, 0], [1, 0, 0], [9, 0, 0]])
    >>> nearest_views(T, 3, count=2).tolist()
    [1, 2]
    """
    centres = camera_pose.centre_from_pose(T_cam_world)
    distance = np.linalg.norm(centres - centres[view], axis=1)
    distance[view] = -1.0
    order: IntArray = np.argsort(distance, kind="stable")
    return order[1 : count + 1]


def local_problem(problem: BundleProblem, active: ArrayLike) -> Local:
    """Cut out what a local adjustment of some views needs.

    Implements the choice of :eq:`eq-a2-9` (A2.9) for local adjustment: active keyframes, fixed ring.

    Parameters
    ----------
    problem : BundleProblem
        The whole; what is fixed there stays fixed.
    active : array_like of int, shape (a,)
        Numbers (indices, no unit) of the views that move.

    Returns
    -------
    Local

    Raises
    ------
    ValueError
        If ``active`` is empty, repeats a view, or names one that is not there.
    """
    views, points, _ = problem.sizes
    numbers = np.asarray(active, dtype=np.int64)
    unique = np.unique(numbers)
    if not len(numbers) or len(unique) < len(numbers) or unique[0] < 0 or unique[-1] >= views:
        raise ValueError(f"active={numbers.tolist()}: need different numbers of views, 0 to {views - 1}")
    seen = problem.seen
    moving = np.zeros(points, dtype=np.bool_)
    moving[seen.point[np.isin(seen.view, numbers)]] = True
    used = np.flatnonzero(moving[seen.point])
    ring = np.setdiff1d(seen.view[used], numbers)
    part_views = np.concatenate([numbers, ring])
    part_points = np.flatnonzero(moving)
    scene = problem.scene
    pose = problem.free.pose[part_views].copy()
    pose[len(numbers) :] = False
    no_lens: Array = np.zeros((scene.intrinsics.shape[1], 0))
    part = replace(seen.only(moving[seen.point]), view=_renumber(part_views, views)[seen.view[used]])
    part = replace(part, point=_renumber(part_points, points)[seen.point[used]])
    cut = BundleProblem(
        problem.model,
        Scene(scene.T_cam_world[part_views], scene.X_world[part_points], scene.intrinsics),
        part,
        problem.lens_of_view[part_views],
        Freedom(pose, problem.free.point[part_points], no_lens),
    )
    return Local(cut, numbers, ring, part_points, used)


def _renumber(kept: IntArray, count: int) -> IntArray:
    """Table from old to new numbers; -1 for what is not kept."""
    table = np.full(count, -1, dtype=np.int64)
    table[kept] = np.arange(len(kept))
    return table

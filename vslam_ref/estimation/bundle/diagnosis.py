"""What is wrong with a problem, before anything is solved.

None of this stops the solver; but a point that was seen once has no depth, and a user of its
coordinates should know.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import IntArray
from vslam_ref.estimation.bundle.problem import BundleProblem
from vslam_ref.estimation.bundle.projection import reprojection


class Diagnosis(NamedTuple):
    """Numbers (indices, no unit) of the views, points and observations that something is wrong with.

    Attributes
    ----------
    unseen_points : ndarray of int, shape (a,)
        Points without an observation: they stay where they are.
    once_seen_points : ndarray of int, shape (b,)
        Points with one observation: their depth is not measured, and they do not constrain the view.
    empty_views : ndarray of int, shape (c,)
        Views without an observation: they stay where they are.
    weak_views : ndarray of int, shape (d,)
        Free views with fewer than three points, which leave the pose open.
    behind : ndarray of int, shape (e,)
        Observations whose point is behind its camera, or has no image for another reason.
    parts : int
        Number of groups of views that no point ties together; more than one means as many free gauges.
    """

    unseen_points: IntArray
    once_seen_points: IntArray
    empty_views: IntArray
    weak_views: IntArray
    behind: IntArray
    parts: int

    def sentences(self) -> list[str]:
        """One sentence for everything that was found.

        Examples
        --------
        >>> none = np.zeros(0, dtype=np.int64)
        >>> Diagnosis(none, np.array([3, 8]), none, none, none, 1).sentences()
        ['points seen once, whose depth is not measured: 2 (first: 3)']
        """
        rows = (
            ("points without an observation, which stay", self.unseen_points),
            ("points seen once, whose depth is not measured", self.once_seen_points),
            ("views without an observation, which stay", self.empty_views),
            ("views that see fewer than three points, which leaves their pose open", self.weak_views),
            ("observations of a point behind the camera", self.behind),
        )
        found = [f"{words}: {len(which)} (first: {which[0]})" for words, which in rows if len(which)]
        if self.parts > 1:
            found.append(f"the views fall into {self.parts} groups that no point ties together")
        return found


def diagnose(problem: BundleProblem) -> Diagnosis:
    """Look for what makes a problem ill-posed.

    Parameters
    ----------
    problem : BundleProblem

    Returns
    -------
    Diagnosis
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    views, points, n = problem.sizes
    seen = problem.seen
    by_point = np.bincount(seen.point, minlength=points)
    by_view = np.bincount(seen.view, minlength=views)
    sees = csr_array((np.ones(n, dtype=np.int64), (seen.view, seen.point)), shape=(views, points))
    used = np.flatnonzero(by_view)
    parts = connected_components((sees @ sees.T)[used][:, used], directed=False)[0] if len(used) else 0
    free = problem.free.pose.any(1)
    return Diagnosis(
        unseen_points=np.flatnonzero(by_point == 0),
        once_seen_points=np.flatnonzero(by_point == 1),
        empty_views=np.flatnonzero(by_view == 0),
        weak_views=np.flatnonzero(free & (by_view > 0) & (by_view < 3)),
        behind=np.flatnonzero(~reprojection(problem).valid),
        parts=int(parts),
    )

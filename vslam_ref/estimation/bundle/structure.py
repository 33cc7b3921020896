"""Where everything stands in the linear system: orders and columns; computed once a problem.

The system of one step has an arrow's shape.  With the views first and the points last::

          views     points
        [   B    |    W    ]      B  block diagonal, one block a view (and a border for shared lenses)
        [--------+---------]      C  block diagonal, 3 x 3 a point
        [  W^T   |    C    ]      W  a block for every observation

*Columns.*  View i owns up to 6 + q columns of the reduced system: its pose and, unless other views share its
lens, the q free directions of its intrinsics.  Shared lenses have their columns behind all views.  Fixed
coordinates have none: they get the number ``size``, a column that is computed and thrown away.  So do
directions that a set of another family does not have.

*Orders.*  Views are renumbered by reverse Cuthill-McKee on "see a point in common", which gathers the reduced
system near its diagonal.  Points are ordered by their first view, so that a chunk of them touches few
columns.  Observations are sorted by point, then shared lens, then view.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.estimation.bundle.families import own_columns
from vslam_ref.estimation.bundle.problem import BundleProblem, Observations
from vslam_ref.estimation.bundle.projection import BundleState, Links
from vslam_ref.estimation.bundle.weights import whitener


@dataclass(frozen=True)
class Structure:
    """Orders and index tables of one problem.

    Attributes
    ----------
    order : ndarray, shape (n,)
        Number in the problem of each sorted observation.
    point_order : ndarray, shape (N,)
        Number in the problem of each sorted point.
    links : Links
        Of the sorted observations; point numbers are those of the sorted points.
    whitener : ndarray, shape (n, 2, 2)
        U with U^T U the inverse covariance; the identity where none was given.
    has_cov : bool
    offsets : ndarray, shape (N + 1,)
        Observations of sorted point j are ``offsets[j]`` to ``offsets[j + 1]``.
    view_order, view_offsets : ndarray, shapes (n,) and (V + 1,)
        Sorted observations gathered by view.
    columns : ndarray, shape (V, d)
    size : int
        Columns of the reduced system.
    border : int
        First column of the shared lenses; ``size`` where there are none.
    bandwidth : int
        Largest distance of two columns before the border that share a point.
    free_point : ndarray, shape (N,)
        Of the sorted points.
    """

    order: IntArray
    point_order: IntArray
    links: Links
    whitener: Array
    has_cov: bool
    offsets: IntArray
    view_order: IntArray
    view_offsets: IntArray
    columns: IntArray
    size: int
    border: int
    bandwidth: int
    free_point: BoolArray

    def whitened(self, r: Array) -> Array:
        """Residuals (n, 2) of the sorted observations, in standard deviations."""
        return np.einsum("nab,nb->na", self.whitener, r) if self.has_cov else r

    def state(self, problem: BundleProblem) -> BundleState:
        """Start of the problem, its points sorted."""
        T = problem.scene.T_cam_world
        X = problem.scene.X_world[self.point_order]
        R, t = np.ascontiguousarray(T[:, :3, :3]), np.ascontiguousarray(T[:, :3, 3])
        return BundleState(R, t, X, problem.scene.intrinsics)


def structure(problem: BundleProblem) -> Structure:
    """Sort a problem and number its columns."""
    views, points, _ = problem.sizes
    seen = problem.seen
    rank = _view_ranks(problem)
    columns, border, size = _columns(problem, rank)
    first = np.full(points, views, dtype=np.int64)
    np.minimum.at(first, seen.point, rank[seen.view])
    point_order = np.argsort(first, kind="stable")
    sorted_point = np.empty(points, dtype=np.int64)
    sorted_point[point_order] = np.arange(points)
    lens = problem.lens_of_view[seen.view]
    by_lens = lens if border < size else np.zeros_like(lens)
    order = np.lexsort((rank[seen.view], by_lens, sorted_point[seen.point]))
    links = Links(seen.view[order], sorted_point[seen.point[order]], lens[order], seen.uv[order])
    counts = np.bincount(links.point, minlength=points)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    view_order = np.argsort(links.view, kind="stable")
    view_offsets = np.concatenate([[0], np.cumsum(np.bincount(links.view, minlength=views))])
    return Structure(
        order=order,
        point_order=point_order,
        links=links,
        whitener=_whitener(problem.seen)[order],
        has_cov=seen.cov_uv is not None,
        offsets=offsets,
        view_order=view_order,
        view_offsets=view_offsets,
        columns=columns,
        size=size,
        border=border,
        bandwidth=_bandwidth(links, columns, border, offsets),
        free_point=problem.free.point[point_order],
    )


def _view_ranks(problem: BundleProblem) -> IntArray:
    """Rank of each view in the order of elimination: reverse Cuthill-McKee on the covisibility graph."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    views, points, n = problem.sizes
    seen = problem.seen
    sees = csr_array((np.ones(n, dtype=np.int32), (seen.view, seen.point)), shape=(views, points))
    order = reverse_cuthill_mckee((sees @ sees.T).tocsr(), symmetric_mode=True)
    rank = np.empty(views, dtype=np.int64)
    rank[order] = np.arange(views)
    return rank


def _columns(problem: BundleProblem, rank: IntArray) -> tuple[IntArray, int, int]:
    """Columns (V, 6 + q) of each view's coordinates, first column of the border, number of columns."""
    views, _, _ = problem.sizes
    q = problem.free.intrinsics.shape[1]
    sets = len(problem.scene.intrinsics)
    shared = bool(np.bincount(problem.lens_of_view, minlength=sets).max(initial=0) > 1)
    free = np.ones((views, 6 + q), dtype=np.bool_)
    free[:, :6] = problem.free.pose
    moves = _moves(problem)
    free[:, 6:] = False if shared else moves[problem.lens_of_view]
    by_rank = np.argsort(rank)
    numbers = np.cumsum(free[by_rank].ravel()).reshape(views, 6 + q) - 1
    columns = np.empty((views, 6 + q), dtype=np.int64)
    columns[by_rank] = numbers
    border = int(free.sum())
    size = border
    if shared:
        moves[np.bincount(problem.lens_of_view, minlength=sets) == 0] = False
        columns[:, 6:] = border + (np.cumsum(moves.ravel()).reshape(sets, q) - 1)[problem.lens_of_view]
        free[:, 6:] = moves[problem.lens_of_view]
        size += int(moves.sum())
    columns[~free] = size
    return columns, border, size


def _moves(problem: BundleProblem) -> BoolArray:
    """Which free directions move each set of intrinsics, (L, q): those with an entry in its own columns."""
    own = own_columns(problem.model, len(problem.scene.intrinsics))
    return np.asarray((own[:, :, None] & (problem.free.intrinsics != 0.0)).any(1))


def _whitener(seen: Observations) -> Array:
    """Whitening matrices (n, 2, 2), or a broadcast identity."""
    if seen.cov_uv is None:
        return np.broadcast_to(np.eye(2), (len(seen), 2, 2))
    return whitener(seen.cov_uv)


def _bandwidth(links: Links, columns: IntArray, border: int, offsets: IntArray) -> int:
    """Largest distance of two columns before the border that meet at a point or in a view."""
    inside = columns < border
    low = np.where(inside, columns, border).min(1, initial=border)
    high = np.where(inside, columns, -1).max(1, initial=-1)
    widest = int((high - low).max(initial=0))
    starts = offsets[:-1][np.diff(offsets) > 0]
    if len(starts) and border:
        first = np.minimum.reduceat(low[links.view], starts)
        last = np.maximum.reduceat(high[links.view], starts)
        widest = max(widest, int((last - first).max()))
    return max(widest, 0)

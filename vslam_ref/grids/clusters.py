"""Things in D: cells that lie together are one thing, and a thing is followed from scan to scan.

* A *cluster* is a set of decided cells of D of which each lies within ``join`` metres of another (the larger
  of the two coordinate distances; 0.3 m joins the two legs of a person).
* A *track* is a row of clusters.  At each scan every track predicts where its thing is now, from its place
  and velocity; clusters and predictions are paired so that the sum of the distances is least, none beyond
  ``gate``.  What is left begins a track; what was not seen for ``lost_seconds`` ends.
* *Velocity* is the slope of the line through the places of the last ``velocity_seconds``, by least squares.
* A track is *moving* when it was seen in ``confirm`` scans and has come ``least_move`` metres away from where
  it was ``move_seconds`` ago, on a way not more than ``wander`` times as long: the flicker of a table's legs
  goes to and fro.
"""

from __future__ import annotations

import bisect
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.grids.log_odds import DECIDED_LOG_ODDS, LogOddsGrid
from vslam_ref.support.config import assume


@dataclass(frozen=True)
class TrackConfig:
    """How clusters are made and followed; every field says why it has its value."""

    join: float = assume(0.3, "m", "the legs of a person")
    least_cells: int = assume(3, "", "one or two cells are mostly noise or a table's leg")
    gate: float = assume(0.5, "m", "2 m/s over a quarter of a second")
    lost_seconds: float = assume(1.0, "s", "a person behind a pillar")
    velocity_seconds: float = assume(1.0, "s", "a step or two")
    confirm: int = assume(5, "", "scans; fewer give no velocity worth the name")
    least_move: float = assume(1.0, "m", "more than the size of a table")
    move_seconds: float = assume(5.0, "s", "what stood before does not count; 0.2 m/s still moves")
    wander: float = assume(1.6, "", "noise of a centre lengthens the way of a walker")

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name in ("join", "gate", "lost_seconds", "velocity_seconds", "least_move", "move_seconds"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)!r}: must be positive")
        if self.least_cells < 1 or self.confirm < 2 or not self.wander >= 1:
            raise ValueError("need least_cells >= 1, confirm >= 2 and wander >= 1")


class Clusters(NamedTuple):
    """Clusters of one time.

    Attributes
    ----------
    centres : ndarray, shape (K, 2)
        Mean of the cells' centres in the world, metres.
    sizes : ndarray, shape (K, 2)
        Extent along x and y, whole cells, metres.
    counts : ndarray of int, shape (K,)
        Cells.
    cells : ndarray of int, shape (n, 2)
        (row, column) of all cells in clusters.
    labels : ndarray of int, shape (n,)
        The cluster of each.
    """

    centres: Array
    sizes: Array
    counts: IntArray
    cells: IntArray
    labels: IntArray


def find_clusters(dynamic: LogOddsGrid, join: float = 0.3, least_cells: int = 1) -> Clusters:
    """Return the clusters of the decided cells of D, ordered by their first cell.

    Parameters
    ----------
    dynamic : LogOddsGrid
        D, as from :meth:`StaticDynamicMap.dynamic`.
    join : float
        Metres up to which two cells belong together, along each axis.
    least_cells : int
        Smaller clusters are left out.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    found = np.flatnonzero(dynamic.log_odds > DECIDED_LOG_ODDS)
    cells = np.stack(np.divmod(found, max(dynamic.lattice.shape[1], 1)), axis=1)
    if not len(cells):
        return Clusters(
            np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0, np.int64), cells, np.zeros(0, np.int64)
        )
    reach = join / dynamic.resolution + 1e-9  # cells; distances are whole numbers
    pairs = cKDTree(cells).query_pairs(reach, p=np.inf, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(cells),) * 2)
    _, labels = connected_components(links, directed=False)
    counts = np.bincount(labels)
    large = counts[labels] >= least_cells
    cells, (_, labels) = cells[large], np.unique(labels[large], return_inverse=True)
    K = int(labels.max(initial=-1)) + 1
    counts = np.bincount(labels, minlength=K)
    xy = dynamic.lattice.world_from_cells(cells)
    centres, sizes = np.empty((K, 2)), np.empty((K, 2))
    for axis in range(2):
        centres[:, axis] = np.bincount(labels, xy[:, axis], minlength=K) / np.maximum(counts, 1)
        low, high = np.full(K, np.inf), np.full(K, -np.inf)
        np.minimum.at(low, labels, xy[:, axis])
        np.maximum.at(high, labels, xy[:, axis])
        sizes[:, axis] = high - low + dynamic.resolution
    return Clusters(centres, sizes, counts, cells, labels)


@dataclass
class Track:
    """One thing over time: places (n, 2), sizes (n, 2) and cells when it was seen; velocity (2,), m/s."""

    id: int
    times: list[float] = field(default_factory=list)
    places: list[Array] = field(default_factory=list)
    sizes: list[Array] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    velocity: Array = field(default_factory=lambda: np.zeros(2))

    def predicted(self, time: float) -> Array:
        """Where the thing is (2,) at ``time``, s, if it goes on as it did; world, metres."""
        return self.places[-1] + self.velocity * (time - self.times[-1])


class Tracker:
    """Follows clusters.

    Attributes
    ----------
    tracks : list of Track
        Those that are alive.
    moved : dict of int to Track
        All tracks, alive or not, that were ever moving.

    Examples
    --------
    >>> tracker = Tracker()
    >>> for k in range(12):
    ...     seen = Clusters(np.array([[0.1 * k, 1.0]]), np.full((1, 2), 0.3), np.array([6]), None, None)
    ...     active = tracker.update(0.1 * k, seen)
    >>> len(tracker.moved), active[0].velocity.round(6)
    (1, array([1., 0.]))
    """

    def __init__(self, config: TrackConfig | None = None) -> None:
        self.config = TrackConfig() if config is None else config
        self.tracks: list[Track] = []
        self.moved: dict[int, Track] = {}
        self._next = 0

    def update(self, time: float, clusters: Clusters) -> list[Track]:
        """Take in the clusters of one time, later than the last; return the tracks that are seen now.

        Raises
        ------
        ValueError
            If the time is not later.
        """
        c = self.config
        if any(time <= track.times[-1] for track in self.tracks):
            raise ValueError(f"time {time} s: must be later than that of the clusters before")
        self.tracks = [t for t in self.tracks if time - t.times[-1] <= c.lost_seconds]
        owner = self._pair(time, clusters.centres)
        seen = []
        for k, centre in enumerate(clusters.centres):
            track = owner.get(k)
            if track is None:
                track = Track(self._next)
                self._next += 1
                self.tracks.append(track)
            track.times.append(time)
            track.places.append(centre)
            track.sizes.append(clusters.sizes[k])
            track.counts.append(int(clusters.counts[k]))
            track.velocity = slope(track.times, track.places, c.velocity_seconds)
            if self._is_moving(track):
                self.moved[track.id] = track
            seen.append(track)
        return seen

    def _pair(self, time: float, centres: Array) -> dict[int, Track]:
        """Cluster number -> the track that it continues."""
        from scipy.optimize import linear_sum_assignment

        if not self.tracks or not len(centres):
            return {}
        expected = np.array([track.predicted(time) for track in self.tracks])
        distance = np.linalg.norm(centres[:, None] - expected[None], axis=-1)
        # a pair beyond the gate costs as much as any other such pair, and more than all good ones
        cost = np.where(distance <= self.config.gate, distance, 1e3 * self.config.gate)
        rows, columns = linear_sum_assignment(cost)
        good = distance[rows, columns] <= self.config.gate
        pairs = zip(rows[good].tolist(), columns[good].tolist(), strict=True)
        return {k: self.tracks[i] for k, i in pairs}

    def _is_moving(self, track: Track) -> bool:
        c = self.config
        first = bisect.bisect_left(track.times, track.times[-1] - c.move_seconds)
        recent = np.array(track.places[first:])
        displacement = float(np.linalg.norm(recent[-1] - recent[0]))
        if len(recent) < c.confirm or displacement < c.least_move:
            return False
        way = float(np.linalg.norm(np.diff(recent, axis=0), axis=1).sum())
        return way <= c.wander * displacement


def slope(times: list[float], places: list[Array], seconds: float) -> Array:
    """Velocity (2,) by a least-squares line through the places of the last ``seconds``; 0 for one place.

    Examples
    --------
    >>> slope([0.0, 1.0, 2.0], [np.array([0.0, 5.0]), np.array([2.0, 5.0]), np.array([4.0, 5.0])], 9.0)
    array([2., 0.])
    """
    t = np.array(times)
    recent = t >= t[-1] - seconds
    t, x = t[recent], np.array(places)[recent]
    t = t - t.mean()
    square = float(t @ t)
    velocity: Array = t @ (x - x.mean(axis=0)) / square if square > 0 else np.zeros(2)
    return velocity

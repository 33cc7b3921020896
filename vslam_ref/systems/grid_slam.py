"""The whole loop: pose, static map, dynamic map and landmarks together, from a known start.

::

    odometry ---> predict (EKF) ---> match the scan with S ---> corners: associate, update (EKF)
                                                                        |
    D, clusters <--- S, D <--- update the maps from the new pose <------'---> choose, withdraw landmarks

The scan is matched with the map *before* it is drawn into it.  The pose's error at that moment goes into
the map and stays there; the covariance of the filter knows nothing of it.  What that costs is measured in
chapter 20.  Poses are in metres and radians.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.filters.block_covariance import diagonal_blocks
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.filters.vehicle import Increment
from vslam_ref.geometry import se2, so2
from vslam_ref.grids.landmarks.association import NONE, Signature, associate, look_alike
from vslam_ref.grids.landmarks.field import DistanceField, distance_field, sample
from vslam_ref.grids.landmarks.landmark_map import Landmark, LandmarkConfig, LandmarkMap
from vslam_ref.grids.landmarks.lines import CornerConfig, ScanCorners, scan_corners
from vslam_ref.grids.landmarks.map_corners import MapCornerConfig
from vslam_ref.grids.landmarks.matching import Match, MatchConfig, match_scan, thin
from vslam_ref.grids.landmarks.pose_update import pose_measurement, pose_update
from vslam_ref.grids.log_odds import DECIDED_LOG_ODDS, LogOddsGrid
from vslam_ref.grids.map_config import MapConfig
from vslam_ref.grids.plain import PlainMap
from vslam_ref.grids.scan import ScanLike, sort_beams, unit_vectors
from vslam_ref.grids.static_dynamic import StaticDynamicMap
from vslam_ref.support.config import assume


@dataclass(frozen=True)
class GridSlamConfig:
    """The loop's parts; every field says why it has its value."""

    separate: bool = assume(True, "", "S and D; False: one plain occupancy grid")
    match: bool = assume(True, "", "scan against map, the second way of A4.4's localisation")
    leave_out_moving: bool = assume(
        False, "", "a matcher with a cut ignores them anyway; True: beams that D takes for moving"
    )
    landmarks: bool = assume(True, "", "A4.4's landmarks")
    map: MapConfig = field(default_factory=MapConfig)
    matching: MatchConfig = field(default_factory=MatchConfig)
    corners: CornerConfig = field(default_factory=CornerConfig)
    corners_of_s: MapCornerConfig = field(default_factory=MapCornerConfig)
    choice: LandmarkConfig = field(default_factory=LandmarkConfig)
    field_reach: float = assume(0.5, "m", "more than where the search's loss ends")


class ScanStep(NamedTuple):
    """What one scan did.

    Attributes
    ----------
    T_world_robot, cov : ndarray, shapes (3,), (3, 3)
        Estimate after the scan.
    match : Match or None
        None without matching, and for the first scan.
    corners : ScanCorners
        Of the scan, laser frame.
    landmark : ndarray of int, shape (m,)
        Number of the landmark that each corner updated; -1 none, -2 ambiguous.
    chosen : ndarray of int, shape (k,)
        Numbers of new landmarks.
    withdrawn : list of Landmark
    """

    T_world_robot: Array
    cov: Array
    match: Match | None
    corners: ScanCorners
    landmark: IntArray
    chosen: IntArray
    withdrawn: list[Landmark]


class GridSlam:
    """SLAM with grids and landmarks, from a known start.

    Implements A§4.4: landmarks from S, and a robot that localises by them.

    Parameters
    ----------
    start : array_like, shape (3,)
        Pose (x, y, theta) at the first scan.
    config : GridSlamConfig, optional
    start_sigma : tuple of two floats
        Standard deviations of the start, metres and radians; not zero, as the covariance is inverted.

    Raises
    ------
    ValueError
        If the start is not three finite numbers, or a sigma is not positive.

    Examples
    --------
    >>> from vslam_ref.grids import Scan
    >>> slam = GridSlam([0.0, 0.0, 0.0])
    >>> beams = np.deg2rad(np.arange(-90.0, 91.0))
    >>> step = slam.step(None, Scan(beams, np.full(181, 3.0), 10.0, 0.0))
    >>> step.T_world_robot
    array([0., 0., 0.])
    """

    def __init__(
        self,
        start: ArrayLike,
        config: GridSlamConfig | None = None,
        start_sigma: tuple[float, float] = (1e-3, 1e-3),
    ) -> None:
        self.config = c = GridSlamConfig() if config is None else config
        x, (place, turn) = np.asarray(start, dtype=np.float64), start_sigma
        if x.shape != (3,) or not np.isfinite(x).all() or not (place > 0 and turn > 0):
            raise ValueError(
                f"start {start!r}, sigmas {start_sigma!r}: need three finite numbers and two sigmas > 0"
            )
        self.filter = EkfSlam(x, np.diag([place, place, turn]) ** 2)
        self.maps: StaticDynamicMap | PlainMap = StaticDynamicMap(c.map) if c.separate else PlainMap(c.map)
        self.landmarks = LandmarkMap(c.choice, c.corners_of_s)
        self.scans = 0

    @property
    def T_world_robot(self) -> Array:
        """Estimated pose (3,)."""
        return np.array(self.filter.blocks.x_p[0])

    def static(self) -> LogOddsGrid:
        """Return the map that the robot localises in: S, or the plain grid."""
        return self.maps.static() if isinstance(self.maps, StaticDynamicMap) else self.maps.occupied()

    def places(self) -> Array:
        """Places (n, 2) of the active landmarks, world, metres."""
        columns = self._columns()
        return np.asarray(self.filter.blocks.x_m[0, columns[:, None] + np.arange(2)])

    def _columns(self) -> IntArray:
        """First map columns of the active landmarks in the filter."""
        ids = np.array([m.id for m in self.landmarks.active], dtype=np.int64)
        return self.filter.blocks.columns(ids)

    def step(self, increment: Increment | None, scan: ScanLike) -> ScanStep:
        """Move by an increment (None for the first scan), then use a scan.

        Raises
        ------
        ValueError
            If the increment is not one of one run, or not finite, or the scan's arrays or numbers do not fit
            together: nothing is changed then.  Also if the map would exceed its limit of cells.
        """
        _check(increment, scan)
        angles, ranges = np.asarray(scan.angles, dtype=np.float64), np.asarray(scan.ranges, dtype=np.float64)
        corners = scan_corners(angles, ranges, self.config.corners)
        if increment is not None:
            self.filter.predict(increment)
        match = self._match(angles, ranges, scan.max_range) if self.config.match and self.scans else None
        landmark = np.full(len(corners), NONE)
        chosen, withdrawn = np.zeros(0, dtype=np.int64), list[Landmark]()
        if self.config.landmarks:
            landmark = self._use(corners)
            chosen = self._choose(corners, landmark)
            withdrawn = self.landmarks.check(
                self.scans, self.T_world_robot, self.places(), scan, self.static()
            )
        self.maps.update(self.T_world_robot, scan)
        self.scans += 1
        cov = self.filter.blocks.P_pp[0].copy()
        return ScanStep(self.T_world_robot, cov, match, corners, landmark, chosen, withdrawn)

    def follow(self, way: Iterable[tuple[Increment | None, ScanLike]]) -> Array:
        """Go through a whole recording; return the poses ``T_world_robot`` (n, 3) after each scan.

        Parameters
        ----------
        way : iterable of (increment, scan)
            As for :meth:`step`.
        """
        return np.array([self.step(increment, scan).T_world_robot for increment, scan in way])

    def _match(self, angles: Array, ranges: Array, max_range: float) -> Match:
        """Match the scan with the map, and give its word to the filter."""
        c, b = self.config, self.filter.blocks
        used = np.isfinite(ranges) & (ranges > 0) & (ranges < max_range)
        ends = ranges[used, None] * unit_vectors(angles[used])
        predicted, cov = b.x_p[0].copy(), b.P_pp[0].copy()
        field = distance_field(self.static(), c.field_reach)
        if c.leave_out_moving and c.separate:
            ends = ends[~on_moving(se2.act(predicted, ends), self.static(), field)]
        points = thin(ends, c.map.resolution)
        found = match_scan(field, points, predicted, cov, c.matching)
        if found.reason == "converged":
            pose_update(b, *pose_measurement(found.T_world_laser, found.information, predicted, cov))
        return found

    def _use(self, corners: ScanCorners) -> IntArray:
        """Associate corners with active landmarks and update the filter; return each corner's landmark."""
        active, b = self.landmarks.active, self.filter.blocks
        landmark = np.full(len(corners), NONE)
        if not active or len(corners) == 0:
            return landmark
        h, S = self._predicted()
        world = Signature(so2.wrap(b.x_p[0, 2] + corners.bisector), corners.opening, corners.convex)
        alike = look_alike(world, self.landmarks.signature())
        S = S + corners.cov[:, None]  # eq-gate-cov
        which = associate(corners.xy[:, None] - h, S, alike).landmark
        rows = np.flatnonzero(which >= 0)
        ids = np.array([active[k].id for k in which[rows]], dtype=np.int64)
        if len(rows):
            self.filter.update(ids, corners.xy[rows][None], corners.cov[rows])
        for k in which[rows]:
            active[k].seen += 1
        landmark[rows] = ids
        landmark[which < NONE] = which[which < NONE]
        return landmark

    def _predicted(self) -> tuple[Array, Array]:
        """Active landmarks as seen from the pose (n, 2), metres, and H P H^T of each (n, 2, 2), m^2."""
        ids = [m.id for m in self.landmarks.active]
        seen = self.filter.innovation(ids, np.zeros((1, len(ids), 2)), np.zeros((2, 2)))
        assert seen is not None, "every active landmark is in the filter"
        return -seen.innovation.reshape(-1, 2), diagonal_blocks(seen.S)[0]

    def _choose(self, corners: ScanCorners, landmark: IntArray) -> IntArray:
        """Let unclaimed corners become landmarks, and put these into the filter."""
        chosen = self.landmarks.choose(
            self.scans, self.T_world_robot, corners, landmark == NONE, self.places(), self.static()
        )
        if len(chosen.id):
            self.filter.update(chosen.id, corners.xy[chosen.corner][None], corners.cov[chosen.corner])
        return chosen.id


def on_moving(points: Array, static: LogOddsGrid, field: DistanceField) -> NDArray[np.bool_]:
    """Whether beams that end at ``points`` (n, 2) end on something that moves: D would be high there.

    D is high where S was free.  Within one and a half cells of what is static a wall is as likely, since the
    pose is only predicted yet.
    """
    on_floor = static.at(points) < -DECIDED_LOG_ODDS
    return np.asarray(on_floor & (sample(points, field) > 1.5 * field.resolution))


def _check(increment: Increment | None, scan: ScanLike) -> None:
    """Refuse what cannot be used, before anything is changed."""
    sort_beams(scan, np.inf, False)
    if increment is None:
        return
    shapes = [np.shape(part) for part in increment]
    if shapes != [(1,), (1,), (1, 2, 2)] or not all(np.isfinite(part).all() for part in increment):
        raise ValueError(
            f"increment of shapes {shapes}: need finite (1,), (1,) and (1, 2, 2), a batch of one run"
        )

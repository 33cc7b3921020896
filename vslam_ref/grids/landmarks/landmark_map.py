"""The third map: landmarks, how they are chosen, and how a bad choice is found out.

::

    corner seen --> candidate --(seen again 'confirm' times)--> static? apart? --> landmark
                                                                                      |
        withdrawn <--(beams go through it, and again, or S holds it no longer)--------'

A landmark is chosen only where S is static: both arms decided, and a corner of S near.  Beside a landmark
that looks the same no second one is set: the two would be mistaken for each other.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.geometry import se2, so2
from vslam_ref.grids.landmarks.association import TURN, Signature, look_alike
from vslam_ref.grids.landmarks.lines import ScanCorners
from vslam_ref.grids.landmarks.map_corners import MapCornerConfig, map_corners, static_along_arms
from vslam_ref.grids.log_odds import LogOddsGrid
from vslam_ref.grids.scan import ScanLike, unit_vectors
from vslam_ref.support.config import assume

Why = Literal["", "seen through", "no longer static in S"]


@dataclass(frozen=True)
class LandmarkConfig:
    """How landmarks are chosen and withdrawn; every field says why it has its value."""

    static_only: bool = assume(True, "", "A4.4: landmarks must be taken from S")
    withdraw: bool = assume(True, "", "what was static when chosen may be moved later")
    confirm: int = assume(5, "", "a second of scans; noise makes no corner five times")
    same: float = assume(0.12, "m", "a candidate seen again; four sigma of a corner")
    forget: int = assume(10, "scans", "two seconds unseen: the candidate was none")
    apart: float = assume(0.6, "m", "look-alikes nearer than a gate's width")
    corner_of_s: float = assume(0.3, "m", "three cells from a corner of S")
    arms: float = assume(0.8, "", "share of both arms decided static by S")
    arms_left: float = assume(0.3, "", "below it S has taken the walls away")
    beyond: float = assume(0.25, "m", "a beam that ends this far behind went through")
    through: int = assume(3, "scans", "three scans running: noise does not")

    def __post_init__(self) -> None:
        """Check the numbers."""
        if min(self.confirm, self.forget, self.through) < 1:
            raise ValueError("confirm, forget and through: need at least 1")
        if not (self.same > 0 and self.apart >= 0 and self.corner_of_s > 0 and self.beyond > 0):
            raise ValueError("need same, corner_of_s, beyond > 0 and apart >= 0")
        if not 0 <= self.arms_left <= self.arms <= 1:
            raise ValueError(
                f"arms_left={self.arms_left}, arms={self.arms}: need 0 <= arms_left <= arms <= 1"
            )


@dataclass(eq=False)
class Landmark:
    """What is kept of a landmark beside its place, which the filter holds.

    Attributes
    ----------
    id : int
        Its number in the filter; never used again after it was withdrawn.
    bisector, opening : float
        In the world, radians.
    convex : bool
    arms : ndarray, shape (2,)
        Directions of the arms in the world, radians.
    born : int
        Scan at which it was chosen.
    seen, through : int
        Updates so far; scans running in which beams went through it.
    withdrawn : int or None
        Scan at which it was withdrawn.
    why : str
    """

    id: int
    bisector: float
    opening: float
    convex: bool
    arms: Array
    born: int
    seen: int = 0
    through: int = 0
    withdrawn: int | None = None
    why: Why = ""


@dataclass(eq=False)
class _Candidate:
    """A corner that may become a landmark: how it looked first, where it was last, and how often."""

    first: Landmark
    xy: Array
    count: int
    last: int


class Chosen(NamedTuple):
    """New landmarks: index of the corner (k,) that shows each, and their numbers (k,)."""

    corner: IntArray
    id: IntArray


@dataclass
class LandmarkMap:
    """All landmarks, and the corners that may become some.

    Implements the third map of A§4.4, the landmarks taken from S.
    """

    config: LandmarkConfig = field(default_factory=LandmarkConfig)
    of_s: MapCornerConfig = field(default_factory=MapCornerConfig)
    landmarks: list[Landmark] = field(default_factory=list)
    _candidates: list[_Candidate] = field(default_factory=list)

    @property
    def active(self) -> list[Landmark]:
        """Landmarks in use, in the order of their numbers."""
        return [m for m in self.landmarks if m.withdrawn is None]

    def signature(self) -> Signature:
        """Signatures of the active landmarks, in the world."""
        return signature_of(self.active)

    def choose(
        self,
        scan: int,
        T_world_laser: ArrayLike,
        corners: ScanCorners,
        unclaimed: BoolArray,
        places: Array,
        static: LogOddsGrid,
    ) -> Chosen:
        """Remember unclaimed corners, and make landmarks of those that were seen often enough.

        Parameters
        ----------
        scan : int
            Number of this scan.
        T_world_laser : array_like, shape (3,)
            ``T_world_laser``.
        corners : ScanCorners
            Of this scan, in the laser's frame.
        unclaimed : ndarray of bool, shape (m,)
            Corners that no landmark's gate holds.
        places : ndarray, shape (n, 2)
            Where the active landmarks are, world, metres.
        static : LogOddsGrid
            S (or whatever map stands in for it).
        """
        c, pose = self.config, np.asarray(T_world_laser, dtype=np.float64)
        self._candidates = [k for k in self._candidates if scan - k.last <= c.forget]
        bisector, arms = so2.wrap(pose[2] + corners.bisector), so2.wrap(pose[2] + corners.arms)
        xy_world = se2.act(pose, corners.xy)
        ripe: list[tuple[int, _Candidate]] = []
        for i in np.flatnonzero(unclaimed).tolist():
            opening, convex = float(corners.opening[i]), bool(corners.convex[i])
            look = Landmark(-1, float(bisector[i]), opening, convex, arms[i], scan)
            candidate = self._seen_again(xy_world[i], look, scan)
            if candidate.count >= c.confirm:
                ripe.append((i, candidate))
        rows = np.array([i for i, _ in ripe], dtype=np.int64)
        good = self._static(static, xy_world[rows], arms[rows])
        new: list[tuple[int, int]] = []
        known = list(zip(places, self.active, strict=True))
        for (i, candidate), is_static in zip(ripe, good.tolist(), strict=True):
            if not is_static or self._too_near(candidate, known):
                continue
            mark = replace(candidate.first, id=len(self.landmarks), arms=arms[i], born=scan)
            self.landmarks.append(mark)
            known.append((candidate.xy, mark))
            self._candidates.remove(candidate)
            new.append((i, mark.id))
        pairs = np.array(new, dtype=np.int64).reshape(-1, 2)
        return Chosen(pairs[:, 0], pairs[:, 1])

    def _seen_again(self, xy: Array, look: Landmark, scan: int) -> _Candidate:
        """Return the candidate that this corner is, or a new one."""
        for k in self._candidates:
            near = np.hypot(*(k.xy - xy)) <= self.config.same
            alike = abs(so2.wrap(k.first.bisector - look.bisector)) < TURN and k.first.convex == look.convex
            if near and alike and k.last < scan:
                k.xy, k.count, k.last = xy, k.count + 1, scan
                return k
        self._candidates.append(_Candidate(look, xy, 1, scan))
        return self._candidates[-1]

    def _static(self, static: LogOddsGrid, xy: Array, arms: Array) -> BoolArray:
        """Whether S holds these corners: static along both arms, and a corner of S near."""
        if not self.config.static_only or len(xy) == 0:
            return np.ones(len(xy), dtype=bool)
        along = static_along_arms(static, xy, arms) >= self.config.arms
        if not along.any():
            return along
        corners = map_corners(static, self.of_s).xy
        if len(corners) == 0:
            return np.zeros(len(xy), dtype=bool)
        off = xy[:, None] - corners
        near: BoolArray = np.hypot(off[..., 0], off[..., 1]).min(axis=1) <= self.config.corner_of_s
        return along & near

    def _too_near(self, candidate: _Candidate, known: list[tuple[Array, Landmark]]) -> bool:
        """Whether a landmark that looks alike lies nearer than ``apart``."""
        near = [m for p, m in known if np.hypot(*(p - candidate.xy)) < self.config.apart]
        return bool(look_alike(signature_of([candidate.first]), signature_of(near)).any())

    def check(
        self, scan: int, T_world_laser: ArrayLike, places: Array, seen: ScanLike, static: LogOddsGrid
    ) -> list[Landmark]:
        """Withdraw landmarks that beams went through three times running, or once where S lost them.

        S alone decides nothing: after a turn the landmarks move with the pose's correction, the map does not.

        Parameters
        ----------
        scan, T_world_laser, places, static
            As for :meth:`choose`.
        seen : ScanLike
            The scan; readings that are not finite count as nothing seen.

        Returns
        -------
        list of Landmark
            Those withdrawn now.
        """
        active = self.active
        if not self.config.withdraw or not active:
            return []
        arms = np.stack([m.arms for m in active])
        through = seen_through(T_world_laser, places, arms, seen, self.config.beyond)
        held = static_along_arms(static, places, arms) >= self.config.arms_left
        gone = []
        for m, went, holds in zip(active, through, held, strict=True):
            m.through = m.through + 1 if bool(went) else 0
            if m.through >= self.config.through:
                m.withdrawn, m.why = scan, "seen through"
            elif self.config.static_only and bool(went) and not bool(holds):
                m.withdrawn, m.why = scan, "no longer static in S"
            if m.withdrawn is not None:
                gone.append(m)
        return gone


def signature_of(landmarks: list[Landmark]) -> Signature:
    """Signatures of landmarks, in the world."""
    return Signature(
        np.array([m.bisector for m in landmarks]),
        np.array([m.opening for m in landmarks]),
        np.array([m.convex for m in landmarks], dtype=bool),
    )


def seen_through(
    T_world_laser: ArrayLike,
    places: ArrayLike,
    arms: ArrayLike,
    scan: ScanLike,
    beyond: float,
    along: float = 0.15,
) -> BoolArray:
    """Whether beams went through both arms of corners.

    A beam past the edge of a cupboard touches nothing, so the corner itself proves nothing: looked at is a
    place on each arm.  All readings within one beam of its direction must end at least ``beyond`` metres
    behind it.  A reading in front of it (somebody stands there) says nothing.

    Parameters
    ----------
    T_world_laser : array_like, shape (3,)
        Pose (x, y, theta), metres and radians.
    places, arms : array_like, shapes (n, 2), (n, 2)
        Corners in the world, metres, and the directions of their arms, radians.
    scan : ScanLike
    beyond, along : float
        Metres behind a place, and from the corner to it.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    pose, angles = np.asarray(T_world_laser, dtype=np.float64), np.asarray(scan.angles, dtype=np.float64)
    ranges = np.asarray(scan.ranges, dtype=np.float64)
    corners = np.asarray(places, dtype=np.float64).reshape(-1, 1, 2)
    spots = corners + along * unit_vectors(np.reshape(arms, (-1, 2)))
    seen = se2.act(se2.inverse(pose), spots)
    distance, bearing = np.hypot(seen[..., 0], seen[..., 1]), np.arctan2(seen[..., 1], seen[..., 0])
    width = 1.5 * (angles[1] - angles[0]) if len(angles) > 1 else 0.0
    usable = np.isfinite(ranges) & (ranges > 0)
    beside = usable & (np.abs(so2.wrap(angles - bearing[..., None])) <= width)  # (n, 2, beams)
    nearest = np.where(beside, ranges, np.inf).min(axis=-1, initial=np.inf)
    through = (beside.sum(axis=-1) >= 2) & (nearest > distance + beyond)
    return np.asarray(through.all(axis=-1))

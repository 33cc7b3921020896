r"""A map whose points are described by ORB: every feature of every keyframe, and the point that it shows.

====================  ==============================================================================
``keyframes``         ``T_kf_world`` (K, 4, 4), ``frame`` (K,); ``alive`` (K,); ``parent`` (K,) in the
                      spanning tree, -1 for the first; ``start``, ``end`` (K,), rows of its features;
                      ``T_kf_parent`` (K, 4, 4), where it stood when it was culled
``points``            ``X_world`` (N, 3), ``alive`` (N,); ``descriptor`` (N, 32), that of the sighting
                      most like all others; ``normal`` (N, 3), mean direction from which it was seen;
                      ``distance_range`` (N, 2) in which the pyramid shows it; ``reference_kf`` (N,);
                      ``born`` (N,), the keyframe that was newest then; ``tried``, ``found`` (N,);
                      ``replaced_by`` (N,), the point it was fused into, or -1
``sightings``         a row for every feature: ``kf``, ``level`` (the octave), ``uv`` (M, 2), ``angle``,
                      ``descriptor`` (M, 32), ``grey``; ``point`` that it shows, with ``on``, or -1
====================  ==============================================================================

Two keyframes are neighbours in the *covisibility graph* if they share points; the number of these is the
edge's weight.  :mod:`.spanning_tree` keeps the tree.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray, as_array
from vslam_ref.systems.visual_map import KeyframeMap, shared_points
from vslam_ref.systems.visual_map.keyframe_map import Bytes
from vslam_ref.systems.visual_map.rows import Rows

if TYPE_CHECKING:
    from vslam_ref.features.orb import OrbFeatures

NONE = -1
"""No point, no parent."""


class DescribedPicture(NamedTuple):
    """A picture as this system looks at it.

    Attributes
    ----------
    number : int
        Of the picture in its sequence.
    features : OrbFeatures
    grey : ndarray of uint8, shape (n,)
        Grey level at each feature.
    """

    number: int
    features: OrbFeatures
    grey: Bytes


def _keyframes() -> Rows:
    return Rows(
        T_kf_world=((4, 4), np.float64),
        frame=((), np.int64),
        alive=((), np.bool_),
        parent=((), np.int64),
        start=((), np.int64),
        end=((), np.int64),
        T_kf_parent=((4, 4), np.float64),
    )


def _points() -> Rows:
    return Rows(
        X_world=((3,), np.float64),
        alive=((), np.bool_),
        descriptor=((32,), np.uint8),
        normal=((3,), np.float64),
        distance_range=((2,), np.float64),
        reference_kf=((), np.int64),
        born=((), np.int64),
        tried=((), np.int64),
        found=((), np.int64),
        replaced_by=((), np.int64),
    )


def _sightings() -> Rows:
    return Rows(
        kf=((), np.int64),
        point=((), np.int64),
        level=((), np.int64),
        uv=((2,), np.float64),
        angle=((), np.float64),
        descriptor=((32,), np.uint8),
        grey=((), np.uint8),
        on=((), np.bool_),
    )


@dataclass
class FeatureMap(KeyframeMap):
    """Keyframes, features and points of one camera.

    Parameters
    ----------
    camera : Camera
    shape : tuple of int
        Height and width of the pictures.
    levels : int
        Octaves of their pyramids.
    scale : float
        Width of an octave's pixel over that of the next finer one.

    Attributes
    ----------
    loop_edges : list of tuple of int
        Pairs of keyframes that a closed loop has joined.
    culled : int
        How many keyframes were culled.
    """

    levels: int = 8
    scale: float = 1.2
    keyframes: Rows = field(default_factory=_keyframes, kw_only=True)
    points: Rows = field(default_factory=_points, kw_only=True)
    sightings: Rows = field(default_factory=_sightings, kw_only=True)
    loop_edges: list[tuple[int, int]] = field(default_factory=list, kw_only=True)
    culled: int = field(default=0, kw_only=True)

    def level_sigma(self, level: ArrayLike) -> Array:
        """Width of an octave's pixel, in pixels of level 0: the standard deviation of what is found there."""
        return np.asarray(self.scale ** np.asarray(level, np.float64))

    # --- what is in it -----------------------------------------------------------------------

    def used_keyframes(self) -> IntArray:
        """Numbers of the keyframes that were not culled."""
        return np.flatnonzero(self.keyframes["alive"])

    def features(self, kf: int) -> slice:
        """Rows of the sightings that are the features of a keyframe: feature i is row start + i."""
        return slice(int(self.keyframes["start"][kf]), int(self.keyframes["end"][kf]))

    def rows_in(self, kf: int) -> IntArray:
        """Rows of the sightings (n,) of a keyframe that show a point."""
        rows = self.features(kf)
        return np.asarray(rows.start + np.flatnonzero(self.sightings["on"][rows]))

    def point_of(self, kf: int) -> IntArray:
        """Point that each feature (n,) of a keyframe shows, or -1."""
        rows = self.features(kf)
        return np.where(self.sightings["on"][rows], self.sightings["point"][rows], NONE)

    def current(self, points: ArrayLike) -> IntArray:
        """Points (n,), or those into which they were fused; -1 for the dead, and for -1."""
        number = np.asarray(points, dtype=np.int64).copy()
        if len(self.points) == 0:
            return np.full_like(number, NONE)
        while True:
            fused = (number >= 0) & (self.points["replaced_by"][number] >= 0)
            if not fused.any():
                return np.where((number >= 0) & self.alive[number], number, NONE)
            number[fused] = self.points["replaced_by"][number[fused]]

    def greys(self, points: IntArray) -> Bytes:
        """Grey levels of points (n,), in one of the keyframes that see them."""
        seen = self.sightings
        rows = np.flatnonzero(seen["on"])[::-1]  # the first sighting is written last
        grey = np.zeros(len(self.points), np.uint8)
        grey[seen["point"][rows]] = seen["grey"][rows]
        return np.asarray(grey[points])

    # --- what comes in -----------------------------------------------------------------------

    def add_keyframe(self, T_kf_world: ArrayLike, picture: DescribedPicture) -> int:
        """Add a picture with its pose (4, 4); none of its features shows a point yet.

        Return the keyframe's number.  Lengths have the map's own unit.
        """
        pose, f = as_array("T_kf_world", T_kf_world, 4, 4), picture.features
        kf, start, count = len(self.keyframes), len(self.sightings), len(f.uv)
        self.sightings.append(
            count,
            kf=kf,
            point=NONE,
            level=f.octave,
            uv=f.uv,
            angle=f.angle,
            descriptor=f.descriptor,
            grey=picture.grey,
        )
        self.keyframes.append(
            1, T_kf_world=pose, frame=picture.number, alive=True, parent=NONE, start=start, end=start + count
        )
        self.version += 1
        return kf

    def add_points(self, X_world: ArrayLike, kf: int) -> IntArray:
        """Add points (n, 3) with a keyframe as their reference; return their numbers (n,).

        They have no sighting yet: give them two with :meth:`see`, then call :meth:`refresh`.
        """
        X = as_array("X_world", X_world, 3)
        self.version += 1
        return self.points.append(
            len(X), X_world=X, alive=True, reference_kf=kf, born=len(self.keyframes) - 1, replaced_by=NONE
        )

    def see(self, kf: int, feature: ArrayLike, point: ArrayLike) -> None:
        """Let features (n,) of a keyframe show points (n,).

        A feature shows one point, and a keyframe sees a point once: whoever comes later replaces the former.
        """
        feature, point = np.asarray(feature, np.int64), np.asarray(point, np.int64)
        rows, seen = self.features(kf), self.sightings
        on, shown = seen["on"][rows], seen["point"][rows]
        again = on & np.isin(shown, point)
        on[again] = False
        shown[feature], on[feature] = point, True
        self.version += 1

    # --- what is fused and taken out ---------------------------------------------------------

    def replace(self, old: ArrayLike, new: ArrayLike) -> None:
        """Fuse points ``old (n,)`` into ``new (n,)``: their sightings become the new ones'.

        In a keyframe that saw both, the new one keeps its own sighting.  Chains are followed to their end.
        """
        old, new = np.asarray(old, np.int64), np.asarray(new, np.int64)
        table, seen = self.points, self.sightings
        for a, b in zip(old.tolist(), self.current(new).tolist(), strict=True):
            a, b = int(self.current([a])[0]), int(self.current([b])[0])
            if a == b or min(a, b) < 0:
                continue
            table["replaced_by"][a], table["alive"][a] = b, False
            table["tried"][b] += table["tried"][a]
            table["found"][b] += table["found"][a]
        rows = np.flatnonzero(seen["on"])
        before = seen["point"][rows]
        rows, before = rows[~self.alive[before]], before[~self.alive[before]]
        after = self.current(before)
        seen["on"][rows] = False
        own = np.flatnonzero(seen["on"])
        count = len(self.points)
        taken = seen["kf"][own] * count + seen["point"][own]
        keys, first = np.unique(seen["kf"][rows] * count + after, return_index=True)
        keep = rows[first[~np.isin(keys, taken) & (after[first] >= 0)]]
        seen["point"][keep] = self.current(seen["point"][keep])
        seen["on"][keep] = True
        self.version += 1

    def remove_points(self, points: ArrayLike) -> None:
        """Let points (n,) die, with all their sightings."""
        self.remove(np.asarray(points, np.int64))

    def new_references(self) -> None:
        """Give points whose reference was culled, or sees them no longer, the first keyframe that does."""
        seen, table = self.sightings, self.points
        rows = np.flatnonzero(seen["on"])
        first = np.full(len(table), NONE)
        first[seen["point"][rows[::-1]]] = seen["kf"][rows[::-1]]
        has = np.zeros(len(table), np.bool_)
        own = rows[seen["kf"][rows] == table["reference_kf"][seen["point"][rows]]]
        has[seen["point"][own]] = True
        lacking = table["alive"] & ~has & (first >= 0)
        table["reference_kf"][lacking] = first[lacking]

    # --- graphs ------------------------------------------------------------------------------

    def covisible(self, kf: int) -> IntArray:
        """How many points each keyframe (K,) shares with one; 0 for itself."""
        shared = shared_points(self, kf)
        shared[kf] = 0
        return shared

    def covisibility(self) -> IntArray:
        """How many points any two keyframes share, (K, K); the diagonal holds how many each sees."""
        from scipy.sparse import csr_array

        seen = self.sightings
        rows = np.flatnonzero(seen["on"])
        size = len(self.keyframes), max(len(self.points), 1)
        sees = csr_array((np.ones(len(rows), np.int64), (seen["kf"][rows], seen["point"][rows])), shape=size)
        return np.asarray((sees @ sees.T).toarray())

    # --- how points look ---------------------------------------------------------------------

    def refresh(self, points: ArrayLike) -> None:
        """Describe points (n,) anew by their sightings: descriptor, normal and range of distances.

        Lengths have the map's own unit.
        """
        from vslam_ref.systems.orbslam.describe import describe

        describe(self, np.asarray(points, np.int64))

    def times_seen(self) -> IntArray:
        """How many keyframes see each point, (N,)."""
        seen = self.sightings
        return np.bincount(seen["point"][seen["on"]], minlength=len(self.points))

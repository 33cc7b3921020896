r"""Do two keyframes show one place?  Matches, a similarity, more matches by it, the whole place found again.

::

    features of both that show points       nearest, clearly, mutual, turned alike
      too few: no loop
    similarity S_l_c                        estimation.similarity: samples, both reprojections
      too few agree: no loop
    guided search                           each one's points looked for in the other, both ways
      refined on all of them
      too few agree: no loop
    points of the whole place               of l and its neighbours, looked for in c
      too few found: no loop
    turn that drift would have made         between where c stands and where the loop puts it
      too large: a place painted like this one

Points stay in the unit of their side.  The camera c, seen from the side of l, stands at the rigid part of
:math:`S_{cl} T_{l,world} = [sR, t]`, which is (R, t / s): it projects the points of that side alike.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.similarity import PointMatches, agreeing, estimate_similarity, refine_similarity
from vslam_ref.features import hamming
from vslam_ref.features.orb import OrbFeatures
from vslam_ref.features.vocabulary import turned_alike
from vslam_ref.geometry import se3, sim3, so3
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.orbslam.loop_settings import LoopSettings
from vslam_ref.systems.orbslam.mapper.fuse import features_of
from vslam_ref.systems.orbslam.projection import expected, find


class FeaturePairs(NamedTuple):
    """Features that show one point: ``current (n,)`` of the current keyframe, ``other (n,)`` of the other."""

    current: IntArray
    other: IntArray


class LoopVerdict(NamedTuple):
    """Whether two keyframes show one place.

    Attributes
    ----------
    current, candidate : int
        Keyframes.
    reason : str
        Empty for a loop; else why it is none.
    matches, inliers, points : int
        Features matched; pairs that agree on the similarity; points of the place found again.
    S_candidate_current : ndarray, shape (4, 4)
        Between their frames, translation in the unit of the candidate; the identity where there is none.
    feature, point : ndarray of int, shape (points,)
        Features of the current keyframe, and the points of the candidate's side that they show.
    """

    current: int
    candidate: int
    reason: str
    matches: int = 0
    inliers: int = 0
    points: int = 0
    S_candidate_current: Array = np.eye(4)
    feature: IntArray = np.zeros(0, dtype=np.int64)
    point: IntArray = np.zeros(0, dtype=np.int64)


def verify(
    feature_map: FeatureMap, current: int, candidate: int, rng: np.random.Generator, s: LoopSettings
) -> LoopVerdict:
    """Judge whether a candidate shows the place of the current keyframe.

    Parameters
    ----------
    feature_map : FeatureMap
    current, candidate : int
    rng : numpy.random.Generator
    s : LoopSettings

    Returns
    -------
    LoopVerdict
    """
    pairs = matched(feature_map, current, candidate, s)
    count = len(pairs.current)
    told = LoopVerdict(current, candidate, "", count)
    if count < s.least_matches:
        return told._replace(reason="few matches")
    both = point_matches(feature_map, current, candidate, pairs)
    first = estimate_similarity(both, rng, draws=s.draws)
    if first.reason:
        return told._replace(reason="no similarity")
    if first.inliers.sum() < s.least_inliers:
        return told._replace(reason="few inliers", inliers=int(first.inliers.sum()))
    pairs = FeaturePairs(*(side[first.inliers] for side in pairs))
    more = guided(feature_map, current, candidate, first.S_b_a, pairs, s)
    pairs = FeaturePairs(*(np.concatenate(sides) for sides in zip(pairs, more, strict=True)))
    both = point_matches(feature_map, current, candidate, pairs)
    S = refine_similarity(both, first.S_b_a).x
    good = agreeing(S, both)
    told = told._replace(inliers=int(good.sum()))
    if good.sum() < s.least_inliers:
        return told._replace(reason="few inliers")
    S = refine_similarity(both.only(good), S).x
    feature, point = whole_place(
        feature_map, current, candidate, S, FeaturePairs(*(side[good] for side in pairs)), s
    )
    told = told._replace(points=len(point), S_candidate_current=S, feature=feature, point=point)
    if len(point) < s.least_points:
        return told._replace(reason="few points")
    if turn_degrees(feature_map, current, camera_at(S, feature_map, candidate)) > s.turn:
        return told._replace(reason="implausible turn")
    return told


def turn_degrees(feature_map: FeatureMap, kf: int, T_cam_world: Array) -> float:
    """By how many degrees a pose (4, 4), the map's own unit, is turned against that of a keyframe."""
    turn = so3.log(T_cam_world[:3, :3] @ feature_map.T_kf_world[kf, :3, :3].T)
    return float(np.rad2deg(np.linalg.norm(turn)))


def matched(feature_map: FeatureMap, current: int, other: int, s: LoopSettings) -> FeaturePairs:
    """Features of two keyframes that show points and are described alike."""
    rows = [feature_map.rows_in(kf) for kf in (current, other)]
    seen = feature_map.sightings
    first, second = (seen["descriptor"][r] for r in rows)
    found = hamming.match(first, second, s.ratio, limit=s.bits)
    a, b = rows[0][found.first], rows[1][found.second]
    alike = turned_alike(seen["angle"][a], seen["angle"][b]) & (seen["point"][a] != seen["point"][b])
    starts = feature_map.keyframes["start"]
    return FeaturePairs(a[alike] - starts[current], b[alike] - starts[other])


def point_matches(feature_map: FeatureMap, current: int, other: int, pairs: FeaturePairs) -> PointMatches:
    """Points that pairs of features show, in the frames of their keyframes, each in its own unit."""
    X, uv, sigma = [], [], []
    for kf, feature in zip((current, other), pairs, strict=True):
        rows = feature_map.features(kf).start + feature
        seen = feature_map.sightings
        X.append(se3.act(feature_map.T_kf_world[kf], feature_map.X_world[seen["point"][rows]]))
        uv.append(seen["uv"][rows])
        sigma.append(feature_map.level_sigma(seen["level"][rows]))
    return PointMatches(feature_map.camera, X[0], X[1], uv[0], uv[1], sigma[0], sigma[1])


def guided(
    feature_map: FeatureMap,
    current: int,
    other: int,
    S_other_current: Array,
    pairs: FeaturePairs,
    s: LoopSettings,
) -> FeaturePairs:
    """More pairs: points of each keyframe where the similarity puts them in the other, found both ways.

    ``S_other_current (4, 4)``, translation in the unit of the other.
    """
    shown = [feature_map.point_of(kf) for kf in (current, other)]
    free = [np.setdiff1d(np.flatnonzero(p >= 0), taken) for p, taken in zip(shown, pairs, strict=True)]
    poses = (
        camera_at(S_other_current, feature_map, other),
        camera_at(sim3.inverse(S_other_current), feature_map, current),
    )
    wide, bits = s.guided_radius, s.guided_bits
    there = _found(feature_map, current, shown[1][free[1]], poses[0], free[0], wide, bits)
    back = _found(feature_map, other, shown[0][free[0]], poses[1], free[1], wide, bits)
    answer = dict(zip(*(values.tolist() for values in back), strict=True))
    of_point = {int(p): int(f) for f, p in zip(free[1], shown[1][free[1]], strict=True)}
    agreed = [
        (f, of_point[p])
        for p, f in zip(*(values.tolist() for values in there), strict=True)
        if answer.get(int(shown[0][f])) == of_point[p]
    ]
    found = np.array(sorted(agreed), dtype=np.int64).reshape(-1, 2)
    return FeaturePairs(found[:, 0], found[:, 1])


def _found(
    feature_map: FeatureMap,
    kf: int,
    points: IntArray,
    T_cam_world: Array,
    free: IntArray,
    radius: float,
    limit: int,
) -> tuple[IntArray, IntArray]:
    """Points found from a pose in a keyframe, and the features, of those that are free, that show them."""
    at = expected(feature_map, points, T_cam_world)
    features = OrbFeatures._make(values[free] for values in features_of(feature_map, kf))
    feature = find(feature_map, at, features, radius=radius, limit=limit)
    good = feature >= 0
    return at.point[good], free[feature[good]]


def camera_at(S_seen_by: Array, feature_map: FeatureMap, kf: int) -> Array:
    """Pose (4, 4) of a camera on the side of keyframe ``kf``, in its unit, from S_kf_cam ``(4, 4)``.

    Implements A§3.1's similarity as a camera: the rigid part (R, t / s) of S_cam_kf T_kf_world.
    """
    S = sim3.compose(sim3.inverse(S_seen_by), feature_map.T_kf_world[kf])
    return se3.from_rt(sim3.rotation(S), sim3.translation(S) / sim3.scale(S))


def whole_place(
    feature_map: FeatureMap, current: int, candidate: int, S: Array, pairs: FeaturePairs, s: LoopSettings
) -> tuple[IntArray, IntArray]:
    """Features of the current keyframe, and the points that they show of the candidate and its neighbours.

    ``S (4, 4)`` is S_candidate_current, translation in the candidate's unit.
    """
    known = feature_map.point_of(candidate)[pairs.other]
    points = np.setdiff1d(points_around(feature_map, candidate), known)
    points = np.setdiff1d(points, feature_map.measured_in(current))
    free = np.setdiff1d(np.arange(len(feature_map.point_of(current))), pairs.current)
    camera = camera_at(S, feature_map, candidate)
    more, feature = _found(feature_map, current, points, camera, free, s.wide_radius, s.bits)
    return np.concatenate([pairs.current, feature]), np.concatenate([known, more])


def points_around(feature_map: FeatureMap, kf: int) -> IntArray:
    """Points that a keyframe and those that share points with it see, (n,)."""
    around = np.append(np.flatnonzero(feature_map.covisible(kf)), kf)
    return np.unique(np.concatenate([feature_map.measured_in(int(one)) for one in around]))

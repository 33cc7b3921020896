r"""Points of the map where a pose puts them, and the features that show them.

A point can be found where its image lies in the picture, from a distance at which one of the octaves shows
it as its descriptor does, and from a direction less than 60 degrees from its normal.  At the distance d
it is expected on the octave

.. math:: l = \operatorname{round}\bigl( \log_s (d_{\max} / d) \bigr),

where :math:`d_{\max}` is the distance at which octave 0 shows it, and looked for on this one and its two
neighbours.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.features.orb import OrbFeatures
from vslam_ref.geometry import camera_pose, se3
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.orbslam.window_search import Places, assigned, search_windows

LEAST_COSINE = 0.5
"""Between the direction of sight and the normal."""
NEARER, FARTHER = 0.8, 1.2
"""Of the range of distances: octaves are steps, and the range's ends are not sharp."""


class ExpectedPoints(NamedTuple):
    """Points that a pose should show.

    Attributes
    ----------
    point : ndarray of int64, shape (n,)
    uv : ndarray, shape (n, 2)
        Pixels of level 0.
    level : ndarray of int64, shape (n,)
        Octave on which they are expected.
    depth : ndarray, shape (n,)
        In the map's own unit.
    """

    point: IntArray
    uv: Array
    level: IntArray
    depth: Array


def expected(feature_map: FeatureMap, points: IntArray, T_cam_world: Array) -> ExpectedPoints:
    """Points (n,) that a camera at a pose (4, 4) should see, the map's own unit.

    Implements :eq:`eq-expected-octave`.
    """
    table = feature_map.points
    X_cam = se3.act(T_cam_world, table["X_world"][points])
    ray = table["X_world"][points] - camera_pose.centre_from_pose(T_cam_world)
    distance = np.linalg.norm(ray, axis=1)
    least, most = table["distance_range"][points].T
    facing = np.einsum("ni,ni->n", ray, table["normal"][points]) >= LEAST_COSINE * distance
    may = (X_cam[:, 2] > 0) & (distance >= NEARER * least) & (distance <= FARTHER * most) & facing
    rows = np.flatnonzero(may)
    at = feature_map.camera.project(X_cam[rows])
    height, width = feature_map.shape
    inside = at.valid & (at.uv >= 0).all(1) & (at.uv <= (width - 1, height - 1)).all(1)
    rows, uv = rows[inside], at.uv[inside]
    level = np.rint(np.log(most[rows] / distance[rows]) / np.log(feature_map.scale)).astype(np.int64)
    return ExpectedPoints(points[rows], uv, np.clip(level, 0, feature_map.levels - 1), X_cam[rows, 2])


def find(
    feature_map: FeatureMap,
    at: ExpectedPoints,
    features: OrbFeatures,
    *,
    radius: float,
    limit: int,
    ratio: float = 1.0,
) -> IntArray:
    """Feature (n,) that shows each expected point, or -1; each feature shows one point at most.

    Parameters
    ----------
    feature_map : FeatureMap
    at : ExpectedPoints
        n points.
    features : OrbFeatures
    radius : float
        Half side of the window, pixels of the octave.
    limit : int
        Largest distance, bits.
    ratio : float
        Of the best to the second distance.
    """
    width = radius * feature_map.level_sigma(at.level)
    descriptor = feature_map.points["descriptor"][at.point]
    answers = search_windows(Places(at.uv, width, at.level - 1, at.level + 1, descriptor), features)
    return assigned(answers, limit=limit, ratio=ratio, room=len(features.uv))

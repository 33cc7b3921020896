r"""How a point looks, by all its sightings: the descriptor most like the others, from where, from how far.

With the centres :math:`c_k` of the keyframes that see the point X, its *normal* is the mean direction

.. math:: n = \operatorname{mean}_k\, (X - c_k) / \lVert X - c_k \rVert ,

and with the octave l on which its reference keyframe, d away, sees it, a pyramid of L octaves with step s
shows it at distances from :math:`d\, s^{\,l - (L-1)}` to :math:`d\, s^{\,l}`.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import IntArray
from vslam_ref.features.hamming import differing
from vslam_ref.geometry import camera_pose
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.visual_map.keyframe_map import Bytes


def describe(feature_map: FeatureMap, points: IntArray) -> None:
    """Write descriptor, normal and distance range of living points (n,) into the map, its own unit.

    Implements :eq:`eq-point-normal`, :eq:`eq-point-range` and :eq:`eq-point-descriptor`.
    """
    feature_map.new_references()
    seen, table = feature_map.sightings, feature_map.points
    wanted = np.zeros(len(table), np.bool_)
    wanted[points] = True
    rows = np.flatnonzero(seen["on"])
    rows = rows[wanted[seen["point"][rows]]]
    if len(rows) == 0:
        return
    rows = rows[np.argsort(seen["point"][rows], kind="stable")]
    number, first, count = np.unique(seen["point"][rows], return_index=True, return_counts=True)
    table["descriptor"][number] = seen["descriptor"][
        rows[first + _most_alike(seen["descriptor"][rows], first, count)]
    ]
    centres = camera_pose.centre_from_pose(feature_map.T_kf_world)
    ray = table["X_world"][seen["point"][rows]] - centres[seen["kf"][rows]]
    length = np.linalg.norm(ray, axis=1)
    mean = np.add.reduceat(ray / length[:, None], first) / count[:, None]
    table["normal"][number] = mean / np.maximum(np.linalg.norm(mean, axis=1), 1e-12)[:, None]
    own = np.flatnonzero(seen["kf"][rows] == table["reference_kf"][seen["point"][rows]])
    farthest = length[own] * feature_map.level_sigma(seen["level"][rows[own]])
    nearest = farthest / feature_map.level_sigma(feature_map.levels - 1)
    table["distance_range"][seen["point"][rows[own]]] = np.stack([nearest, farthest], 1)


def _most_alike(descriptor: Bytes, first: IntArray, count: IntArray) -> IntArray:
    """For each group of rows, which of them has the least median Hamming distance to the group, (n,)."""
    best = np.zeros(len(first), np.int64)
    for size in np.unique(count):
        groups = np.flatnonzero(count == size)
        d = descriptor[first[groups, None] + np.arange(size)]  # (g, size, 32)
        apart = differing(d[:, :, None], d[:, None])
        best[groups] = np.argmin(np.median(apart, axis=2), axis=1)
    return best

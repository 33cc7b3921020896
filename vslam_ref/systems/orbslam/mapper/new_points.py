r"""New points: features of the newest keyframe that show none yet, matched along curves in its neighbours.

A feature's ray, seen by a neighbour, appears as a curve.  Of the neighbour's features that show no point
either, those so near to the curve that noise explains it are compared, and the one described most alike
answers, if the feature is its own best answer, too.  The point counts if its rays have parallax, both
images agree, and both distances fit the octaves on which it was found.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.triangulation import triangulate
from vslam_ref.features.hamming import differing
from vslam_ref.geometry import camera_pose, se3, so3
from vslam_ref.geometry.multiview import Views
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.orbslam.mapper.adjusting import median_depth
from vslam_ref.systems.orbslam.settings import FeatureSettings, MapperSettings
from vslam_ref.systems.visual_map import neighbours
from vslam_ref.systems.visual_map.keyframe_map import Bytes

OCTAVES_APART = 1.8
"""Ratio of the distances, over that of the octaves, from which on they contradict: 1.5 octave steps."""


class Side(NamedTuple):
    """Features of a keyframe that show no point.

    ``row (n,)`` among its features; ``uv (n, 2)`` pixels; their rays ``bearing (n, 3)`` and
    ``J_pixel (n, 3, 2)``, d bearing / d pixel; ``width (n,)`` of a pixel of their octave;
    ``descriptor (n, 32)``.
    """

    row: IntArray
    uv: Array
    bearing: Array
    J_pixel: Array
    width: Array
    descriptor: Bytes


def new_points(feature_map: FeatureMap, kf: int, s: MapperSettings, f: FeatureSettings) -> IntArray:
    """Add points that the newest keyframe and a neighbour see; return their numbers (n,).

    Lengths have the map's own unit.
    """
    added = [np.zeros(0, np.int64)]
    centres = camera_pose.centre_from_pose(feature_map.T_kf_world)
    least = s.base * median_depth(feature_map, kf)
    for other in neighbours(feature_map, kf, s.neighbours).tolist():
        if np.linalg.norm(centres[other] - centres[kf]) < least:
            continue
        a, b = free_side(feature_map, kf), free_side(feature_map, other)
        if min(len(a.row), len(b.row)) == 0:
            continue
        T_b_a = se3.compose(feature_map.T_kf_world[other], se3.inverse(feature_map.T_kf_world[kf]))
        i, j = match(a, b, T_b_a, s.epipolar, f.near)
        added.append(_triangulated(feature_map, (kf, other), (a, b), (i, j), s))
    return np.concatenate(added)


def free_side(feature_map: FeatureMap, kf: int) -> Side:
    """Features of a keyframe that show no point, with their rays."""
    row = np.flatnonzero(feature_map.point_of(kf) < 0)
    rows = feature_map.features(kf).start + row
    seen = feature_map.sightings
    ray = feature_map.camera.unproject_with_jacobians(seen["uv"][rows])
    ok = ray.valid
    width = feature_map.level_sigma(seen["level"][rows])
    return Side(
        row[ok],
        seen["uv"][rows][ok],
        ray.bearing[ok],
        ray.J_pixel[ok],
        width[ok],
        seen["descriptor"][rows][ok],
    )


def match(a: Side, b: Side, T_b_a: Array, distance: float, limit: int) -> tuple[IntArray, IntArray]:
    """Pairs (m,) of features that lie on each other's curves and are each other's best answer.

    Implements :eq:`eq-curve-distance`, the distance in pixels of the octave, the ``limit`` in bits.
    """
    R, t = se3.rotation(T_b_a), se3.translation(T_b_a)
    E = so3.hat(t) @ R
    there = _search(a.bearing @ E.T, a.descriptor, b.bearing, b.J_pixel, b.width, b.descriptor, distance)
    i = np.flatnonzero((there[0] >= 0) & (there[1] <= limit))
    j = there[0][i]
    lines, asked = b.bearing[j] @ E, b.descriptor[j]
    back = _search(lines, asked, a.bearing, a.J_pixel, a.width, a.descriptor, distance)
    keep = back[0] == i
    return i[keep], j[keep]


@accelerated("windows:search_lines")
def _search(
    line: Array,
    descriptor: Bytes,
    bearing: Array,
    J_pixel: Array,
    width: Array,
    other: Bytes,
    distance: float,
) -> tuple[IntArray, IntArray]:
    """Best feature (n,) for each line (n, 3), -1 without one, and its distance in bits; first of equals."""
    best, least = np.full(len(line), -1), np.full(len(line), 257)
    e = line @ bearing.T
    gx, gy = line @ J_pixel[:, :, 0].T, line @ J_pixel[:, :, 1].T
    row, column = np.nonzero(e * e <= (distance * width) ** 2 * (gx * gx + gy * gy))  # eq-curve-distance
    bits = differing(descriptor[row], other[column])
    order = np.lexsort((column, bits, row))
    rows, first = np.unique(row[order], return_index=True)
    best[rows], least[rows] = column[order[first]], bits[order[first]]
    return best, least


def _triangulated(
    feature_map: FeatureMap,
    kfs: tuple[int, int],
    sides: tuple[Side, Side],
    pair: tuple[IntArray, IntArray],
    s: MapperSettings,
) -> IntArray:
    """Add the points of matches that have depth; return their numbers."""
    (a, b), (i, j) = sides, pair
    if len(i) == 0:
        return np.zeros(0, np.int64)
    T = feature_map.T_kf_world[list(kfs)]
    sigma = np.stack([a.width[i], b.width[j]], 1)
    found = triangulate(
        Views(feature_map.camera, T),
        np.stack([a.uv[i], b.uv[j]], 1),
        sigma_px=sigma,
        min_parallax=float(np.radians(s.parallax)),
        max_iterations=10,
    )
    away = np.linalg.norm(found.X_world[:, None] - camera_pose.centre_from_pose(T), axis=2)
    contradiction = np.abs(np.log(away[:, 0] / away[:, 1] * sigma[:, 0] / sigma[:, 1]))
    good = found.ok & (found.rmse_px <= s.worst * sigma.max(1)) & (contradiction <= np.log(OCTAVES_APART))
    numbers = feature_map.add_points(found.X_world[good], kfs[0])
    feature_map.see(kfs[0], a.row[i[good]], numbers)
    feature_map.see(kfs[1], b.row[j[good]], numbers)
    return numbers

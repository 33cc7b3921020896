r"""Corners of another picture on the curve along which a point may appear, compared with its patch.

The ray of a corner, seen by another camera, is a line; with a lens it appears as a curve.  For a corner with
the bearing b there, :math:`e = b^T E a` vanishes on the curve, and

.. math:: d = |e| \,/\, \lVert \partial e / \partial u \rVert

is its distance in pixels, to first order: no curve is drawn.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.features import finest_from_level, level_sigma, zmssd
from vslam_ref.features.fast import Pixels
from vslam_ref.features.patch_search import AREA
from vslam_ref.features.templates import cut
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.cameras import Camera, Pinhole
from vslam_ref.systems.visual_map.visual_map import Bytes

PORTION = 4096
"""Pairs of patches that are compared together."""


class CornerRays(NamedTuple):
    """Whole pixels of a level (n, 2), their bearings (n, 3) and d bearing / d pixel of level 0 (n, 3, 2)."""

    xy: Pixels
    bearing: Array
    J_pixel: Array
    valid: BoolArray

    def only(self, rows: IntArray) -> CornerRays:
        """Return some of them."""
        return CornerRays(self.xy[rows], self.bearing[rows], self.J_pixel[rows], self.valid[rows])


class OnCurve(NamedTuple):
    """Best ``corner (n,)`` of each point, -1 if none; ``cost (n,)`` over the patch's variation, no unit."""

    corner: IntArray
    cost: Array


def with_bearings(camera: Camera, xy: Pixels, level: int) -> CornerRays:
    """Give corners of a level their rays."""
    xy = np.ascontiguousarray(xy, np.int32)
    uv = finest_from_level(xy, level)
    if isinstance(camera, Pinhole):
        return CornerRays(xy, *_pinhole_rays(camera.params, uv))
    ray = camera.unproject_with_jacobians(uv)
    return CornerRays(xy, ray.bearing, ray.J_pixel, ray.valid)


@accelerated("curves:pinhole_rays")
def _pinhole_rays(K: Array, uv: Array) -> tuple[Array, Array, BoolArray]:
    """Bearings (n, 3), their slopes (n, 3, 2), and which are rays at all (n,), with a pinhole K (4,)."""
    ray = Pinhole.from_params(K).unproject_with_jacobians(uv)
    return ray.bearing, ray.J_pixel, ray.valid


def essential(T_b_a: Array) -> Array:
    """E (3, 3) with b^T E a = 0 for bearings of one point."""
    return so3.hat(se3.translation(T_b_a)) @ se3.rotation(T_b_a)


class Gates(NamedTuple):
    """What a match must pass: level, least depth, pixels from the curve, share of the variation."""

    level: int
    near: float
    distance: float
    limit: float


def search_curve(
    patch: Bytes, a: CornerRays, image: Bytes, b: CornerRays, T_b_a: Array, gates: Gates
) -> OnCurve:
    """Find for each patch the corner near its curve that looks most like it.

    Implements :eq:`eq-curve-distance`.

    Parameters
    ----------
    patch : ndarray of uint8, shape (n, 8, 8)
        Around the corners ``a``.
    a : CornerRays
        n corners of the first picture.
    image : ndarray of uint8, shape (H, W)
        The level of the second picture.
    b : CornerRays
        m corners of it.
    T_b_a : ndarray, shape (4, 4)
        Pose of the second camera.
    gates : Gates

    Returns
    -------
    OnCurve
    """
    flat = np.ascontiguousarray(patch).reshape(-1, AREA)
    return OnCurve(*_search(flat, a, np.ascontiguousarray(image), b, T_b_a, gates))


@accelerated("curves:search_curve")
def _search(
    patch: Bytes, a: CornerRays, image: Bytes, b: CornerRays, T_b_a: Array, gates: Gates
) -> tuple[IntArray, Array]:
    """Numbers (n,) of the best corners, and their costs, for patches (n, 64)."""
    best = OnCurve(np.full(len(a.xy), -1), np.full(len(a.xy), np.inf))
    if len(a.xy) == 0 or len(b.xy) == 0:
        return best
    distance = gates.distance * float(level_sigma(gates.level))
    row, column = _near_curve(a, b, T_b_a, distance, gates.near)
    there = cut(image, b.xy)
    use = there.inside[column]
    row, column = row[use], column[use]
    cost = _share_of_variation(patch, there.patch, row, column)
    order = np.lexsort((column, cost, row))
    rows, first = np.unique(row[order], return_index=True)
    winner = order[first]
    best.cost[rows] = cost[winner]
    best.corner[rows] = np.where(cost[winner] <= gates.limit, column[winner], -1)
    return best


def _share_of_variation(a: Bytes, b: Bytes, row: IntArray, column: IntArray) -> Array:
    """ZMSSD of pairs (p,) of patches over the variation of the first, some thousands at a time."""
    flat_a, flat_b = a, b.reshape(-1, AREA)
    cost = np.empty(len(row))
    for low in range(0, len(row), PORTION):
        part = slice(low, low + PORTION)
        cost[part] = zmssd(flat_a[row[part]], flat_b[column[part]])
    share: Array = cost / np.maximum(zmssd(a, 0.0), 1.0)[row]
    return share


def _near_curve(
    a: CornerRays, b: CornerRays, T_b_a: Array, distance: float, near: float
) -> tuple[IntArray, IntArray]:
    """Pairs (p,) of a point and a corner near its curve, in front of both cameras and not too close."""
    lines = a.bearing @ essential(T_b_a).T  # (n, 3): E a
    e = lines @ b.bearing.T
    gx, gy = lines @ b.J_pixel[:, :, 0].T, lines @ b.J_pixel[:, :, 1].T
    close = (e * e <= distance**2 * (gx * gx + gy * gy)) & a.valid[:, None] & b.valid  # eq-curve-distance
    row, column = np.nonzero(close)
    depth = ray_depths(a.bearing[row], b.bearing[column], T_b_a)
    good = (depth[:, 0] >= near) & (depth[:, 1] > 0)
    return row[good], column[good]


def ray_depths(a: Array, b: Array, T_b_a: Array) -> Array:
    """Distances (n, 2) along rays ``a (n, 3)``, ``b (n, 3)`` of where they come closest.

    In the unit of the translation of ``T_b_a (4, 4)``; without meaning if the rays are parallel.

    Implements :eq:`eq-ray-depths`.
    """
    ra = a @ se3.rotation(T_b_a).T
    t = se3.translation(T_b_a)
    c = np.einsum("ni,ni->n", ra, b)
    p, q = ra @ t, b @ t
    under = np.maximum(1.0 - c * c, 1e-12)
    return np.stack([(c * q - p) / under, (q - c * p) / under], 1)  # eq-ray-depths

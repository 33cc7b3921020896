r"""Which points of the map a camera should see, where, how large, and how turned.

Around a point the surface is taken for a plane across the axis of the keyframe in which it was first seen.
One pixel there moves the point by :math:`Z_s\, \mathrm{d}x_n/\mathrm{d}u_s` in that plane, so

.. math:: A = \frac{\partial u}{\partial X_{cam}}\; R_{cam\,s}
   \begin{bmatrix} 1 & 0 \\ 0 & 1 \\ 0 & 0 \end{bmatrix} Z_s \frac{\partial x_n}{\partial u_s} .
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, BoolArray, IntArray, as_array
from vslam_ref.features import Templates, level_from_finest, level_sigma, sampling, search_level, warp
from vslam_ref.features.templates import AFTER, BEFORE, SIDE
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, Pinhole
from vslam_ref.systems.visual_map.visual_map import Bytes, Rowlike, VisualMap

MARGIN = 5.0
"""Pixels of the level on which a point is looked for, that it must keep from the border."""


class Sources(NamedTuple):
    """Where points were first seen.

    Keyframe ``kf (n,)``, ``level (n,)``, pixel ``uv (n, 2)``, d xn / d pixel ``slope (n, 2, 2)``, and
    ``depth (n,)``.
    """

    kf: IntArray
    level: IntArray
    uv: Array
    slope: Array
    depth: Array


def sources(visual_map: VisualMap, points: IntArray) -> Sources:
    """Where points (n,) were first seen."""
    return _sources(_known(visual_map), points)


class _Known(NamedTuple):
    """Columns of a map: ``T_kf_world`` (K, 4, 4), and of all its points (N) what :class:`VisualMap` says."""

    T_kf_world: Array
    X_world: Array
    source_kf: IntArray
    source_level: IntArray
    source_uv: Array
    slope: Array


def _known(visual_map: VisualMap) -> _Known:
    table = visual_map.points
    names = ("X_world", "source_kf", "source_level", "source_uv", "slope")
    return _Known(visual_map.T_kf_world, *(table[name] for name in names))


def _sources(known: _Known, points: IntArray) -> Sources:
    kf = known.source_kf[points]
    row = known.T_kf_world[kf, 2]
    depth = np.einsum("ni,ni->n", row[:, :3], known.X_world[points]) + row[:, 3]
    return Sources(kf, known.source_level[points], known.source_uv[points], known.slope[points], depth)


class Visible(NamedTuple):
    """Points that a camera should see.

    Attributes
    ----------
    point : ndarray of int64, shape (n,)
        Their numbers.
    uv : ndarray, shape (n, 2)
        Pixels of level 0.
    depth : ndarray, shape (n,)
    A : ndarray, shape (n, 2, 2)
        d pixel / d pixel of the source, both of level 0.
    level : ndarray of int64, shape (n,)
        On which to look.
    """

    point: IntArray
    uv: Array
    depth: Array
    A: Array
    level: IntArray

    def only(self, rows: Rowlike) -> Visible:
        """Return those of a mask, or of row numbers."""
        return Visible(self.point[rows], self.uv[rows], self.depth[rows], self.A[rows], self.level[rows])


def visible(visual_map: VisualMap, T_cam_world: ArrayLike, points: ArrayLike | None = None) -> Visible:
    """Points that a camera at a pose should see.

    Implements :eq:`eq-patch-affine` and :eq:`eq-search-level` for all points at once.

    Parameters
    ----------
    visual_map : VisualMap
    T_cam_world : array_like, shape (4, 4)
    points : array_like of int, shape (m,), optional
        Ask these only; all that are alive by default.

    Returns
    -------
    Visible
        In the order of their numbers, or as asked.
    """
    T = as_array("T_cam_world", T_cam_world, 4, 4)
    number = np.flatnonzero(visual_map.alive) if points is None else np.asarray(points, dtype=np.int64)
    known, (height, width) = _known(visual_map), visual_map.shape
    if isinstance(visual_map.camera, Pinhole):
        K = visual_map.camera.params
        return Visible(*_pinhole_visible(known, T, number, K, height, width, visual_map.levels))
    return _visible(known, T, number, visual_map.camera, height, width, visual_map.levels)


@accelerated("visibility:pinhole_visible")
def _pinhole_visible(
    known: _Known, T_cam_world: Array, number: IntArray, K: Array, height: int, width: int, levels: int
) -> tuple[IntArray, Array, Array, Array, IntArray]:
    """Fields of :class:`Visible` with a pinhole K (4,) at ``T_cam_world (4, 4)``, any unit of length."""
    return _visible(known, T_cam_world, number, Pinhole.from_params(K), height, width, levels)


def _visible(
    known: _Known, T: Array, number: IntArray, camera: Camera, height: int, width: int, levels: int
) -> Visible:
    X_cam = se3.act(T, known.X_world[number])
    number, X_cam = _roughly_inside(camera, height, width, number, X_cam)
    at = camera.project_with_jacobians(X_cam)
    inside = (at.uv >= 0).all(1) & (at.uv <= (width - 1, height - 1)).all(1) & at.valid
    number, X_cam, uv, J = number[inside], X_cam[inside], at.uv[inside], at.J_point[inside]
    origin = _sources(known, number)
    A = _affine(known.T_kf_world, origin, T, J)
    level = search_level(A * level_sigma(origin.level)[:, None, None], levels)
    at_level = level_from_finest(uv, np.maximum(level, 0))
    edge = np.array([width, height]) / level_sigma(np.maximum(level, 0))[:, None] - 1 - MARGIN
    good = (level >= 0) & (at_level >= MARGIN).all(1) & (at_level <= edge).all(1)
    return Visible(number, uv, X_cam[:, 2], A, level).only(good)


def _roughly_inside(
    camera: Camera, height: int, width: int, number: IntArray, X_cam: Array
) -> tuple[IntArray, Array]:
    """Leave out what is behind the camera or far outside its field, before the lens is asked."""
    border = camera.unproject(np.array([[0, 0], [width, 0], [0, height], [width, height]], np.float64))
    if not border.valid.all():
        return number, X_cam
    reach = 1.5 * np.abs(border.xn).max()
    keep = (X_cam[:, 2] > 0) & (np.abs(X_cam[:, :2]) <= reach * X_cam[:, 2:]).all(1)
    return number[keep], X_cam[keep]


def affine(visual_map: VisualMap, origin: Sources, T_cam_world: Array, J_point: Array) -> Array:
    """A (n, 2, 2), d pixel / d pixel of the source, from d pixel / d X_cam (n, 2, 3).

    Implements :eq:`eq-patch-affine`.
    """
    return _affine(visual_map.T_kf_world, origin, T_cam_world, J_point)


def _affine(T_kf_world: Array, origin: Sources, T_cam_world: Array, J_point: Array) -> Array:
    R_cam_kf = se3.rotation(T_cam_world) @ np.swapaxes(se3.rotation(T_kf_world), -1, -2)
    in_plane = origin.slope * origin.depth[:, None, None]
    A: Array = (J_point @ R_cam_kf[origin.kf][:, :, :2]) @ in_plane  # eq-patch-affine
    return A


def templates(visual_map: VisualMap, origin: Sources, A: Array, level: IntArray) -> Templates:
    """Patches (n, 8, 8) as the levels (n,) on which they are looked for should show them.

    Implements :eq:`eq-sampling` and :eq:`eq-warp` with the keyframes of a map.
    """
    patch = np.zeros((len(origin.kf), SIDE * SIDE), np.uint8)
    inside = np.zeros(len(origin.kf), np.bool_)
    for each in range(visual_map.levels):
        images = visual_map.image(each)  # one under another
        height, width = images.shape[1:]
        seen = origin.kf, origin.level, origin.uv
        _read_templates(images.reshape(-1), width, height, each, *seen, A, level, patch, inside)
    return Templates(patch.reshape(-1, SIDE, SIDE), inside)


@accelerated("visibility:read_templates")
def _read_templates(
    flat: Bytes,
    width: int,
    height: int,
    each: int,
    kf: IntArray,
    source_level: IntArray,
    source_uv: Array,
    A: Array,
    level: IntArray,
    patch: Bytes,
    inside: BoolArray,
) -> None:
    """Fill in patches (n, 64) of points that were first seen on one level, and whether they were whole (n,).

    The level's images of all keyframes (K * height * width,) lie one under another.
    """
    rows = np.flatnonzero(source_level == each)
    if len(rows) == 0:
        return
    at, M = level_from_finest(source_uv[rows], each), sampling(A[rows], level[rows], each)
    above = np.stack([np.zeros(len(rows)), kf[rows] * float(height)], 1)
    found = warp(flat.reshape(-1, width), at + above, M)
    whole = found.inside & _whole(at, M, height)
    patch[rows[whole]], inside[rows] = found.patch[whole].reshape(-1, SIDE * SIDE), whole


def _whole(uv: Array, M: Array, height: int) -> BoolArray:
    """Whether no row of a patch lies in another keyframe's image."""
    corners = np.array([[x, y] for x in (-BEFORE, AFTER) for y in (-BEFORE, AFTER)], np.float64)
    y = uv[:, 1:] + np.einsum("nj,kj->nk", M[:, 1], corners)
    return np.asarray(((y >= 0) & (y <= height - 1)).all(1))

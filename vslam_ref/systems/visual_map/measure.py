"""Where a picture shows patches: refined from where they are expected, else from the corner most alike."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.features import (
    Corners,
    Templates,
    finest_from_level,
    level_from_finest,
    level_sigma,
    refine,
    search,
    warp,
    zmssd,
)
from vslam_ref.features.fast import Pixels
from vslam_ref.features.patch_search import AREA, LIMIT, variation
from vslam_ref.features.templates import SIDE
from vslam_ref.systems.visual_map.visibility import Sources, Visible, sources, templates
from vslam_ref.systems.visual_map.visual_map import Bytes, PreparedPicture, VisualMap

LEAST_RADIUS = 1.5
"""Pixels of the level."""


class Looks(NamedTuple):
    """How patches are compared.

    Attributes
    ----------
    limit : float
        Largest ZMSSD, as a share of the template's own variation; or of 1 - ZNCC.
    measure : str
        ``zmssd`` or ``zncc``.
    absolute : float
        If above 0, a limit of the ZMSSD in squared grey levels instead, as PTAM has it.
    first_refine : bool
        Refine from the expected place before corners are asked.
    warp : bool
        Warp the template as the surface should look; else it is compared as it was first seen.
    """

    limit: float = LIMIT
    measure: str = "zmssd"
    absolute: float = 0.0
    first_refine: bool = True
    warp: bool = True


PLAIN = Looks()


class Located(NamedTuple):
    """Places (n, 2), pixels of level 0, and which were found (n,)."""

    uv: Array
    ok: BoolArray


def look(
    visual_map: VisualMap, seen: Visible, picture: PreparedPicture, radius: ArrayLike, looks: Looks = PLAIN
) -> Located:
    """Look for visible points in a picture.

    Parameters
    ----------
    visual_map : VisualMap
    seen : Visible
        n points, where they are expected.
    picture : PreparedPicture
    radius : array_like, shape () or (n,)
        In pixels of level 0.
    looks : Looks

    Returns
    -------
    Located
    """
    origin = sources(visual_map, seen.point)
    patches = templates(
        visual_map, origin, seen.A if looks.warp else _as_seen(origin, seen.level), seen.level
    )
    place, ok = seen.uv.copy(), np.zeros(len(seen.point), np.bool_)
    reach = np.broadcast_to(np.asarray(radius, np.float64), len(place)) / level_sigma(seen.level)
    reach = np.maximum(reach, LEAST_RADIUS)
    for level in range(visual_map.levels):
        rows = np.flatnonzero((seen.level == level) & patches.inside)
        if len(rows) == 0:
            continue
        at = level_from_finest(seen.uv[rows], level)
        found = locate(
            picture.levels[level],
            picture.corners[level],
            Templates(patches.patch[rows], patches.inside[rows]),
            at,
            reach[rows],
            looks,
        )
        place[rows] = finest_from_level(found.uv, level)
        ok[rows] = found.ok
    return Located(place, ok)


def _as_seen(origin: Sources, level: IntArray) -> Array:
    """A (n, 2, 2) by which a pixel of a level (n,) is a pixel of the source's: no turn, no shear."""
    A: Array = np.eye(2) * (level_sigma(level) / level_sigma(origin.level))[:, None, None]
    return A


def locate(
    image: Bytes, corners: Corners, patches: Templates, uv: Array, radius: Array, looks: Looks = PLAIN
) -> Located:
    """Look for patches around ``uv (n, 2)`` within ``radius (n,)``, all in pixels of one level."""
    whole = np.ascontiguousarray(image)
    return Located(
        *_locate(
            whole.reshape(-1),
            whole.shape[1],
            corners.xy,
            corners.row_start,
            np.ascontiguousarray(patches.patch).reshape(-1, AREA),
            uv,
            radius,
            looks.limit,
            looks.absolute,
            looks.measure == "zncc",
            looks.first_refine,
        )
    )


@accelerated("looking:locate")
def _locate(
    flat: Bytes,
    width: int,
    xy: Pixels,
    row_start: IntArray,
    patch: Bytes,
    uv: Array,
    radius: Array,
    limit: float,
    absolute: float,
    correlate: bool,
    first_refine: bool,
) -> tuple[Array, BoolArray]:
    """Places (n, 2) of templates (n, 64) in an image in rows (H * width,), and which were found (n,)."""
    image, corners = flat.reshape(-1, width), Corners(xy, row_start, width)
    square, place, ok = patch.reshape(-1, SIDE, SIDE), uv.copy(), np.zeros(len(uv), np.bool_)
    spread = variation(square)
    most = absolute if absolute else limit * spread
    most = np.broadcast_to(most, len(uv))
    if first_refine:
        direct = refine(image, square, uv)
        ok = direct.ok & (np.hypot(*(direct.uv - uv).T) <= radius)
        ok[ok] = alike(image, patch[ok], direct.uv[ok], most[ok])
        place[ok] = direct.uv[ok]
    left = np.flatnonzero(~ok)
    share = absolute / np.maximum(spread[left], 1.0) if absolute else limit
    measure = "zncc" if correlate else "zmssd"
    by_corner = search(image, corners, square[left], uv[left], radius[left], limit=share, measure=measure)
    have = left[by_corner.corner >= 0]
    end = refine(image, square[have], xy[by_corner.corner[by_corner.corner >= 0]])
    good = end.ok
    good[good] = alike(image, patch[have[good]], end.uv[good], most[have[good]])
    place[have[good]], ok[have[good]] = end.uv[good], True
    return place, ok


def alike(image: Bytes, patch: Bytes, uv: Array, most: Array) -> BoolArray:
    """Whether an image at places (n, 2) differs from patches (n, 64) by so much (n,) at most; no unit."""
    here = warp(image, uv, np.broadcast_to(np.eye(2), (len(uv), 2, 2)))
    return np.asarray(here.inside & (zmssd(patch, here.patch.reshape(-1, AREA)) <= most))

"""Where a picture shows patches: refined from where they are expected, else from the corner most alike."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

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
from vslam_ref.features.patch_search import AREA, LIMIT, variation
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
    patch = patches.patch
    place, ok = uv.copy(), np.zeros(len(uv), np.bool_)
    spread = variation(patch)
    if looks.first_refine:
        direct = refine(image, patch, uv)
        near = np.hypot(*(direct.uv - uv).T) <= radius
        ok = direct.ok & near
        ok[ok] = alike(image, patch[ok], direct.uv[ok], spread[ok], looks)
        place[ok] = direct.uv[ok]
    left = np.flatnonzero(~ok)
    limit = looks.limit if not looks.absolute else looks.absolute / np.maximum(spread[left], 1.0)
    by_corner = search(
        image, corners, patch[left], uv[left], radius[left], limit=limit, measure=looks.measure
    )
    have = np.flatnonzero(by_corner.corner >= 0)
    start = corners.xy[by_corner.corner[have]].astype(np.float64)
    end, rows = refine(image, patch[left[have]], start), left[have]
    good = end.ok.copy()
    good[good] = alike(image, patch[rows[good]], end.uv[good], spread[rows[good]], looks)
    place[rows[good]], ok[rows[good]] = end.uv[good], True
    return Located(place, ok)


def alike(image: Bytes, patch: Bytes, uv: Array, spread: Array, looks: Looks) -> BoolArray:
    """Whether an image at places (n, 2) between its pixels looks like patches (n, 8, 8)."""
    here = warp(image, uv, np.broadcast_to(np.eye(2), (len(uv), 2, 2)))
    flat = patch.reshape(-1, AREA), here.patch.reshape(-1, AREA)
    if looks.absolute:
        return np.asarray(here.inside & (zmssd(*flat) <= looks.absolute))
    return np.asarray(here.inside & (zmssd(*flat) <= looks.limit * spread))

"""A pose from matches of which many may be wrong: three points at a time, and how many agree."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array
from vslam_ref.geometry.cameras import Camera
from vslam_ref.geometry.drawing import different_numbers
from vslam_ref.geometry.multiview.three_points import p3p

DRAWS = 200
LIMIT_PX = 3.0
"""In units of ``sigma_px``: a match farther off counts as wrong."""
LEAST = 8
"""Matches that must agree: three fit by themselves, and chance adds few."""


class AgreedPose(NamedTuple):
    """Best ``T_cam_world (4, 4)`` of many draws, own unit, and ``ok (n,)``: which matches agree with it."""

    T_cam_world: Array
    ok: BoolArray


def pose_by_three_points(
    camera: Camera,
    X_world: ArrayLike,
    uv: ArrayLike,
    rng: np.random.Generator,
    *,
    sigma_px: ArrayLike = 1.0,
    draws: int = DRAWS,
) -> AgreedPose | None:
    """Pose from three matches with which most of all agree; None if fewer than eight do.

    Implements :eq:`eq-recover-cost`, the least of many draws of three.

    Parameters
    ----------
    camera : Camera
    X_world : array_like, shape (n, 3)
        Any unit.
    uv : array_like, shape (n, 2)
        Pixels.
    rng : numpy.random.Generator
    sigma_px : array_like, broadcast to (n,)
        Up to a factor of about one, the standard deviation of a pixel's coordinate: 2^level.
    draws : int

    Returns
    -------
    AgreedPose or None

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> camera, rng = Pinhole(500, 500, 320, 240), np.random.default_rng(0)
    >>> X = rng.uniform(-1, 1, (40, 3)) + [0, 0, 4]
    >>> uv = camera.project(X).uv
    >>> uv[:20] = rng.uniform(0, 480, (20, 2))  # wrong matches
    >>> found = pose_by_three_points(camera, X, uv, rng)
    >>> bool(np.abs(found.T_cam_world - np.eye(4)).max() < 1e-6), int(found.ok[20:].sum())
    (True, 20)
    """
    X, at_pixel = as_array("X_world", X_world, 3), as_array("uv", uv, 2)
    rays = camera.unproject(at_pixel)
    use = np.flatnonzero(rays.valid)
    if len(use) < LEAST:
        return None
    sample = use[different_numbers(rng, draws, len(use), 3)]
    found = p3p(rays.bearing[sample], X[sample])
    T = found.T_cam_world[found.valid]
    if len(T) == 0:
        return None
    at = camera.pixel_from_world(T[:, None], X[None])
    limit = LIMIT_PX * np.broadcast_to(np.asarray(sigma_px, np.float64), len(X))
    error = np.where(at.valid, np.hypot(*np.moveaxis(at.uv - at_pixel, -1, 0)) / limit, np.inf)
    cost = np.minimum(error**2, 1.0).sum(1)
    best = int(np.argmin(cost))
    ok = error[best] < 1.0
    return AgreedPose(T[best], ok) if np.count_nonzero(ok) >= LEAST else None

"""Paths of a camera: smooth through given places, looking at given points, held by a hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.camera_pose import pose_from_centre

Path = Callable[[Array], Array]
"""Poses T_cam_world (..., 4, 4) at times (...), seconds."""
UP = (0.0, 0.0, 1.0)


def looking(position: ArrayLike, target: ArrayLike, up: ArrayLike = UP) -> Array:
    """Poses T_cam_world (..., 4, 4) of cameras at positions (..., 3) that look at targets (..., 3), metres.

    ``up`` (3,) points upwards in the image; it must not lie along the view.

    Examples
    --------
    >>> T_cam_world = looking([0.0, -2.0, 0.0], [0.0, 0.0, 0.0])
    >>> se3.act(T_cam_world, [0.0, 0.0, 0.5]).round(12).tolist()  # above the target: v is less, depth 2
    [0.0, -0.5, 2.0]
    """
    p = np.asarray(position, np.float64)
    ahead = np.asarray(target, np.float64) - p
    ahead = ahead / np.linalg.norm(ahead, axis=-1, keepdims=True)
    right = np.cross(ahead, np.asarray(up, np.float64))
    right = right / np.linalg.norm(right, axis=-1, keepdims=True)
    return pose_from_centre(np.stack([right, np.cross(ahead, right), ahead], -2), p)


def through(times: ArrayLike, places: ArrayLike) -> Callable[[Array], Array]:
    """A curve through places (K, 3), metres, at times (K,), seconds, with continuous acceleration.

    It starts and ends at rest.
    """
    from scipy.interpolate import CubicSpline

    curve = CubicSpline(np.asarray(times, np.float64), np.asarray(places, np.float64), bc_type="clamped")
    return lambda t: np.asarray(curve(t))


def tremor(
    rng: np.random.Generator, sigma: ArrayLike, slowest: float = 0.4, octaves: int = 4
) -> Callable[[Array], Array]:
    """A motion that comes back: sines of several frequencies and random phases.

    Parameters
    ----------
    rng : Generator
    sigma : array_like, shape (n,)
        Standard deviation over time of each coordinate, in its own unit.
    slowest : float
        Lowest frequency, Hz; each octave is about twice as fast and half as strong.
    octaves : int

    Returns
    -------
    callable
        Values (..., n) at times (...), seconds.
    """
    size = np.asarray(sigma, np.float64)
    octave = np.arange(octaves)[:, None]
    hertz = slowest * 2.0**octave * rng.uniform(0.8, 1.25, (octaves, len(size)))
    phase = rng.uniform(0, 2 * np.pi, hertz.shape)
    weight = 0.5**octave * size * np.sqrt(2.0 / (0.25**octave).sum())
    return lambda t: np.sum(weight * np.sin(2 * np.pi * hertz * np.asarray(t)[..., None, None] + phase), -2)


def held(path: Path, shake: Callable[[Array], Array]) -> Path:
    """A path with a tremor (..., 6) of the camera: (rho, phi), metres and radians, in its own frame."""
    return lambda t: se3.exp(shake(t)) @ path(t)


def turning(T_cam_world: Array, swing: Callable[[Array], Array], arm: float) -> Path:
    """A path that only turns, about a point ``arm`` metres behind the lens.

    ``swing`` gives rotation vectors (..., 3), radians, in the camera's frame at ``T_cam_world`` (4, 4), which
    the camera has where they are zero.
    """
    pivot = np.array([0.0, 0.0, -arm])

    def path(t: Array) -> Array:
        R = so3.exp(swing(t))
        return se3.from_rt(R, pivot - R @ pivot) @ T_cam_world

    return path

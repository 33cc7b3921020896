"""A scene: solid things, their textures, a camera and its path; and what the camera sees of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, BoolArray, IntArray, as_array
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera
from vslam_ref.metrics.trajectory import Trajectory
from vslam_ref.worlds.rendered import raster
from vslam_ref.worlds.rendered.motion import Path
from vslam_ref.worlds.rendered.quads import Quads, joined, taken
from vslam_ref.worlds.rendered.textures import Bytes, Textures


class Effects(NamedTuple):
    """What makes a picture worse than the scene.

    Attributes
    ----------
    noise : float
        Standard deviation of independent noise of every pixel, grey levels.
    exposure : float
        Largest change of the exposure over the path, a share: 0.3 is from 0.7 to 1.3 times the grey values.
    shutter : float
        Seconds that the shutter is open; the picture is the mean over this time around the picture's own.
    blur_samples : int
        Poses of which the mean is taken if the shutter is open for a time.
    covered : tuple of (float, float)
        From when to when, seconds, something lies on the lens; the first time counts, the last does not.
    """

    noise: float = 0.0
    exposure: float = 0.0
    shutter: float = 0.0
    blur_samples: int = 5
    covered: tuple[tuple[float, float], ...] = ()


EXACT = Effects()
COVERED = 5.0
"""Grey level of a covered lens."""


class PointTracks(NamedTuple):
    """Where points appear.

    Attributes
    ----------
    uv : ndarray, shape (K, N, 2)
        Pixels; the principal point where the lens shows none.
    visible : ndarray of bool, shape (K, N)
        Whether the point is inside the image and nothing is before it; no unit.
    """

    uv: Array
    visible: BoolArray


class LandmarkTrack(NamedTuple):
    """The landmarks of one picture.

    Attributes
    ----------
    ids : ndarray of int, shape (m,)
        Rows of the scene's landmarks that are projected into the image.
    uv : ndarray, shape (m, 2)
        Pixels.
    visible : ndarray of bool, shape (m,)
        Whether nothing is before it, and the lens not covered; no unit.
    """

    ids: IntArray
    uv: Array
    visible: BoolArray


@dataclass(frozen=True)
class RenderedScene:
    """A world, and pictures of it by a moving camera.  It never moves, but for its ``movers``.

    Attributes
    ----------
    name : str
    quads : Quads
    textures : Textures
    camera : Camera
    size : (int, int)
        Width and height of the pictures, pixels.
    path : callable
        Poses T_cam_world (..., 4, 4), metres, at times (...), seconds.
    times : ndarray, shape (K,)
        Of the pictures, seconds.
    effects : Effects
    seed : int
        Root of the noise of the pictures; with ``name`` and ``size``, of the whole scene.
    landmarks : ndarray, shape (L, 3)
        Points of the world that stand out, metres; most scenes name none.
    movers : callable, optional
        Quads that move, always as many, at a time in seconds.
    vehicle : callable, optional
        Poses (x, y, theta) (..., 3), metres and radians, of what carries the camera at times (...), seconds.
    """

    name: str
    quads: Quads
    textures: Textures
    camera: Camera
    size: tuple[int, int]
    path: Path
    times: Array
    effects: Effects = EXACT
    seed: int = 0
    landmarks: Array = field(default_factory=lambda: np.zeros((0, 3)))
    movers: Callable[[float], Quads] | None = None
    vehicle: Callable[[ArrayLike], Array] | None = None
    T_cam_world: Array = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_cam_world", self.path(self.times))

    def __len__(self) -> int:
        return len(self.times)

    @cached_property
    def rays(self) -> raster.RayTable:
        """The rays of all pixels."""
        return raster.ray_table(self.camera, self.size)

    def things(self, t: float) -> Quads:
        """All quads at time ``t``, seconds: those that stay, then those that move; metres."""
        return self.quads if self.movers is None else joined([self.quads, self.movers(t)])

    def is_covered(self, k: int) -> bool:
        """Whether something lies on the lens in picture k."""
        return any(first <= self.times[k] < last for first, last in self.effects.covered)

    def light(self, k: int) -> Array:
        """What the sensor would count for picture k without noise and limits: (H, W), grey levels."""
        if self.is_covered(k):
            return np.full(self.size[::-1], COVERED)
        times, poses = self.times[k : k + 1], self.T_cam_world[k : k + 1]
        if self.effects.shutter > 0:
            samples = self.effects.blur_samples
            times = times + self.effects.shutter * ((np.arange(samples) + 0.5) / samples - 0.5)
            poses = self.path(times)
        total = sum(
            raster.render(self.things(t), self.textures, self.rays, T)
            for t, T in zip(times.tolist(), poses, strict=True)
        )
        return np.asarray(self.gain(k) * total / len(poses))

    def gain(self, k: int) -> float:
        """Factor of the exposure of picture k, no unit: a slow wave around 1."""
        return 1.0 + self.effects.exposure * float(np.sin(2 * np.pi * self.times[k] / 7.0))

    def frame(self, k: int) -> Bytes:
        """Picture k, grey (H, W); the same bytes for the same scene, in any order.

        Raises
        ------
        IndexError
            If there is no such picture.
        """
        if not 0 <= k < len(self):
            raise IndexError(f"picture {k} of {self.name}: has 0 to {len(self) - 1}")
        light = self.light(k)
        if self.effects.noise > 0:
            rng = np.random.default_rng([self.seed, k])
            light = light + self.effects.noise * rng.standard_normal(light.shape)
        grey: NDArray[np.uint8] = (np.clip(light, 0, 255) + 0.5).astype(np.uint8)  # rounded half up
        return grey

    def depth(self, k: int) -> Array:
        """Depth z of what the centres of pixels see in picture k, metres, (H, W); infinity for nothing."""
        _, inverse = self._seen(k)
        return np.where(inverse > 0, 1.0 / np.where(inverse > 0, inverse, 1.0), np.inf)

    def moving(self, k: int) -> BoolArray:
        """Which pixels' centres see something that moves in picture k, whatever covers the lens; (H, W)."""
        return np.asarray(self._seen(k)[0] >= len(self.quads.corner))

    def _seen(self, k: int) -> tuple[IntArray, Array]:
        """Number of the quad that each pixel's centre sees, -1 for none, and its inverse depth, 1/m."""
        things, T = self.things(float(self.times[k])), self.T_cam_world[k]
        some = raster.in_view(things, T, self.rays.span)
        at = raster.placed(taken(things, some), self.textures, T, self.rays.span)
        quad, inverse = raster.nearest(self.rays.xn, *at)
        return np.append(some, -1)[quad], inverse

    def surface(self, k: int, uv: ArrayLike) -> Array:
        """World points (N, 3), metres, that pixels uv (N, 2) of picture k see; infinity where nothing is."""
        bearing = self.camera.unproject(as_array("uv", uv, 2)).bearing
        ray = bearing / bearing[:, 2:]
        inverse = self._first(k, ray[:, :2])
        there = inverse > 0
        X_cam = ray / np.where(there, inverse, 1.0)[:, None]
        X_world = se3.act(se3.inverse(self.T_cam_world[k]), X_cam)
        return np.where(there[:, None], X_world, np.inf)

    def tracks(self, X_world: ArrayLike) -> PointTracks:
        """Where world points (N, 3), metres, on surfaces of the scene appear in all pictures, and whether.

        A point counts as hidden if something is before it by more than a millionth of its depth.
        """
        points = as_array("X_world", X_world, 3)
        tracks = [self.track(k, points) for k in range(len(self))]
        return PointTracks(np.stack([uv for uv, _ in tracks]), np.stack([visible for _, visible in tracks]))

    def track(self, k: int, X_world: ArrayLike) -> PointTracks:
        """:meth:`tracks` of picture k alone: uv (N, 2), visible (N,)."""
        points, T = as_array("X_world", X_world, 3), self.T_cam_world[k]
        seen = self.camera.pixel_from_world(T, points)
        limit = np.array(self.size) - 0.5
        visible = seen.valid & ((seen.uv >= -0.5) & (seen.uv < limit)).all(-1) & (not self.is_covered(k))
        some = np.flatnonzero(visible)
        X_cam = se3.act(T, points[some])
        first = self._first(k, X_cam[:, :2] / X_cam[:, 2:])
        visible[some] = first * X_cam[:, 2] <= 1.0 + 1e-6
        return PointTracks(seen.uv, visible)

    def landmark_track(self, k: int) -> LandmarkTrack:
        """Landmarks whose projections lie inside picture k, and which of them it shows."""
        uv, visible = self.track(k, self.landmarks)
        ahead = se3.act(self.T_cam_world[k], self.landmarks)[:, 2] > raster.NEAR
        inside = ahead & ((uv >= -0.5) & (uv < np.array(self.size) - 0.5)).all(-1)
        ids = np.flatnonzero(inside)
        return LandmarkTrack(ids, uv[ids], visible[ids])

    def _first(self, k: int, xn: Array) -> Array:
        """Inverse depths (N,) at which rays xn (N, 2) of picture k meet something."""
        things = self.things(float(self.times[k]))
        at = raster.placed(things, self.textures, self.T_cam_world[k], self.rays.span)
        everywhere = np.tile(np.array([0, 1, 0, 1]), (len(at.box), 1))
        pixel = np.zeros(len(xn), np.int64)
        return raster.nearest_of(
            np.ascontiguousarray(xn), pixel, pixel, at.homography, at.extent, everywhere
        )[1]

    def trajectory(self) -> Trajectory:
        """The camera's poses T_world_cam, metres, with the times of the pictures."""
        T = se3.inverse(self.T_cam_world)
        return Trajectory(self.times, T[:, :3, 3], T[:, :3, :3])

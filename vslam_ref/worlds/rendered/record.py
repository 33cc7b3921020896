"""A scene: solid things, their textures, a camera and its path; and what the camera sees of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, BoolArray, as_array
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera
from vslam_ref.metrics.trajectory import Trajectory
from vslam_ref.worlds.rendered import raster
from vslam_ref.worlds.rendered.motion import Path
from vslam_ref.worlds.rendered.quads import Quads
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
    """

    noise: float = 0.0
    exposure: float = 0.0
    shutter: float = 0.0
    blur_samples: int = 5


EXACT = Effects()


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


@dataclass(frozen=True)
class RenderedScene:
    """A world that never moves, and pictures of it by a moving camera.

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
    T_cam_world: Array = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_cam_world", self.path(self.times))

    def __len__(self) -> int:
        return len(self.times)

    @cached_property
    def rays(self) -> raster.RayTable:
        """The rays of all pixels."""
        return raster.ray_table(self.camera, self.size)

    def light(self, k: int) -> Array:
        """What the sensor would count for picture k without noise and limits: (H, W), grey levels."""
        if self.effects.shutter > 0:
            samples = self.effects.blur_samples
            offset = self.effects.shutter * ((np.arange(samples) + 0.5) / samples - 0.5)
            poses = self.path(self.times[k] + offset)
        else:
            poses = self.T_cam_world[k : k + 1]
        total = sum(raster.render(self.quads, self.textures, self.rays, T) for T in poses)
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
        at = raster.placed(self.quads, self.textures, self.T_cam_world[k], self.rays.span)
        inverse = raster.nearest(self.rays.xn, *at)[1]
        return np.where(inverse > 0, 1.0 / np.where(inverse > 0, inverse, 1.0), np.inf)

    def surface(self, k: int, uv: ArrayLike) -> Array:
        """World points (N, 3), metres, that pixels uv (N, 2) of picture k see; infinity where nothing is."""
        bearing = self.camera.unproject(as_array("uv", uv, 2)).bearing
        ray = bearing / bearing[:, 2:]
        inverse = self._first(self.T_cam_world[k], ray[:, :2])
        there = inverse > 0
        X_cam = ray / np.where(there, inverse, 1.0)[:, None]
        X_world = se3.act(se3.inverse(self.T_cam_world[k]), X_cam)
        return np.where(there[:, None], X_world, np.inf)

    def tracks(self, X_world: ArrayLike) -> PointTracks:
        """Where world points (N, 3), metres, on surfaces of the scene appear in all pictures, and whether.

        A point counts as hidden if something is before it by more than a millionth of its depth.
        """
        points = as_array("X_world", X_world, 3)
        seen = self.camera.pixel_from_world(self.T_cam_world[:, None], points)
        limit = np.array(self.size) - 0.5
        visible = seen.valid & ((seen.uv >= -0.5) & (seen.uv < limit)).all(-1)
        for k, T in enumerate(self.T_cam_world):
            some = np.flatnonzero(visible[k])
            X_cam = se3.act(T, points[some])
            first = self._first(T, X_cam[:, :2] / X_cam[:, 2:])
            visible[k, some] = first * X_cam[:, 2] <= 1.0 + 1e-6
        return PointTracks(seen.uv, visible)

    def _first(self, T_cam_world: Array, xn: Array) -> Array:
        """Inverse depths (N,) at which rays xn (N, 2) meet something."""
        at = raster.placed(self.quads, self.textures, T_cam_world, self.rays.span)
        everywhere = np.tile(np.array([0, 1, 0, 1]), (len(at.box), 1))
        pixel = np.zeros(len(xn), np.int64)
        return raster.nearest_of(
            np.ascontiguousarray(xn), pixel, pixel, at.homography, at.extent, everywhere
        )[1]

    def trajectory(self) -> Trajectory:
        """The camera's poses T_world_cam, metres, with the times of the pictures."""
        T = se3.inverse(self.T_cam_world)
        return Trajectory(self.times, T[:, :3, 3], T[:, :3, :3])

r"""A map whose points are patches of pictures: keyframes, points and sightings as arrays.

====================  ==============================================================================
``keyframes``         ``T_kf_world`` (K, 4, 4); ``frame`` (K,), the number of the picture
``images[l]``         level l of all keyframes, one under another: (K H_l, W_l), 8 bits
``corners[k][l]``     corners of keyframe k on level l
``points``            ``X_world`` (N, 3); ``alive`` (N,); where each was first seen: ``source_kf``,
                      ``source_level``, ``source_uv`` (N, 2), pixels of level 0; ``slope`` (N, 2, 2),
                      d xn / d uv there; ``tried`` and ``found`` (N,), how often the tracker looked
``sightings``         ``kf``, ``point``, ``level`` (M,); ``uv`` (M, 2), pixels of level 0; ``on`` (M,)
====================  ==============================================================================

The row is the name, and no row is used twice.  A point's patch is read from the image in which the point was
first seen, each time anew, so it is never stale.  A point dies when that sighting is taken back, or
when fewer than two sightings are left.  Nothing here finds anything in an image, and nothing decides when.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, IntArray, as_array
from vslam_ref.features import Corners, SmallImage
from vslam_ref.geometry.cameras import Camera
from vslam_ref.systems.visual_map.keyframe_map import Bytes, KeyframeMap, Rowlike
from vslam_ref.systems.visual_map.rows import Rows

__all__ = ["Bytes", "PreparedPicture", "Rowlike", "VisualMap", "slopes"]


class PreparedPicture(NamedTuple):
    """A picture as systems look at it.

    Attributes
    ----------
    number : int
        Of the picture in its sequence.
    levels : tuple of ndarray of uint8
        The pyramid, shapes (H >> l, W >> l).
    corners : tuple of Corners
        Of each level.
    small : SmallImage
        Tiny and blurred.
    """

    number: int
    levels: tuple[Bytes, ...]
    corners: tuple[Corners, ...]
    small: SmallImage


def _keyframes() -> Rows:
    return Rows(T_kf_world=((4, 4), np.float64), frame=((), np.int64))


def _points() -> Rows:
    return Rows(
        X_world=((3,), np.float64),
        alive=((), np.bool_),
        source_kf=((), np.int64),
        source_level=((), np.int64),
        source_uv=((2,), np.float64),
        slope=((2, 2), np.float64),
        tried=((), np.int64),
        found=((), np.int64),
    )


def _sightings() -> Rows:
    return Rows(
        kf=((), np.int64),
        point=((), np.int64),
        level=((), np.int64),
        uv=((2,), np.float64),
        on=((), np.bool_),
    )


@dataclass
class VisualMap(KeyframeMap):
    """Keyframes, points and sightings of one camera.

    Parameters
    ----------
    camera : Camera
    shape : tuple of int
        Height and width of the pictures.
    levels : int
        Of their pyramids.
    """

    levels: int = 4
    keyframes: Rows = field(default_factory=_keyframes, kw_only=True)
    points: Rows = field(default_factory=_points, kw_only=True)
    sightings: Rows = field(default_factory=_sightings, kw_only=True)
    corners: list[tuple[Corners, ...]] = field(default_factory=list)
    small: list[SmallImage] = field(default_factory=list)
    _images: list[Rows] = field(default_factory=list)

    def __post_init__(self) -> None:
        height, width = self.shape
        if not self._images:
            self._images = [
                Rows(image=((height >> level, width >> level), np.uint8)) for level in range(self.levels)
            ]

    def image(self, level: int) -> Bytes:
        """Return that level of all keyframes, (K, H >> level, W >> level)."""
        return self._images[level]["image"]

    def add_keyframe(self, T_kf_world: ArrayLike, picture: PreparedPicture) -> int:
        """Add a picture with its pose; return the keyframe's number."""
        pose = as_array("T_kf_world", T_kf_world, 4, 4)
        for rows, image in zip(self._images, picture.levels, strict=True):
            rows.append(1, image=image)
        self.corners.append(picture.corners)
        self.small.append(picture.small)
        self.version += 1
        return int(self.keyframes.append(1, T_kf_world=pose, frame=picture.number)[0])

    def add_points(self, X_world: ArrayLike, kf: int, level: ArrayLike, uv: ArrayLike) -> IntArray:
        """Add points that were first seen in a keyframe, with that sighting.

        Parameters
        ----------
        X_world : array_like, shape (n, 3)
        kf : int
            Keyframe.
        level : array_like of int, broadcast to (n,)
        uv : array_like, shape (n, 2)
            Pixels of level 0.

        Returns
        -------
        ndarray of int64, shape (n,)
            Numbers of the points.
        """
        X, at = as_array("X_world", X_world, 3), as_array("uv", uv, 2)
        number = self.points.append(
            len(X),
            X_world=X,
            alive=True,
            source_kf=kf,
            source_level=level,
            source_uv=at,
            slope=slopes(self.camera, at),
        )
        self.observe(kf, number, level, at)
        return number

    def observe(self, kf: ArrayLike, point: ArrayLike, level: ArrayLike, uv: ArrayLike) -> IntArray:
        """Add sightings; return their numbers (m,).

        Parameters
        ----------
        kf, level : array_like of int, broadcast to (m,)
        point : array_like of int, shape (m,)
        uv : array_like, shape (m, 2)
            Pixels of level 0.
        """
        numbers = np.asarray(point, dtype=np.int64)
        self.version += 1
        at = np.asarray(uv, dtype=np.float64).reshape(-1, 2)
        return self.sightings.append(len(numbers), kf=kf, point=numbers, level=level, uv=at, on=True)

    def lives(self, on: BoolArray) -> BoolArray:
        """Which points (N,) may live: those seen twice, once in the keyframe that has their patch."""
        seen, points = self.sightings, self.points
        own = on & (seen["kf"] == points["source_kf"][seen["point"]])
        has_source = np.zeros(len(points), np.bool_)
        has_source[seen["point"][own]] = True
        return super().lives(on) & has_source

    def change_camera(self, camera: Camera) -> None:
        """Take another camera; poses, points and sightings stay."""
        super().change_camera(camera)
        self.points["slope"][:] = slopes(camera, self.points["source_uv"])

    def greys(self, points: IntArray) -> Bytes:
        """Grey levels of points (n,) in the pictures in which they were first seen."""
        height, width = self.shape
        u, v = np.rint(self.points["source_uv"][points]).astype(np.int64).T
        kf = self.points["source_kf"][points]
        return np.asarray(self.image(0)[kf, np.clip(v, 0, height - 1), np.clip(u, 0, width - 1)])

    def snapshot(self) -> VisualMap:
        """Return the map as it is now, to be read while this one changes; images are shared."""
        return VisualMap(
            self.camera,
            self.shape,
            self.levels,
            list(self.corners),
            list(self.small),
            [rows.shown() for rows in self._images],
            keyframes=self.keyframes.frozen(),
            points=self.points.frozen(),
            sightings=self.sightings.frozen(),
            version=self.version,
        )


def slopes(camera: Camera, uv: ArrayLike) -> Array:
    """Slope d xn / d uv (..., 2, 2) at pixels (..., 2): how a plane across the axis runs under the pixels.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> slopes(Pinhole(500.0, 250.0, 320.0, 240.0), [100.0, 100.0]).round(6).tolist()
    [[0.002, 0.0], [0.0, 0.004]]
    """
    ray = camera.unproject_with_jacobians(uv)
    z = ray.bearing[..., 2, None, None]
    xn = ray.bearing[..., :2, None] / z
    return np.asarray((ray.J_pixel[..., :2, :] - xn * ray.J_pixel[..., 2:, :]) / z)

"""Images without their distortion: where to look in the recorded image, and looking there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, BoolArray, as_array
from vslam_ref.geometry.cameras.camera import Camera


class ImageMap(NamedTuple):
    """Where a new image's pixels lie in the recorded one: ``uv (H, W, 2)``, pixels, if ``valid (H, W)``."""

    uv: Array
    valid: BoolArray


class Samples(NamedTuple):
    """Grey values or channels (..., channels if any), no unit, and whether they lay in the image (...)."""

    values: Array
    inside: BoolArray


def pixel_grid(size: tuple[int, int]) -> Array:
    """Centres of all pixels, shape (H, W, 2), for ``size`` = (W, H).

    Examples
    --------
    >>> pixel_grid((3, 2))[1, 2]
    array([2., 1.])
    """
    width, height = size
    if width < 1 or height < 1:
        raise ValueError(f"size={size}: need (width, height), both at least 1")
    u, v = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
    return np.stack([u, v], -1)


def undistortion_map(
    camera: Camera, target: Camera, size: tuple[int, int], R_target_camera: ArrayLike | None = None
) -> ImageMap:
    """Where the pixels of an image that ``target`` would have taken lie in the image of ``camera``.

    Every pixel of the new image is unprojected by ``target``, turned into the recording camera, and projected
    there: the map goes backwards, so the new image has no holes.

    Parameters
    ----------
    camera : Camera
        The camera that recorded the image.
    target : Camera
        The camera wanted, often a :class:`~vslam_ref.geometry.cameras.pinhole.Pinhole`.
    size : (int, int)
        Width and height of the new image, pixels.
    R_target_camera : array_like, shape (3, 3), optional
        Rotation from the recording to the wanted camera, for stereo rectification.

    Returns
    -------
    ImageMap

    Raises
    ------
    ValueError
        On a wrong size or shape.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Fov, Pinhole
    >>> camera = Fov(fx=4.0, fy=4.0, cx=3.5, cy=2.5, omega=0.9)
    >>> undistortion_map(camera, Pinhole(4.0, 4.0, 3.5, 2.5), (8, 6)).uv[0, 0].round(3)
    array([0.591, 0.422])
    """
    rays = target.unproject(pixel_grid(size))
    bearing = rays.bearing
    if R_target_camera is not None:
        R = np.asarray(R_target_camera, dtype=np.float64)
        if R.shape != (3, 3):
            raise ValueError(f"R_target_camera has shape {R.shape}; need (3, 3)")
        bearing = bearing @ R  # R^T applied to rows
    seen = camera.project(bearing)
    return ImageMap(seen.uv, seen.valid & rays.valid)


def sample_bilinear(image: NDArray[np.generic], uv: ArrayLike, fill: float = 0.0) -> Samples:
    """Interpolate an image linearly between the four pixel centres around each position.

    Parameters
    ----------
    image : ndarray, shape (H, W) or (H, W, C)
        Grey values or channels, any number type.
    uv : array_like, shape (..., 2)
        Positions; (0, 0) is the centre of the top-left pixel.
    fill : float
        Value outside the centres' rectangle [0, W - 1] x [0, H - 1], where nothing can be interpolated.

    Returns
    -------
    Samples
        Values as float64, not rounded.

    Raises
    ------
    ValueError
        On an image that is not 2-D or 3-D, or empty.

    Examples
    --------
    >>> sample_bilinear(np.array([[0, 10], [20, 30]]), [[0.5, 0.5], [1.0, 0.0], [1.5, 0.0]])
    Samples(values=array([15., 10.,  0.]), inside=array([ True,  True, False]))
    """
    image = np.asarray(image)
    if image.ndim not in (2, 3) or 0 in image.shape:
        raise ValueError(f"image has shape {image.shape}; need (H, W) or (H, W, C), not empty")
    uv = as_array("uv", uv, 2)
    height, width = image.shape[:2]
    u, v = uv[..., 0], uv[..., 1]
    inside = (u >= 0) & (u <= width - 1) & (v >= 0) & (v <= height - 1)
    u, v = np.where(inside, u, 0.0), np.where(inside, v, 0.0)
    grey = image.astype(np.float64)
    left, top = u.astype(np.intp), v.astype(np.intp)
    right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    channels = image.ndim - 2
    a, b = (w.reshape(w.shape + (1,) * channels) for w in (u - left, v - top))
    upper = (1 - a) * grey[top, left] + a * grey[top, right]
    lower = (1 - a) * grey[bottom, left] + a * grey[bottom, right]
    seen = inside.reshape(inside.shape + (1,) * channels)
    return Samples(np.where(seen, (1 - b) * upper + b * lower, fill), inside)

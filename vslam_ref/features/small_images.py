r"""A tiny, blurred copy of an image: enough to see how the camera turned.

Blurred so much, two pictures differ by a smooth function, and least squares on all pixels converges from far
away.  The motion between them is taken as a turn and a shift, :math:`x_b = R (x_a - c) + c + t`.  For a
camera that turned and did not move, this tells the rotation: pixels become rays, and the rays of both images
are laid over one another.  Motion sideways reads as rotation, too: parallax cannot be told from a turn.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.features.levels import finest_from_level, grey, halve, level_from_finest
from vslam_ref.features.templates import bilinear
from vslam_ref.geometry import se2
from vslam_ref.geometry.cameras import Camera
from vslam_ref.geometry.nearest import nearest_rotation

LEAST_SIDE = 20
"""The shorter side has at least so many pixels: 640 x 480 becomes 40 x 30."""
BLUR = 2.5
"""Standard deviation of the blur, pixels of the small image: PTAM's."""
MARGIN = 5
"""Pixels, two deviations of the blur, that are not compared.

Beyond the border nothing is known, so that slopes near it come out too small for the change that a shift
makes: with them, shifts are overestimated by 10 to 20 %.
"""
STEPS, NEAR = 50, 1e-2
LEAST_OVERLAP = 0.3
"""Share of the pixels of the first image that the second must still show."""


class SmallImage(NamedTuple):
    """Blurred grey levels (h, w), and the level of the pyramid of which they are."""

    value: Array
    level: int


class PlaneMotion(NamedTuple):
    """Turn and shift of a picture.

    Attributes
    ----------
    T_b_a : ndarray, shape (3, 3)
        Rigid motion of the plane, for positions relative to the image's centre in pixels of the small image.
    rms : float
        Root mean square of what remains, grey levels, without its mean.
    reason : str
        Empty if it converged.
    """

    T_b_a: Array
    rms: float
    reason: str


def small_image(image: ArrayLike, level: int = 0) -> SmallImage:
    """Halve an image until its shorter side has 20 to 39 pixels, and blur it.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
        One level of a pyramid.
    level : int
        Which one: 0 is the whole image.

    Returns
    -------
    SmallImage

    Raises
    ------
    ValueError
        If the image is not grey with 8 bits, or its shorter side is below 20 pixels.

    Examples
    --------
    >>> small = small_image(np.zeros((480, 640), np.uint8))
    >>> small.value.shape, small.level
    ((30, 40), 4)
    """
    from scipy.ndimage import gaussian_filter

    found = grey("image", image, LEAST_SIDE)
    while min(found.shape) >= 2 * LEAST_SIDE:
        found, level = halve(found), level + 1
    return SmallImage(gaussian_filter(found.astype(np.float64), BLUR, mode="nearest"), level)


def plane_motion(a: SmallImage, b: SmallImage) -> PlaneMotion:
    """Turn and shift that lay image a over image b, by inverse compositional least squares.

    Implements :eq:`eq-small-image`.

    Parameters
    ----------
    a, b : SmallImage
        Of one shape and level.

    Returns
    -------
    PlaneMotion

    Raises
    ------
    ValueError
        If shapes or levels differ.
    """
    if a.value.shape != b.value.shape or a.level != b.level:
        raise ValueError(
            f"small images of {a.value.shape} on level {a.level} and {b.value.shape} on level {b.level}: "
            "need the same"
        )
    height, width = a.value.shape
    gy, gx = (g.ravel() for g in np.gradient(a.value))
    y, x = (v.ravel() for v in np.indices(a.value.shape, np.float64))
    middle = (width - 1) / 2, (height - 1) / 2
    reach = middle[0] - MARGIN, middle[1] - MARGIN
    x, y = x - middle[0], y - middle[1]
    inner = (abs(x) <= reach[0]) & (abs(y) <= reach[1])
    J = np.stack([gx, gy, gy * x - gx * y], 1)  # of the moved first image, in (shift, turn)
    T, rms, reason = np.eye(3), np.inf, f"no convergence in {STEPS} steps"
    for _ in range(STEPS):
        u = T[0, 0] * x + T[0, 1] * y + T[0, 2] + middle[0]
        v = T[1, 0] * x + T[1, 1] * y + T[1, 2] + middle[1]
        seen = inner & (abs(u - middle[0]) <= reach[0]) & (abs(v - middle[1]) <= reach[1])
        if seen.sum() < LEAST_OVERLAP * inner.sum():
            return PlaneMotion(T, rms, "the images hardly overlap")
        r = a.value.ravel()[seen] - bilinear(b.value.ravel(), width, u[seen], v[seen])
        slopes, r = J[seen] - J[seen].mean(0), r - r.mean()  # the offset of brightness is taken with it
        rms = float(np.sqrt(np.mean(r * r)))
        S = slopes.T @ slopes
        if np.linalg.cond(S) > 1e10:
            return PlaneMotion(T, rms, "the image is flat")
        delta = -np.linalg.solve(S, slopes.T @ r)  # eq-small-image
        T = T @ se2.matrix(se2.inverse(se2.exp(delta)))
        if np.hypot(delta[0], delta[1]) + abs(delta[2]) * width / 2 < NEAR:
            reason = ""
            break
    return PlaneMotion(T, rms, reason)


def moved_by(motion: PlaneMotion, small: SmallImage, uv: ArrayLike) -> Array:
    """Where points of the first image lie in the second, if all of it moved as the small images say.

    Implements :eq:`eq-small-image`, its motion put to use.

    Parameters
    ----------
    motion : PlaneMotion
    small : SmallImage
        One of the two, for size and level.
    uv : array_like, shape (N, 2)
        Pixels of level 0 in the first image.

    Returns
    -------
    ndarray, shape (N, 2)
        Pixels of level 0 in the second image.

    Examples
    --------
    >>> small = SmallImage(np.zeros((30, 40)), 4)
    >>> shift = np.array([[1.0, 0, 2.0], [0, 1, 0], [0, 0, 1]])  # 2 pixels of level 4 to the right
    >>> moved_by(PlaneMotion(shift, 0.0, ""), small, [[100.0, 50.0]]).tolist()
    [[132.0, 50.0]]
    """
    height, width = small.value.shape
    middle = np.array([(width - 1) / 2, (height - 1) / 2])
    offset = level_from_finest(np.asarray(uv, np.float64), small.level) - middle
    T = motion.T_b_a
    return finest_from_level(offset @ T[:2, :2].T + T[:2, 2] + middle, small.level)


def rotation(camera: Camera, shape: tuple[int, int], level: int, T_b_a: ArrayLike) -> Array:
    """Rotation of the camera that moves the picture by a turn and a shift.

    Implements :eq:`eq-small-rotation`.

    Parameters
    ----------
    camera : Camera
        Of the whole image.
    shape : tuple of int
        Height and width of the small image.
    level : int
        Its level.
    T_b_a : array_like, shape (3, 3)
        Of :func:`plane_motion`.

    Returns
    -------
    ndarray, shape (3, 3)
        R_b_a, from camera a to camera b, that fits the rays of nine pixels.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> shift = np.array([[1.0, 0, 2.0], [0, 1, 0], [0, 0, 1]])  # 2 pixels of level 4 to the right
    >>> R = rotation(Pinhole(500.0, 500.0, 319.5, 239.5), (30, 40), 4, shift)
    >>> round(float(np.arctan2(R[0, 2], R[2, 2])), 4), round(float(np.arctan(32 / 500)), 4)
    (0.0595, 0.0639)

    The picture's shift is larger than the shift at its centre: rotation moves its sides farther.
    """
    height, width = shape
    middle = np.array([(width - 1) / 2, (height - 1) / 2])
    side = np.array([-1.0, 0.0, 1.0]) / np.sqrt(8.0)  # variance 1/12: spread as the pixels are
    extent = np.maximum(np.array([width, height]) - 2 * MARGIN, 1)
    offset = np.stack(np.meshgrid(*(extent[:, None] * side)), -1).reshape(-1, 2)
    T = np.asarray(T_b_a, np.float64)
    moved = offset @ T[:2, :2].T + T[:2, 2]
    rays_a, rays_b = (camera.unproject(finest_from_level(p + middle, level)).bearing for p in (offset, moved))
    return nearest_rotation(rays_b.T @ rays_a).R  # eq-small-rotation

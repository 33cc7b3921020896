"""What a calibration file says about one camera, and the conversion of relative parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from vslam_ref.arrays import Array
from vslam_ref.geometry.cameras import Camera


@dataclass(frozen=True)
class CameraFile:
    """One camera of a calibration file.

    Parameters
    ----------
    camera : Camera
        Intrinsics, pixels; (0, 0) is the centre of the top-left pixel.
    size : (int, int) or None
        Width and height of the images, pixels; None where the file does not say.
    T_cam_rig : ndarray, shape (4, 4), or None
        Rigid motion from the rig (EuRoC's body, Kalibr's IMU) to the camera, metres; None where not given.
    name : str
        The camera's name in the file.
    std : tuple of float, or None
        Standard deviation of each of the camera's ``params``, 0 for what was not estimated; None where the
        file does not say.
    notes : tuple of str
        What is odd in the file and harmless, a sentence each.
    """

    camera: Camera
    size: tuple[int, int] | None = None
    T_cam_rig: Array | None = None
    name: str = ""
    std: tuple[float, ...] | None = None
    notes: tuple[str, ...] = ()


def pixels_from_relative(relative: float, size: int, *, centre: bool) -> float:
    """Turn a number relative to the image's width or height into pixels.

    Implements :eq:`eq-half-pixel`.

    A relative position runs from 0 at the image's outer left edge to 1 at its outer right edge.  Those edges
    are u = -1/2 and u = W - 1/2, because whole numbers are centres of pixels: u = c W - 1/2.  A focal length
    is a difference of positions, so it has no shift: f W.

    Parameters
    ----------
    relative : float
        The number in the file.
    size : int
        Width (for u) or height (for v), pixels.
    centre : bool
        True for a position, False for a focal length.

    Examples
    --------
    >>> pixels_from_relative(0.5, 640, centre=True), pixels_from_relative(0.5, 640, centre=False)
    (319.5, 320.0)
    """
    return relative * size - (0.5 if centre else 0.0)


def relative_sensor(relative: Sequence[float], size: tuple[int, int]) -> list[float]:
    """``fx, fy, cx, cy`` in pixels from four relative numbers."""
    sides, centres = (*size, *size), (False, False, True, True)
    rows = zip(relative, sides, centres, strict=True)
    return [pixels_from_relative(value, side, centre=centre) for value, side, centre in rows]

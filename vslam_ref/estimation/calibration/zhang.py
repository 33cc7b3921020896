"""Zhang's closed form: the sensor's four numbers from homographies, and the pose from one of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.geometry import se3
from vslam_ref.geometry.nearest import nearest_rotation

LEAST_GAP = 1e-9
"""Second smallest over largest singular value of Zhang's system, below which two cameras solve it."""


class Sensor(NamedTuple):
    """The sensor of a camera without distortion.

    Attributes
    ----------
    numbers : ndarray, shape (4,), or None
        fx, fy, cx, cy in pixels; None where the homographies do not give them.
    gap : float
        Second smallest over largest singular value of the system; 0 where the answer is not unique.
    reason : str
        Empty, or why there are no numbers.
    """

    numbers: Array | None
    gap: float
    reason: str


def sensor_from_homographies(H: ArrayLike, size: tuple[int, int]) -> Sensor:
    """Focal lengths and principal point from homographies board -> image, without skew.

    Implements :eq:`eq-zhang-constraints` and :eq:`eq-zhang-closed`.

    Parameters
    ----------
    H : array_like, shape (V, 3, 3)
        Homographies from the board's plane to pixels, V at least 2.
    size : (int, int)
        Width and height of the images; they only condition the system.

    Returns
    -------
    Sensor

    Notes
    -----
    A board that is parallel to the image plane gives equations that hold for every focal length; so do boards
    that are parallel to each other, all but one of them.  Distortion bends the homographies, and with it the
    answer: it is a start, not a result.

    Examples
    --------
    >>> K = np.array([[500.0, 0, 320], [0, 510, 240], [0, 0, 1]])
    >>> T = se3.exp([[0, 0, 5, 0.5, 0, 0], [0, 0, 5, 0, 0.6, 0.1], [1, 0, 4, 0.4, -0.4, 0.0]])
    >>> sensor_from_homographies(K @ T[:, :3, [0, 1, 3]], (640, 480)).numbers.round(6).tolist()
    [500.0, 510.0, 320.0, 240.0]
    """
    given = np.asarray(H, dtype=np.float64)
    if given.ndim != 3 or given.shape[1:] != (3, 3):
        raise ValueError(f"H has shape {given.shape}; need (V, 3, 3)")
    scale = 0.5 * max(size)
    centre: Array = 0.5 * (np.array(size, dtype=np.float64) - 1.0)
    N = np.array([[1 / scale, 0, -centre[0] / scale], [0, 1 / scale, -centre[1] / scale], [0, 0, 1]])
    moved: Array = N @ given
    moved /= np.linalg.norm(moved, axis=(1, 2), keepdims=True)
    system = np.concatenate([_row(moved, 0, 1), _row(moved, 0, 0) - _row(moved, 1, 1)])
    _, singular, vt = np.linalg.svd(system, full_matrices=True)
    gap = float(singular[3] / singular[0]) if len(singular) > 3 else 0.0
    if not gap > LEAST_GAP:
        return Sensor(None, gap, "more than one camera fits: too few boards, or all of them parallel")
    b11, b22, b13, b23, b33 = vt[4]
    if b11 == 0.0 or b22 == 0.0:
        return Sensor(None, gap, "the conic of the focal lengths is degenerate")
    rest = b33 - b13 * b13 / b11 - b23 * b23 / b22
    if not (rest / b11 > 0 and rest / b22 > 0):
        return Sensor(None, gap, "no camera without distortion: a squared focal length is negative")
    focal = np.sqrt([rest / b11, rest / b22])
    return Sensor(np.concatenate([scale * focal, centre - scale * np.array([b13 / b11, b23 / b22])]), gap, "")


def _row(H: Array, i: int, j: int) -> Array:
    """Coefficients (V, 5) of h_i^T B h_j in B's entries 11, 22, 13, 23, 33."""
    a, b = H[:, :, i], H[:, :, j]
    cross = a[:, :2] * b[:, 2:] + a[:, 2:] * b[:, :2]
    return np.concatenate([a[:, :2] * b[:, :2], cross, a[:, 2:] * b[:, 2:]], axis=1)


def pose_from_homography(H: ArrayLike) -> Array:
    """Pose of the board from the homography board -> *normalised* image, pixels without their sensor.

    Implements :eq:`eq-board-pose`.

    Parameters
    ----------
    H : array_like, shape (..., 3, 3)
        Its sign such that the board lies in front of the camera, as :func:`.homography.homography` gives it.

    Returns
    -------
    ndarray, shape (..., 4, 4)
        T_cam_board; the rotation is the nearest one to the three columns.

    Raises
    ------
    ValueError
        If the columns are no basis: a board seen from its edge.

    Examples
    --------
    >>> T = se3.exp([0.1, 0.2, 3.0, 0.3, -0.2, 0.1])
    >>> bool(np.abs(pose_from_homography(7.0 * T[:3, [0, 1, 3]]) - T).max() < 1e-14)
    True
    """
    H = np.asarray(H, dtype=np.float64)
    length = np.linalg.norm(H[..., :2], axis=-2).mean(axis=-1)
    if not (length > 0).all():
        raise ValueError("a homography's first two columns are zero")
    M = H / length[..., None, None]
    r1, r2, t = M[..., 0], M[..., 1], M[..., 2]
    R = nearest_rotation(np.stack([r1, r2, np.cross(r1, r2)], axis=-1)).R
    return se3.from_rt(R, t)

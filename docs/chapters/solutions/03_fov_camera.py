"""Solution of exercise 3.1: the FOV camera, there and back.

Both ways are a position times a quotient that depends on its length only.  Each quotient is 0/0 at the axis
and has a limit there, 2 tan(omega/2)/omega and its inverse, which is taken wherever the length is zero;
and both are 1 where omega is zero.
"""

import numpy as np


def project(params: np.ndarray, X_cam: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Project points with the FOV camera, equations (A2.2) to (A2.4).

    Parameters
    ----------
    params : ndarray, shape (5,)
        fx, fy, cx, cy in pixels, and omega in radians, 0 <= omega < pi.
    X_cam : ndarray, shape (N, 3)
        Points in the camera's frame.

    Returns
    -------
    uv : ndarray, shape (N, 2)
        Pixels; the principal point where not valid.
    valid : ndarray of bool, shape (N,)
        False behind the camera, z <= 0.
    """
    omega = params[4]
    valid = X_cam[:, 2] > 0
    xn = np.where(valid[:, None], X_cam[:, :2], 0.0) / np.where(valid, X_cam[:, 2], 1.0)[:, None]
    r = np.hypot(xn[:, 0], xn[:, 1])
    factor = np.full(len(r), _limit(omega))
    away = (r > 0) & (omega > 0)
    factor[away] = np.arctan(2 * r[away] * np.tan(omega / 2)) / (omega * r[away])
    return params[2:4] + params[:2] * xn * factor[:, None], valid


def unproject(params: np.ndarray, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the normalised position (x/z, y/z) that appears at a pixel.

    Parameters
    ----------
    params : ndarray, shape (5,)
        As for ``project``.
    uv : ndarray, shape (N, 2)
        Pixels.

    Returns
    -------
    xn : ndarray, shape (N, 2)
        Normalised positions; zero where not valid.
    valid : ndarray of bool, shape (N,)
        False where no ray in front of the camera appears.
    """
    omega = params[4]
    xd = (uv - params[2:4]) / params[:2]
    r = np.hypot(xd[:, 0], xd[:, 1])
    valid = r * omega < np.pi / 2
    factor = np.full(len(r), 1 / _limit(omega))
    away = valid & (r > 0) & (omega > 0)
    factor[away] = np.tan(r[away] * omega) / (2 * r[away] * np.tan(omega / 2))
    return np.where(valid[:, None], xd * factor[:, None], 0.0), valid


def _limit(omega: float) -> float:
    return 2 * np.tan(omega / 2) / omega if omega > 0 else 1.0

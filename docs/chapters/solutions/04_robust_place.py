"""Solution of exercise 4.1: a place that outliers cannot move.

Start from the median of each coordinate: wrong points can shift it, but not carry it away.  The scale is
taken again in every round, so a start that is off widens the cut until the honest points are inside.
"""

import numpy as np


def weight(r: np.ndarray, c: float) -> np.ndarray:
    """Weight of Tukey's loss.

    Parameters
    ----------
    r : ndarray, shape (n,)
        Norms of errors, >= 0, in the unit of ``c``.
    c : float
        Constant.

    Returns
    -------
    ndarray, shape (n,)
        1 at 0, 0 from ``c`` on.
    """
    return np.maximum(1 - (r / c) ** 2, 0.0) ** 2


def scale(r: np.ndarray) -> float:
    """Standard deviation of one coordinate, from norms of plane errors.

    Parameters
    ----------
    r : ndarray, shape (n,)
        Norms of errors, fewer than half of which are wrong.

    Returns
    -------
    float
        Without a small-sample factor; infinite for n <= 1, where nothing is redundant.
    """
    if len(r) <= 1:
        return np.inf
    return float(np.median(r) / np.sqrt(2 * np.log(2)))


def place(points: np.ndarray) -> np.ndarray:
    """Robust place of points in the plane, with 95 % efficiency where all are honest.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        At least one point; fewer than 40 % are wrong.

    Returns
    -------
    ndarray, shape (2,)
        Never NaN.
    """
    mu = np.median(points, axis=0)
    for _ in range(100):
        r = np.linalg.norm(points - mu, axis=1)
        sigma = scale(r)
        if sigma == 0.0:  # more than half of the points are one point: it is the place
            return mu
        w = weight(r, 5.1230 * sigma)
        better = w @ points / w.sum()
        if np.allclose(better, mu, rtol=1e-13, atol=1e-13 * sigma if np.isfinite(sigma) else 0.0):
            return better
        mu = better
    return mu

"""Exercise 4.1: a place that outliers cannot move."""

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
    raise NotImplementedError


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
    raise NotImplementedError


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
    raise NotImplementedError

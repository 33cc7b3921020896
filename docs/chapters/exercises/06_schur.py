"""Exercise 6.1: points first."""

import numpy as np


def reduced_system(
    B: np.ndarray,
    C: np.ndarray,
    W: np.ndarray,
    view: np.ndarray,
    point: np.ndarray,
    g_view: np.ndarray,
    g_point: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Eliminate the points from the normal equations.

    Parameters
    ----------
    B : ndarray, shape (V, 6, 6)
        Blocks of the views on the diagonal, positive definite, damped already.
    C : ndarray, shape (N, 3, 3)
        Blocks of the points on the diagonal, positive definite, damped already.
    W : ndarray, shape (n, 6, 3)
        For each observation, the block between its view (rows) and its point (columns).
    view, point : ndarray of int, shape (n,)
        View and point of each observation, in any order; no pair twice.
    g_view, g_point : ndarray, shapes (V, 6) and (N, 3)
        Gradient: H step = -g is to be solved.

    Returns
    -------
    S : ndarray, shape (6 V, 6 V)
        Symmetric.
    rhs : ndarray, shape (6 V,)
        The steps of the views solve S step = rhs.
    """
    raise NotImplementedError


def point_steps(
    C: np.ndarray,
    W: np.ndarray,
    view: np.ndarray,
    point: np.ndarray,
    g_point: np.ndarray,
    view_steps: np.ndarray,
) -> np.ndarray:
    """Steps of the points, from those of the views.

    Parameters
    ----------
    C, W, view, point, g_point :
        As above.
    view_steps : ndarray, shape (V, 6)

    Returns
    -------
    ndarray, shape (N, 3)
    """
    raise NotImplementedError

"""Solution of exercise 6.1: points first.

Each point is eliminated from the views that see it, and from no others; C is never written as one matrix.
"""

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
    S, rhs = np.zeros((6 * len(B), 6 * len(B))), -g_view.ravel()
    for i, block in enumerate(B):
        S[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = block
    L_inverse = np.linalg.inv(np.linalg.cholesky(C))  # C^-1 = M M^T with M = L^-T
    order = np.argsort(point, kind="stable")
    for seen in np.split(order, np.cumsum(np.bincount(point, minlength=len(C)))[:-1]):
        if len(seen) == 0:
            continue
        j = point[seen[0]]
        columns = (6 * view[seen][:, None] + np.arange(6)).ravel()
        V = W[seen].reshape(-1, 3) @ L_inverse[j].T
        S[np.ix_(columns, columns)] -= V @ V.T
        rhs[columns] += V @ (L_inverse[j] @ g_point[j])
    return S, rhs


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
    total = g_point.copy()
    np.add.at(total, point, np.einsum("nij,ni->nj", W, view_steps[view]))
    return -np.linalg.solve(C, total[:, :, None])[:, :, 0]

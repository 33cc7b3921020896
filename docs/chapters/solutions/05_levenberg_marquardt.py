"""Solution of exercise 5.1: a solver of your own.

Columns are divided by their lengths, so one damping serves all units.  The longest lengths so far are kept
(Moré).  Refused steps cost one evaluation and double the damping, then quadruple it, and so on.
"""

from collections.abc import Callable

import numpy as np


def solve(function: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], start: np.ndarray) -> np.ndarray:
    """Minimise half the sum of squares of a residual by Levenberg-Marquardt.

    Parameters
    ----------
    function : callable
        Maps x (n,) to the residual (m,) and its Jacobian (m, n).  Far from the minimum both may hold
        numbers that are not finite.
    start : ndarray, shape (n,)
        A point where everything is finite.

    Returns
    -------
    ndarray, shape (n,)
        Never worse than the start, and finite.
    """
    x, n = np.array(start, dtype=float), len(start)
    r, J = function(x)
    damping, growth, scale = 1e-3, 2.0, np.zeros(n)
    for _ in range(500):
        scale = np.maximum(scale, np.linalg.norm(J, axis=0))
        D = np.where(scale > 0, scale, 1.0)
        rows = np.vstack([J / D, np.sqrt(damping) * np.eye(n)])
        scaled = np.linalg.lstsq(rows, np.concatenate([-r, np.zeros(n)]), rcond=None)[0]
        if np.linalg.norm(scaled) <= 1e-12 * np.linalg.norm(D * x):
            return x
        promised = 0.5 * np.sum((J @ (scaled / D)) ** 2) + damping * scaled @ scaled
        with np.errstate(all="ignore"):
            r_new, J_new = function(x + scaled / D)
            gain = 0.5 * np.sum((r - r_new) * (r + r_new)) / max(promised, 1e-300)
        if gain > 0 and np.isfinite(J_new).all():  # False for NaN
            x, r, J = x + scaled / D, r_new, J_new
            damping, growth = damping * max(1 / 3, 1 - (2 * min(gain, 1.0) - 1) ** 3), 2.0
        else:
            damping, growth = damping * growth, 2 * growth
    return x

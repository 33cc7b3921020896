"""Exercise 5.1: a solver of your own."""

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
    raise NotImplementedError

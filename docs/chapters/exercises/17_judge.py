"""Exercise 17.1: judge whether a filter is consistent."""

import numpy as np


def consistent(nees: np.ndarray, dof: int, false_alarm: float = 0.05) -> bool:
    """Judge a filter by the NEES of its runs.

    Parameters
    ----------
    nees : ndarray, shape (M, T)
        NEES of M independent runs at T times.  The values of one run are not independent.
    dof : int
        Degrees of freedom of one value.
    false_alarm : float
        Greatest allowed share of consistent filters that are called inconsistent.

    Returns
    -------
    bool
        True if nothing speaks against it.  A filter that is too sure, too careful, or that has a value
        that is not finite, is not consistent.
    """
    raise NotImplementedError

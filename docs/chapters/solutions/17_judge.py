"""Solution of exercise 17.1: judge whether a filter is consistent.

One time, fixed beforehand: the last, where a fault has had the longest time to show.  There the M
values are independent, and for a consistent filter their sum is chi-squared with M dof degrees of
freedom.  That is exact, however the errors correlate in time, because no second time is looked at.
Two tails: too careful is a fault as well.
"""

import numpy as np
from scipy.special import gammainc


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
    if not np.isfinite(nees).all():
        return False
    last = nees[:, -1]
    below = gammainc(len(last) * dof / 2, last.sum() / 2)  # chi-squared distribution function
    return bool(false_alarm / 2 <= below <= 1 - false_alarm / 2)

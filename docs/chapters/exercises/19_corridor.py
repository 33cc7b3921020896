"""Exercise 19.1: two maps of a corridor.

A laser stands at the left end of a corridor of n cells and looks along it.  Cell i is [i, i + 1).  A map is
an array of log-odds (n,).
"""

import numpy as np

UNSEEN, MISS, HIT = 0, 1, 2
DECIDED = np.log(0.9 / 0.1)
S_HIGH, S_LOW, S_MISS = 0.8, 0.3, 0.3
D_HIGH, D_LOW, D_MISS = 0.95, 0.05, 0.05
S_BOUND = np.log(0.999 / 0.001)


def observe(reading: float, n: int) -> np.ndarray:
    """What one reading says of every cell.

    Parameters
    ----------
    reading : float
        Distance in cells.  ``inf`` and readings beyond the corridor: nothing came back, the whole corridor is
        free.  ``nan``, zero and negative readings say nothing.
    n : int
        Number of cells.

    Returns
    -------
    ndarray of int, shape (n,)
        UNSEEN, MISS or HIT.
    """
    raise NotImplementedError


def update(S: np.ndarray, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """S_t and D_t from S_{t-1} and an observation.

    D has no memory, and is high where S_{t-1} was free.

    Parameters
    ----------
    S : ndarray, shape (n,)
        Log-odds before; it must not be changed.
    seen : ndarray of int, shape (n,)
        From :func:`observe`.

    Returns
    -------
    (ndarray, ndarray), shapes (n,)
        Log-odds of S, between -S_BOUND and S_BOUND, and of D; 0 in D where nothing was seen.
    """
    raise NotImplementedError


def settled(hit_for: np.ndarray, S: np.ndarray, seconds: float) -> np.ndarray:
    """S before an update, where what came to stay is forgotten to have been free.

    Parameters
    ----------
    hit_for : ndarray, shape (n,)
        For how many seconds each cell has been hit at every look; 0 where the last look was a miss.
    S : ndarray, shape (n,)
        Log-odds; must not be changed.
    seconds : float
        How long a thing must stay.

    Returns
    -------
    ndarray, shape (n,)
        0 where S was decided free and the cell was hit for ``seconds`` or longer; else S.
    """
    raise NotImplementedError

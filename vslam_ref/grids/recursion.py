"""The odds recursion of A's chapter 4 for one cell, and what its readings make of it.

In log-odds, before anything is put in for its factors, the derivation ends with

    L(S_t | o_1..t, S_{t-1}) = L(S_t | o_t, S_{t-1}) - L(S_t | S_{t-1}) + L(S_t | o_1..t-1, S_{t-1}) .

Then two things are said in one line, and they exclude each other:

============== ========================= ============================== ====================================
reading        L(S_t | S_{t-1})          L(S_t | o_1..t-1, S_{t-1})     what is assumed
============== ========================= ============================== ====================================
``printed``    0 (P = 0.5)               L(S_{t-1})                     both at once
``unchanged``  L(S_{t-1})                L(S_{t-1})                     a static cell stays as it is
``forgetful``  0 (P = 0.5)               0                              S_{t-1} says nothing of S_t
============== ========================= ============================== ====================================

And the first term can be read in two ways:

* ``conditioned``, as it is written: the probability of S_t given the observation *and* S_{t-1}.  It holds the
  old odds already: L(S_{t-1}) + e, where e is the log-likelihood ratio of the observation.
* ``evidence``: e alone, as if S_{t-1} were 0.5.

What is right when the cell does not change is known: L(S_{t-1}) + e.  Three of the six combinations give it:
``conditioned`` with either of the readings that say one thing (the table alone, nothing multiplied to it),
and ``printed`` with ``evidence``: the formula as it is, its table read as a likelihood ratio.  The maps of
this room do the last.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array

Reading = Literal["printed", "unchanged", "forgetful"]
Table = Literal["conditioned", "evidence"]
READINGS: tuple[Reading, ...] = ("printed", "unchanged", "forgetful")
TABLES: tuple[Table, ...] = ("conditioned", "evidence")


def recursion(table: ArrayLike, transition: ArrayLike, prediction: ArrayLike) -> Array:
    """Return the log-odds of a cell after an observation.

    Implements :eq:`eq-odds-recursion`.

    Parameters
    ----------
    table, transition, prediction : array_like, shape (...,)
        L(S_t | o_t, S_{t-1}), L(S_t | S_{t-1}) and L(S_t | o_1..t-1, S_{t-1}).

    Returns
    -------
    ndarray, shape (...,)
        Log-odds.
    """
    after: Array = np.asarray(table, np.float64) - np.asarray(transition) + np.asarray(prediction)
    return after


def follow(evidence: ArrayLike, reading: Reading, table: Table, start: float = 0.0) -> Array:
    """Return the log-odds of a cell that does not change, after each of a row of observations.

    Parameters
    ----------
    evidence : array_like, shape (n,)
        Log-likelihood ratio of each observation, ln P(o | occupied) - ln P(o | free).
    reading : {"printed", "unchanged", "forgetful"}
        What is put in for the second and third term.
    table : {"conditioned", "evidence"}
        What the first term is taken to be.
    start : float
        Log-odds before.

    Raises
    ------
    ValueError
        If there is no such reading or table.

    Examples
    --------
    >>> follow([1.0, 1.0, 1.0], "printed", "conditioned")  # the prior odds count twice
    array([1., 3., 7.])
    >>> follow([1.0, 1.0, 1.0], "printed", "evidence")
    array([1., 2., 3.])
    """
    if reading not in READINGS or table not in TABLES:
        raise ValueError(f"reading {reading!r}, table {table!r}: need one of {READINGS} and one of {TABLES}")
    e = np.asarray(evidence, dtype=np.float64)
    path, now = np.empty(len(e)), float(start)
    for k, seen in enumerate(e.tolist()):
        first = seen + (now if table == "conditioned" else 0.0)
        transition = now if reading == "unchanged" else 0.0
        prediction = 0.0 if reading == "forgetful" else now
        now = float(recursion(first, transition, prediction))  # eq-twice for "printed", "conditioned"
        path[k] = now
    return path

"""Where a log is silent: gaps are told, and the motion through a gap of the odometry is doubted.

::

    speed   ---.__.--. . . . . . . . ._.---     known . held? . known
               |     |<---- g ---->|
               |-----+-------------|            as long a window where the speed is known: how wrong was it
               |<------ g ---->|                to hold the speed at its beginning?

Between two stamps the last control holds.  Over a tenth of a second that is an error like any other; over
twelve seconds the vehicle may have stopped, or turned round.  How far holding the last control is off after g
seconds is not guessed: it is measured on the log itself.  From every stamp where the log has no gap for g
seconds, the way (and the turn) that was driven is compared with the way that holding the first control would
have given.  The mean square of these differences is added to the variance of a gap of g seconds.  It is right
if what the vehicle did in the gap was like what it did else, and then the normalised error has the mean 1.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.systems.slam_log.log import SlamLog

ODOMETRY_GAP = 2.0
"""Seconds between two stamps of the odometry from which on it is a gap."""
SIGHTING_GAP = 30.0
"""Seconds between two sightings of landmarks from which on it is told."""
WINDOWS = 3.0
"""The known part of the log must be so many times as long as a window of it."""


SHORTEST = 0.05
"""Seconds: no shorter window is tried."""


def gap_variances(times: Array, increments: Array) -> Array:
    """What gaps of the odometry add to the variances of ds (m^2) and dalpha (rad^2), shape (T - 1, 2).

    Parameters
    ----------
    times : ndarray, shape (T,)
        Stamps of the odometry, seconds, never decreasing.
    increments : ndarray, shape (T - 1, 2)
        ds (m) and dalpha (rad) of each interval, with the control at its beginning held.

    Returns
    -------
    ndarray, shape (T - 1, 2)
        Zero but for intervals of more than :data:`ODOMETRY_GAP` seconds.
    """
    added, span = np.zeros_like(increments), np.diff(times)
    silent = span > ODOMETRY_GAP
    known = float(span[~silent].sum())
    for k in np.flatnonzero(silent):
        length, missed = min(float(span[k]), known / WINDOWS), None
        while missed is None and length > SHORTEST:
            missed = _held(times, increments, silent, length)
            length *= 1.0 if missed is not None else 0.5
        if missed is None:  # gaps everywhere: the whole way is in doubt
            added[k] = increments[k] ** 2
        else:  # beyond what the log can tell the error goes on growing as it would at a wrong speed
            added[k] = missed * (span[k] / length) ** 2
    return added


def _held(times: Array, increments: Array, silent: BoolArray, length: float) -> Array | None:
    """Mean square (2,) of what holding a control for ``length`` seconds misses; None: gaps everywhere."""
    start, first = np.unique(times, return_index=True)  # of equal stamps the first: its interval is empty
    way = np.vstack([np.zeros(2), np.cumsum(np.where(silent[:, None], 0.0, increments), axis=0)])
    last = np.append(first[1:], len(times)) - 1  # the control in force after a stamp is the last one there
    way, end = way[first], start + length
    quiet = np.concatenate([[0.0], np.cumsum(silent)])[last]
    whole = end <= start[-1]
    until = np.minimum(np.searchsorted(start, end[whole], side="left"), len(start) - 1)
    k = np.flatnonzero(whole)
    k = k[quiet[until] == quiet[k]]  # no gap begins in the window
    if not len(k):
        return None
    driven = np.stack([np.interp(end[k], start, way[:, i]) for i in range(2)], -1) - way[k]
    span = np.diff(times)[last[k]]
    rate = increments[last[k]] / np.where(span > 0, span, 1.0)[:, None]
    return np.asarray(np.mean((driven - rate * length) ** 2, axis=0))


def gap_notes(log: SlamLog) -> tuple[str, ...]:
    """A sentence for gaps of the odometry and one for gaps of the sightings: how many, and the longest."""
    notes = []
    found = _told(log.times, ODOMETRY_GAP)
    if found:
        doubt = "the last speed is held, with the doubt that the rest of the log gives it"
        notes.append(f"odometry: {found}; {doubt}")
    found = _told(np.array([s.time for s in log.sightings]), SIGHTING_GAP)
    if found:
        notes.append(f"sightings of landmarks: {found}; odometry alone leads through")
    return tuple(notes)


def _told(times: Array, least: float) -> str:
    """``2 gap(s) of more than 30 s, the longest 35.2 s, from 12.1 s on``; empty if there is none."""
    span = np.diff(times)
    count = int(np.count_nonzero(span > least))
    if not count:
        return ""
    k = int(np.argmax(span))
    return f"{count} gap(s) of more than {least:g} s, the longest {span[k]:.1f} s, from {times[k]:.1f} s on"

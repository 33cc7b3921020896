"""Are the readings metres?  A check of a log in which no beam came back."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array

NOTHING = 0.95
"""Share of beams without a return from which on the unit is asked for."""
TYPICAL = 6.0
"""Metres: how far the farther walls of rooms and corridors are; nearest to it, in powers, lies the unit."""
UNITS = {"millimetres": 1e-3, "centimetres": 1e-2}
SURE = 1.6
"""Factor between the two units' distances from :data:`TYPICAL` below which both are named."""


def unit_note(ranges: Array, max_range: float) -> str | None:
    """A sentence where nearly every beam counts as no return, with the likely reason; else None.

    Parameters
    ----------
    ranges : ndarray, shape (N, B)
        As they stand in the file.
    max_range : float
        From where on a reading means that nothing came back.

    Notes
    -----
    What a scanner writes for "nothing" is one number, again and again; walls give many.  Of the readings that
    are not the largest one, the 95th percentile is read as millimetres and as centimetres, and the unit in
    which it is nearer to 6 m, by its logarithm, is named: beyond 1.9 m as millimetres, that is 19 m as
    centimetres, it is millimetres.  Between 1.2 and 3 m it may be either, and both are.
    """
    said = ranges[ranges > 0]  # neither nan nor what is no reading
    if not len(said) or np.mean(said >= max_range) < NOTHING:
        return None
    share = float(np.mean(said >= max_range))
    head = f"nothing came back of {share:.0%} of the beams (readings of {max_range:g} m and more)"
    far = said[np.isfinite(said) & (said >= max_range)]
    walls = far[far < far.max()] if len(far) else far
    if len(np.unique(walls)) < 5 or len(walls) < 0.05 * len(far):
        return f"{head}: the map shows no walls"
    usual = float(np.quantile(walls, 0.95))
    off = {name: abs(np.log(usual * factor / TYPICAL)) for name, factor in UNITS.items()}
    best, other = sorted(off, key=off.__getitem__)
    if off[best] > np.log(20):
        return (
            f"{head}: the readings, {usual:.4g} and less, are no metres, millimetres or centimetres of a room"
        )
    name = best if off[other] - off[best] > np.log(SURE) else f"{best}, or {other}"
    metres = usual * UNITS[best]
    return (
        f"{head}: the readings are likely {name} ({usual:.4g} would be {metres:.3g} m); CARMEN's are metres"
    )

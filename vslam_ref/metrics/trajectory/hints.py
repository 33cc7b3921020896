"""What a reader of a comparison should know about the times: words that one can act on.

Some poses found no partner: how many, why, and how much of the truth is covered.  Hardly any did: the unit of
time, or the offset, with which the two would meet.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.metrics.trajectory.association import Pairs, associate
from vslam_ref.metrics.trajectory.ate import LEAST_PAIRS
from vslam_ref.metrics.trajectory.clocks import AS_GOOD, UNIT_NAMES, Meeting, meeting, shape_misfit
from vslam_ref.metrics.trajectory.partners import left_out, median_step, percent, reasons, rounded_up
from vslam_ref.metrics.trajectory.poses import Trajectory

WORTH_ASKING = 0.05
"""Share of poses left out from which another clock is looked for."""
BETTER = 0.25
"""Another clock is named beside pairs only if it leaves this share of their misfit, or doubles the pairs."""
SHORTEST, LONGEST = 2e-3, 5.0
"""Seconds from a pose to the next, of a recorder and of keyframes: so a unit is told by the steps."""
COVERED = 0.5
"""Share of the truth's time below which it is said that the estimate covers a part only."""


def pairing_notes(
    estimate: Trajectory, truth: Trajectory, pairs: Pairs, max_difference: float, offset: float = 0.0
) -> list[str]:
    """Tell how many poses found no partner, and why; nothing where there is nothing to tell.

    Parameters
    ----------
    estimate, truth : Trajectory
        The estimate's times with the offset.
    pairs : Pairs
        Three or more.
    max_difference : float
        Seconds that were allowed.
    offset : float
        Seconds that were added to the estimate's times.

    Returns
    -------
    list of str
        A sentence each.
    """
    if estimate.times is None or truth.times is None:
        return []
    out = left_out(estimate.times, truth.times, pairs, max_difference)
    told = []
    if out.total:
        share = f"{out.total} of {out.poses} poses of the estimate ({percent(out.total, out.poses)})"
        what = f"{share} have no true pose within {max_difference:g} s and are left out"
        told.append(f"{what}: {'; '.join(reasons(out, max_difference))}")
    if out.total > WORTH_ASKING * out.poses:
        other = meeting(estimate, truth, max_difference)
        if other is not None and _is_better(other, estimate, truth, pairs):
            return [*told, f"{words(other, offset)}; compare the errors with and without"]
    if out.covered < COVERED:
        covered = percent(out.covered, 1)
        told.append(f"the estimate covers {covered} of the truth's time: the errors are those of this part")
    return told


def _is_better(other: Meeting, estimate: Trajectory, truth: Trajectory, pairs: Pairs) -> bool:
    """Whether another clock explains far more than the pairs at hand."""
    if (other.factor, other.offset) == (1.0, 0.0) or other.pairs < len(pairs.truth):
        return False
    misfit = shape_misfit(estimate, truth, pairs)
    if misfit <= AS_GOOD:  # the pairs have the right shape: on laps another offset has it, too
        return False
    return other.misfit <= BETTER * misfit or (other.pairs >= 2 * len(pairs.truth) and other.misfit <= misfit)


def no_pairs(
    estimate: Trajectory,
    truth: Trajectory,
    pairs: Pairs,
    max_difference: float,
    offset: float = 0.0,
    *,
    options: bool = True,
) -> str:
    """Say why there are too few pairs, and the unit or the offset that would give more.

    Parameters
    ----------
    estimate, truth : Trajectory
        The estimate's times with the offset.
    pairs : Pairs
        Fewer than three.
    max_difference : float
        Seconds that were allowed.
    offset : float
        Seconds that were added to the estimate's times.
    options : bool
        Whether the reader can give ``--offset`` and ``--max-difference``.
    """
    assert estimate.times is not None
    assert truth.times is not None
    times = (estimate.times, truth.times)
    spans = [f"{t[0]:.3f} to {t[-1]:.3f} s" for t in times]
    count = "1 pair" if len(pairs.truth) == 1 else f"{len(pairs.truth)} pairs"
    found = f"{count} of poses within {max_difference:g} s: need {LEAST_PAIRS}"
    why = _why(estimate, truth, max_difference, offset, options)
    return f"{found}; estimate {spans[0]}, truth {spans[1]}: {why}"


def _why(estimate: Trajectory, truth: Trajectory, max_difference: float, offset: float, options: bool) -> str:
    for name, path in (("estimate", estimate), ("truth", truth)):
        assert path.times is not None
        different = len(np.unique(path.times))
        if different < LEAST_PAIRS and len(path) >= LEAST_PAIRS:
            what = f"the {len(path)} poses of the {name} have no more than {different} different times"
            return f"{what}: were these written with too few digits?"
        if different < LEAST_PAIRS:
            return f"the {name} has too few poses"
    assert estimate.times is not None
    assert truth.times is not None
    other = meeting(estimate, truth, max_difference)
    if other is not None:
        told = words(other, offset, options=options)
        if options and other.factor == 1 and abs(other.offset) <= median_step(truth.times):
            told += f"; or, if the clocks are right, --max-difference {rounded_up(abs(other.offset))}"
        return told
    if (unit := _unit_of_both(estimate.times, truth.times, max_difference)) is not None:
        return f"the times of both look like {UNIT_NAMES[unit]}: divide both by {unit:.0f}"
    return "no unit of time and no offset was found that makes them meet: are they of the same recording?"


def _unit_of_both(estimate: Array, truth: Array, max_difference: float) -> float | None:
    """How many to a second the times of both are, if it is not one and they then meet."""
    for unit in UNIT_NAMES:
        steps = (median_step(np.unique(times)) / unit for times in (estimate, truth))
        if all(SHORTEST <= step <= LONGEST for step in steps):
            pairs = associate(estimate / unit, truth / unit, max_difference)
            return unit if len(pairs.truth) >= LEAST_PAIRS else None
    return None


def words(other: Meeting, offset: float = 0.0, *, options: bool = True) -> str:
    """Name the unit, the offset, and what they would give.

    Parameters
    ----------
    other : Meeting
    offset : float
        Seconds that were added to the estimate's times already.
    options : bool
        Whether the reader can give ``--offset``.
    """
    gain = f"{other.pairs} of {other.poses} poses of the estimate find a true one"
    seconds = _short(offset + other.offset)
    moved = f"with --offset {seconds}" if options else f"with {seconds} s added to its times"
    if other.factor != 1:
        which, factor = ("estimate", 1 / other.factor) if other.factor < 1 else ("truth", other.factor)
        told = (
            f"the times of the {which} look like {UNIT_NAMES[float(round(factor))]}: divided by {factor:.0f}"
        )
        return f"{told}{'' if other.offset == 0 else f', and {moved}'}, {gain}"
    size, way = abs(other.offset), "behind" if other.offset > 0 else "ahead of"
    return f"the estimate's clock seems {_short(size)} s{_hours(size)} {way} the truth's: {moved}, {gain}"


def _short(seconds: float) -> str:
    """Seconds with up to six decimals, without zeros at the end."""
    return f"{seconds:.6f}".rstrip("0").rstrip(".")


def _hours(seconds: float) -> str:
    """Whole half hours in hours, as clocks of two zones differ."""
    return f" ({seconds / 3600:g} h)" if seconds >= 1800 and seconds % 1800 == 0 and seconds < 1e5 else ""

"""Which poses found no partner, and the likely reason, in words that a reader of the numbers can act on.

=============================  =========================================================================
what is seen                   what is said
=============================  =========================================================================
before the truth, after it     the two overlap in part
poses closer than the true     the rates differ: each true pose is used once
between true poses             how far the nearest is; the ``--max-difference`` that would pair them
far from a lonely true pose    the truth has gaps
few pairs, or none             the unit of time, or the offset, with which they would meet
=============================  =========================================================================
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.metrics.trajectory.association import Pairs
from vslam_ref.metrics.trajectory.ate import LEAST_PAIRS
from vslam_ref.metrics.trajectory.clocks import UNIT_NAMES, Meeting, meeting, nearest, shape_misfit
from vslam_ref.metrics.trajectory.poses import Trajectory

WORTH_ASKING = 0.05
"""Share of poses left out from which another clock is looked for."""
BETTER = 0.25
"""Another clock is named beside pairs only if it leaves this share of their misfit, or doubles the pairs."""
RATE = 0.75
"""The estimate's steps are this share of the truth's, or less: then the rates differ."""
COVERED = 0.5
"""Share of the truth's time below which it is said that the estimate covers a part only."""


class LeftOut(NamedTuple):
    """Poses of an estimate without a partner, by the reason; of poses with equal times the first counts.

    Attributes
    ----------
    poses : int
        Of the estimate, with different times.
    before, after : int
        Earlier than the first true pose, later than the last.
    between : int
        Farther from the nearest true pose than allowed.
    shared : int
        Their true pose has gone to a nearer one.
    distance : float
        Seconds from those between to the nearest true pose: the median; 0 where there is none.
    farthest : float
        Seconds, the largest of these.
    step, true_step : float
        Seconds from a pose to the next: the medians.
    covered : float
        Share of the truth's time that the estimate covers.
    """

    poses: int
    before: int
    after: int
    between: int
    shared: int
    distance: float
    farthest: float
    step: float
    true_step: float
    covered: float

    @property
    def total(self) -> int:
        """All of them."""
        return self.before + self.after + self.between + self.shared


def left_out(estimate: ArrayLike, truth: ArrayLike, pairs: Pairs, max_difference: float) -> LeftOut:
    """Sort the poses without a partner by the reason.

    Parameters
    ----------
    estimate, truth : array_like, shapes (N,), (K,)
        Seconds, not falling.
    pairs : Pairs
        As :func:`.associate` found them.
    max_difference : float
        Seconds that were allowed.

    Examples
    --------
    >>> from vslam_ref.metrics.trajectory.association import associate
    >>> mine, true = [0.0, 1.0, 2.0, 3.0], [1.0, 2.2, 2.5]
    >>> left_out(mine, true, associate(mine, true, 0.1), 0.1)[:5]
    (4, 1, 1, 1, 0)
    """
    a, b = np.unique(np.asarray(estimate, float)), np.unique(np.asarray(truth, float))
    out = a[~np.isin(a, np.asarray(estimate, float)[pairs.estimate])]
    before, after = out < b[0] - max_difference, out > b[-1] + max_difference
    distance = np.abs(nearest(b, out) - out)
    between = ~before & ~after & (distance > max_difference)
    shared = ~before & ~after & ~between
    some = distance[between]
    overlap = min(a[-1], b[-1]) - max(a[0], b[0])
    return LeftOut(
        len(a),
        int(before.sum()),
        int(after.sum()),
        int(between.sum()),
        int(shared.sum()),
        float(np.median(some)) if len(some) else 0.0,
        float(some.max()) if len(some) else 0.0,
        _median_step(a),
        _median_step(b),
        float(max(overlap, 0.0) / (b[-1] - b[0])) if b[-1] > b[0] else 1.0,
    )


def _median_step(times: Array) -> float:
    return float(np.median(np.diff(times))) if len(times) > 1 else 0.0


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
            told.append(f"{words(other, offset)}; compare the errors with and without")
    if out.covered < COVERED:
        covered = percent(out.covered, 1)
        told.append(f"the estimate covers {covered} of the truth's time: the errors are those of this part")
    return told


def _is_better(other: Meeting, estimate: Trajectory, truth: Trajectory, pairs: Pairs) -> bool:
    """Whether another clock explains far more than the pairs at hand."""
    if (other.factor, other.offset) == (1.0, 0.0) or other.pairs < len(pairs.truth):
        return False
    misfit = shape_misfit(estimate, truth, pairs)
    return other.misfit <= BETTER * misfit or (other.pairs >= 2 * len(pairs.truth) and other.misfit <= misfit)


def percent(part: float, whole: float) -> str:
    """A share in per cent; never 0 or 100 where it is not.

    Examples
    --------
    >>> percent(1, 3), percent(3, 788), percent(1, 90000), percent(9999, 10000)
    ('33 %', '0.4 %', 'below 0.1 %', 'over 99.9 %')
    """
    share = 100 * part / whole
    if 0 < share < 0.1:
        return "below 0.1 %"
    if 99.9 < share < 100:
        return "over 99.9 %"
    return f"{share:.1f} %" if share < 1 or share > 99 else f"{share:.0f} %"


def reasons(out: LeftOut, max_difference: float) -> list[str]:
    """Why poses found no partner, the commonest reason last.

    Parameters
    ----------
    out : LeftOut
    max_difference : float
        Seconds that were allowed.
    """
    told = [f"{out.before} before the truth begins"] * (out.before > 0)
    told += [f"{out.after} after it ends" if told else f"{out.after} after the truth ends"] * (out.after > 0)
    if not out.between + out.shared:
        return told
    if out.step <= RATE * out.true_step:
        rates = f"one every {out.step:.3g} s, the truth one every {out.true_step:.3g} s"
        why = f"as the estimate has more poses ({rates}) and each true one is used once"
        return [*told, f"{out.between + out.shared} {why}"]
    if out.shared:
        told.append(f"{out.shared} whose true pose has a nearer partner")
    if out.between and out.distance > max(out.true_step, max_difference):
        told.append(f"{out.between} in gaps of the truth, up to {out.farthest:.3g} s from its nearest pose")
    elif out.between:
        limit = f"--max-difference {_rounded_up(out.farthest)}"
        told.append(
            f"{out.between} between true poses, {out.distance:.3g} s from the nearest in the median "
            f"({limit} would allow that)"
        )
    return told


def _rounded_up(seconds: float) -> str:
    """A limit of two digits that lets a difference pass."""
    size = 10.0 ** np.floor(np.log10(seconds)) / 10
    return f"{np.ceil(seconds * (1 + 1e-6) / size) * size:.2g}"


def no_pairs(
    estimate: Trajectory, truth: Trajectory, pairs: Pairs, max_difference: float, offset: float = 0.0
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
    """
    assert estimate.times is not None
    assert truth.times is not None
    times = (estimate.times, truth.times)
    spans = [f"{t[0]:.3f} to {t[-1]:.3f} s" for t in times]
    count = "1 pair" if len(pairs.truth) == 1 else f"{len(pairs.truth)} pairs"
    found = f"{count} of poses within {max_difference:g} s: need {LEAST_PAIRS}"
    return f"{found}; estimate {spans[0]}, truth {spans[1]}: {_why(estimate, truth, max_difference, offset)}"


def _why(estimate: Trajectory, truth: Trajectory, max_difference: float, offset: float) -> str:
    for name, path in (("estimate", estimate), ("truth", truth)):
        assert path.times is not None
        different = len(np.unique(path.times))
        if different < LEAST_PAIRS and len(path) >= LEAST_PAIRS:
            what = f"the {len(path)} poses of the {name} have no more than {different} different times"
            return f"{what}: were these written with too few digits?"
        if different < LEAST_PAIRS:
            return f"the {name} has too few poses"
    assert truth.times is not None
    other = meeting(estimate, truth, max_difference)
    if other is not None:
        told = words(other, offset)
        if other.factor == 1 and abs(other.offset) <= _median_step(truth.times):
            told += f"; or, if the clocks are right, --max-difference {_rounded_up(abs(other.offset))}"
        return told
    return "no unit of time and no offset was found that makes them meet: are they of the same recording?"


def words(other: Meeting, offset: float = 0.0) -> str:
    """Name the unit, the offset, and what they would give.

    Parameters
    ----------
    other : Meeting
    offset : float
        Seconds that were added to the estimate's times already.
    """
    gain = f"{other.pairs} of {other.poses} poses of the estimate find a true one"
    if other.factor != 1:
        which, factor = ("estimate", 1 / other.factor) if other.factor < 1 else ("truth", other.factor)
        told = (
            f"the times of the {which} look like {UNIT_NAMES[float(round(factor))]}: divided by {factor:.0f}"
        )
        return f"{told}{'' if other.offset == 0 else f', and with --offset {_short(other.offset)}'}, {gain}"
    size, way = abs(other.offset), "behind" if other.offset > 0 else "ahead of"
    clock = f"the estimate's clock seems {_short(size)} s{_hours(size)} {way} the truth's"
    return f"{clock}: with --offset {_short(offset + other.offset)}, {gain}"


def _short(seconds: float) -> str:
    """Seconds with up to six decimals, without zeros at the end."""
    return f"{seconds:.6f}".rstrip("0").rstrip(".")


def _hours(seconds: float) -> str:
    """Whole half hours in hours, as clocks of two zones differ."""
    return f" ({seconds / 3600:g} h)" if seconds >= 1800 and seconds % 1800 == 0 and seconds < 1e5 else ""

"""Which poses found no partner, and the likely reason.

=============================  =========================================================================
what is seen                   what is said
=============================  =========================================================================
before the truth, after it     the two overlap in part
poses closer than the true     the rates differ: each true pose is used once
between true poses             how far the nearest is; the ``--max-difference`` that would pair them
far from any true pose         the truth has gaps
=============================  =========================================================================
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.metrics.trajectory.association import Pairs
from vslam_ref.metrics.trajectory.clocks import nearest

RATE = 0.75
"""The estimate's steps are this share of the truth's, or less: then the rates differ."""


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
        In seconds, not falling.
    pairs : Pairs
        As :func:`.associate` found them.
    max_difference : float
        The seconds that were allowed.

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
        median_step(a),
        median_step(b),
        float(max(overlap, 0.0) / (b[-1] - b[0])) if b[-1] > b[0] else 1.0,
    )


def median_step(times: Array) -> float:
    """Return the median time from one to the next, seconds; 0 for one alone.

    Parameters
    ----------
    times : ndarray, shape (N,)
        Seconds.
    """
    return float(np.median(np.diff(times))) if len(times) > 1 else 0.0


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
    return f"{share:.1f} %" if 0 < share < 1 or 99 < share < 100 else f"{share:.0f} %"


def reasons(out: LeftOut, max_difference: float, *, who: str = "estimate", options: bool = True) -> list[str]:
    """Why poses found no partner.

    Parameters
    ----------
    out : LeftOut
    max_difference : float
        The seconds that were allowed.
    who : str
        What the estimate is called.
    options : bool
        Whether the reader can give ``--max-difference``.
    """
    told = [f"{out.before} before the truth begins"] * (out.before > 0)
    told += [f"{out.after} after it ends" if told else f"{out.after} after the truth ends"] * (out.after > 0)
    if not out.between + out.shared:
        return told
    if out.step <= RATE * out.true_step:
        rates = f"one every {out.step:.3g} s, the truth one every {out.true_step:.3g} s"
        why = f"as the {who} has more poses ({rates}) and each true one is used once"
        return [*told, f"{out.between + out.shared} {why}"]
    if out.shared:
        told.append(f"{out.shared} whose true pose has a nearer partner")
    if out.between and out.distance > max(out.true_step, max_difference):
        told.append(f"{out.between} in gaps of the truth, up to {out.farthest:.3g} s from its nearest pose")
    elif out.between:
        limit = f" (--max-difference {rounded_up(out.farthest)} would allow that)" if options else ""
        told.append(
            f"{out.between} between true poses, {out.distance:.3g} s from the nearest in the median{limit}"
        )
    return told


def rounded_up(seconds: float) -> str:
    """Return a limit of two digits that lets a difference in seconds pass.

    Examples
    --------
    >>> rounded_up(0.0301), rounded_up(0.05)
    ('0.031', '0.051')
    """
    size = 10.0 ** np.floor(np.log10(seconds)) / 10
    return f"{np.ceil(seconds * (1 + 1e-6) / size) * size:.2g}"

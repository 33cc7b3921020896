"""One estimate against one truth: pairs, absolute error, relative error; metres, radians, seconds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vslam_ref.metrics.trajectory.association import MAX_DIFFERENCE, Pairs, associate
from vslam_ref.metrics.trajectory.ate import LEAST_PAIRS, AbsoluteError, absolute_error
from vslam_ref.metrics.trajectory.hints import no_pairs
from vslam_ref.metrics.trajectory.poses import Trajectory
from vslam_ref.metrics.trajectory.rpe import RelativeError, relative_error


@dataclass(frozen=True)
class Evaluation:
    """What is known about an estimate.

    Attributes
    ----------
    pairs : Pairs
        Which poses were compared.
    truth : Trajectory
        The true poses of the pairs.
    absolute : AbsoluteError
        With the aligned estimate of the pairs.
    relative : RelativeError
        Of the aligned estimate.
    """

    pairs: Pairs
    truth: Trajectory
    absolute: AbsoluteError
    relative: RelativeError

    def numbers(self) -> dict[str, float]:
        """Return the numbers by name: metres, and degrees where the name says so."""
        ate, moved, turned = (
            self.absolute.stats,
            self.relative.translation_stats,
            self.relative.rotation_stats_deg,
        )
        return {
            "pairs": len(self.truth),
            "ate_rmse": ate.rmse,
            "ate_mean": ate.mean,
            "ate_median": ate.median,
            "ate_max": ate.max,
            "rpe_trans_rmse": moved.rmse,
            "rpe_rot_rmse_deg": turned.rmse,
            "scale": self.absolute.alignment.scale,
        }


def evaluate(
    estimate: Trajectory,
    truth: Trajectory,
    mode: str = "se3",
    *,
    max_difference: float = MAX_DIFFERENCE,
    offset: float = 0.0,
    frames: int = 1,
) -> Evaluation:
    """Pair, align and compare two trajectories.

    Parameters
    ----------
    estimate, truth : Trajectory
        With times, paired by :func:`associate`; without, pose by pose.
    mode : {"none", "se3", "sim3"}
        What the alignment may change, see :func:`absolute_error`.
    max_difference : float
        Seconds between the two poses of a pair, at most.
    offset : float
        Seconds that are added to the estimate's times first.
    frames : int
        Length of a step of the relative error, in pairs.

    Raises
    ------
    ValueError
        If fewer than 3 poses can be paired, or as :func:`absolute_error` and :func:`relative_error`.

    Examples
    --------
    >>> times = np.arange(4.0)
    >>> path = Trajectory(times, np.eye(4)[:, :3], np.broadcast_to(np.eye(3), (4, 3, 3)))
    >>> evaluate(path.later(2.5), path, "none", offset=-2.5).numbers()["ate_max"]
    0.0
    """
    moved = estimate.later(offset) if offset else estimate
    pairs = pair_up(moved, truth, max_difference, offset)
    paired = truth.take(pairs.truth)
    absolute = absolute_error(moved.take(pairs.estimate), paired, mode)
    return Evaluation(pairs, paired, absolute, relative_error(absolute.aligned, paired, frames))


def pair_up(
    estimate: Trajectory, truth: Trajectory, max_difference: float = MAX_DIFFERENCE, offset: float = 0.0
) -> Pairs:
    """Pair poses by time, or by their place if neither trajectory has times.

    Parameters
    ----------
    estimate, truth : Trajectory
    max_difference : float
        Seconds between the two poses of a pair, at most.
    offset : float
        Seconds that were added to the estimate's times already: for the words of the error.

    Raises
    ------
    ValueError
        If only one has times, the lengths differ where they must not, or fewer than 3 pairs are found; then
        with the unit of time or the offset that would give more, if one is found.
    """
    if (estimate.times is None) != (truth.times is None):
        which = "truth" if estimate.times is not None else "estimate"
        raise ValueError(f"the {which} has no times and the other has: need times in both, or in neither")
    if estimate.times is None or truth.times is None:
        if len(estimate) != len(truth):
            counts = f"{len(estimate)} estimated and {len(truth)} true poses"
            raise ValueError(f"{counts} without times: need equally many, pose by pose")
        every = np.arange(len(truth))
        return Pairs(every, every)
    pairs = associate(estimate.times, truth.times, max_difference)
    if len(pairs.truth) < LEAST_PAIRS:
        raise ValueError(no_pairs(estimate, truth, pairs, max_difference, offset))
    return pairs

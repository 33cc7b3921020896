"""A run of a log beside its truth: errors with and without alignment, and consistency.

SLAM fixes no world frame.  Two ways to put the run's frame into the world are reported:

* *unaligned*: the run's pose at the first moment with truth is put on the true pose.  Nothing later is
  used, so the covariances mean what they say: NEES and 3 sigma bands are taken here.
* *aligned*: the rigid motion of least squared position error over the whole run.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.geometry import se2, so2
from vslam_ref.metrics.alignment import align_rigid, root_mean_square
from vslam_ref.metrics.consistency import nees, pose_error
from vslam_ref.systems.slam_log.log import LogTruth
from vslam_ref.systems.slam_log.runner import LogRun

KEYS = (
    "rmse_position_m",
    "rmse_position_unaligned_m",
    "rmse_heading_rad",
    "landmarks",
    "landmark_rmse_m",
    "nees_mean",
    "rejected",
)
"""What :func:`summary` gives, in this order."""


class Placed(NamedTuple):
    """A trajectory in the world, at the times where there is truth.

    Attributes
    ----------
    T_world_run : ndarray, shape (3,)
    times : ndarray, shape (N,)
    T_world_vehicle : ndarray, shape (N, 3)
        Estimated poses (x, y, theta), metres and radians.
    covs : ndarray, shape (N, 3, 3)
        Their covariances in the world frame.
    truth : ndarray, shape (N, 3)
        True poses, world frame.
    """

    T_world_run: Array
    times: Array
    T_world_vehicle: Array
    covs: Array
    truth: Array

    @property
    def errors(self) -> Array:
        """Truth minus estimate of (x, y, theta), metres and radians, angles wrapped, shape (N, 3)."""
        return pose_error(self.truth, self.T_world_vehicle)

    @property
    def nees(self) -> Array:
        """Normalised estimation error squared of each, shape (N,); 3 degrees of freedom.

        NaN where the covariance is singular: at a start that is certain.
        """
        return nees(self.errors, self.covs).value


def truth_at(truth: LogTruth, times: Array) -> tuple[NDArray[np.bool_], Array]:
    """Interpolate the truth linearly in time.

    Parameters
    ----------
    truth : LogTruth
    times : ndarray, shape (N,)
        Seconds.

    Returns
    -------
    ok : ndarray of bool, shape (N,)
        Where there is truth.
    poses : ndarray, shape (n, 3)
        True T_world_vehicle there, metres and radians.
    """
    after = np.clip(np.searchsorted(truth.times, times), 1, len(truth.times) - 1)
    t0, t1 = truth.times[after - 1], truth.times[after]
    ok = (times >= t0) & (times <= t1) & (t1 - t0 <= truth.max_gap)
    after, share = after[ok], ((times - t0) / (t1 - t0))[ok, None]
    a, b = truth.T_world_vehicle[after - 1], truth.T_world_vehicle[after]
    step = b - a
    step[:, 2] = so2.wrap(np.nan_to_num(step[:, 2]))
    poses = a + share * step
    known = np.isfinite(poses[:, 2])
    poses[known, 2] = so2.wrap(poses[known, 2])
    return ok, poses


def place(run: LogRun, truth: LogTruth, *, aligned: bool) -> Placed | None:
    """Put a run into the world.

    Returns None where the truth does not determine it: no overlap in time, or, unaligned, no true heading.
    """
    ok, true = truth_at(truth, run.times)
    poses, covs = reference_point(run.T_run_vehicle[ok], run.covs[ok], truth.lever)
    if aligned:
        if len(true) < 2:
            return None
        T = align_rigid(poses[:, :2], true[:, :2])
    else:
        if not len(true) or not np.isfinite(true[0, 2]):
            return None
        T = se2.compose(true[0], se2.inverse(poses[0]))
    R = np.eye(3)
    R[:2, :2] = so2.exp(T[2])
    return Placed(T, run.times[ok], se2.compose(T, poses), R @ covs @ R.T, true)


def reference_point(poses: Array, covs: Array, lever: Array) -> tuple[Array, Array]:
    """Poses and covariances of another point of the vehicle.

    Parameters
    ----------
    poses : ndarray, shape (N, 3)
        (x, y, theta), metres and radians, any frame.
    covs : ndarray, shape (N, 3, 3)
    lever : ndarray, shape (2,)
        The point, vehicle frame, metres.

    Returns
    -------
    poses : ndarray, shape (N, 3)
        In the same frame.
    covs : ndarray, shape (N, 3, 3)
    """
    arm = so2.rotate(poses[:, 2], np.broadcast_to(lever, (len(poses), 2)))
    J = np.tile(np.eye(3), (len(poses), 1, 1))
    J[:, 0, 2], J[:, 1, 2] = -arm[:, 1], arm[:, 0]
    moved = np.column_stack([poses[:, :2] + arm, poses[:, 2]])
    return moved, J @ covs @ J.swapaxes(1, 2)


def errors_while_blind(run: LogRun, truth: LogTruth, after: float = 5.0) -> dict[str, float | None]:
    """Errors while landmarks are in sight, and more than ``after`` seconds behind the last sighting.

    Returns
    -------
    dict
        ``share`` of blind records; ``rmse_position_seeing_m`` and ``rmse_position_blind_m``, one alignment.
    """
    result: dict[str, float | None] = dict.fromkeys(
        ("share", "rmse_position_seeing_m", "rmse_position_blind_m")
    )
    placed = place(run, truth, aligned=True)
    seen = run.seen.times[run.seen.accepted]
    if placed is None or not len(seen):
        return result
    last = np.searchsorted(seen, placed.times, side="right") - 1
    since = np.where(last >= 0, placed.times - seen[np.maximum(last, 0)], np.inf)
    blind, errors = since > after, placed.errors[:, :2]
    result["share"] = float(np.mean(blind))
    for name, chosen in (("rmse_position_seeing_m", ~blind), ("rmse_position_blind_m", blind)):
        result[name] = root_mean_square(errors[chosen]) if chosen.any() else None
    return result


def landmark_errors(run: LogRun, truth: LogTruth, T_world_run: Array) -> Array:
    """Errors of the landmarks that are in both maps: truth minus estimate.

    Parameters
    ----------
    run : LogRun
    truth : LogTruth
    T_world_run : ndarray, shape (3,)
        Motion that puts the run into the world.

    Returns
    -------
    ndarray, shape (m, 2)
        World frame, metres.
    """
    true = dict(zip(truth.ids.tolist(), truth.landmarks, strict=True))
    pairs = [(m, true[i]) for i, m in zip(run.map.ids.tolist(), run.map.mean[0], strict=True) if i in true]
    if not pairs:
        return np.zeros((0, 2))
    mine, theirs = (np.array(side) for side in zip(*pairs, strict=True))
    return np.asarray(theirs - se2.act(T_world_run, mine))


def summary(run: LogRun, truth: LogTruth | None) -> dict[str, float | int | None]:
    """The numbers of :data:`KEYS`; None where there is no truth for one.

    Position and landmark errors are aligned unless the key says otherwise; the heading error is taken
    after the same alignment; NEES is unaligned, and given only where the truth is exact.
    """
    result: dict[str, float | int | None] = dict.fromkeys(KEYS)
    result["landmarks"] = len(run.map.ids)
    result["rejected"] = run.rejected
    if truth is None:
        return result
    aligned, unaligned = place(run, truth, aligned=True), place(run, truth, aligned=False)
    if aligned is not None:
        result["rmse_position_m"] = root_mean_square(aligned.errors[:, :2])
        heading = aligned.errors[:, 2]
        if np.isfinite(heading).any():
            result["rmse_heading_rad"] = root_mean_square(heading[np.isfinite(heading)])
        map_errors = landmark_errors(run, truth, aligned.T_world_run)
        result["landmark_rmse_m"] = root_mean_square(map_errors) if len(map_errors) else None
    if unaligned is not None:
        result["rmse_position_unaligned_m"] = root_mean_square(unaligned.errors[:, :2])
        nees = unaligned.nees
        if truth.exact and np.isfinite(nees).any():
            result["nees_mean"] = float(np.nanmean(nees))
    return result

r"""Absolute trajectory error (ATE): one alignment of the whole, then distances.

Estimate and truth have a world frame each.  S = (s, R, t) brings the estimate into the frame of the truth:

* ``none``: the frames are declared to be one, S = 1;
* ``se3``: the rigid motion with the least sum of squared distances (s = 1);
* ``sim3``: the similarity with the least sum, for a camera that does not know the scale.

The error of pose k is :math:`e_k = \lVert s R\, \hat t_k + t - t_k \rVert`, in metres of the truth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry import so3
from vslam_ref.geometry.alignment import Alignment, align
from vslam_ref.metrics.trajectory.poses import Summary, Trajectory, summary

MODES = ("none", "se3", "sim3")
LEAST_PAIRS = 3
"""Two points fix no rotation in space, and leave no error to speak of."""


@dataclass(frozen=True)
class AbsoluteError:
    """Distances of aligned positions from the true ones.

    Attributes
    ----------
    errors : ndarray, shape (N,)
        Metres, one for each pair.
    stats : Summary
        Of the errors, metres.
    alignment : Alignment
        ``S_truth_estimate``; its ``reason`` says if the points leave a part of it undetermined.
    aligned : Trajectory
        The estimate in the frame of the truth: scaled, turned and moved.
    """

    errors: Array
    stats: Summary
    alignment: Alignment
    aligned: Trajectory


def absolute_error(estimate: Trajectory, truth: Trajectory, mode: str = "se3") -> AbsoluteError:
    """Align paired trajectories and measure the distances.

    Parameters
    ----------
    estimate, truth : Trajectory
        N >= 3 poses each; pose k of one belongs to pose k of the other.
    mode : {"none", "se3", "sim3"}
        What the alignment may change.

    Returns
    -------
    AbsoluteError

    Raises
    ------
    ValueError
        With an unknown mode, different lengths, fewer than 3 pairs, or ``sim3`` where one of the two
        stands still, so that no scale is determined.

    Notes
    -----
    The alignment is fitted to the same errors it is judged by: with few pairs the error is too small.

    Examples
    --------
    >>> line = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [2, 1, 1]])
    >>> path = Trajectory(None, line, np.broadcast_to(np.eye(3), (4, 3, 3)))
    >>> half = Trajectory(None, line / 2 + 7, path.R_world_body)
    >>> found = absolute_error(half, path, "sim3")
    >>> round(found.alignment.scale, 12), bool(found.stats.max < 1e-12)
    (2.0, True)
    """
    if mode not in MODES:
        raise ValueError(f"alignment {mode!r}: need one of {', '.join(MODES)}")
    require_pairs(estimate, truth)
    found = _alignment(estimate.t_world_body, truth.t_world_body, mode)
    aligned = move(found, estimate)
    errors = np.linalg.norm(aligned.t_world_body - truth.t_world_body, axis=1)
    return AbsoluteError(errors, summary(errors), found, aligned)


def pose_logarithms(estimate: Trajectory, truth: Trajectory) -> Array:
    """Logarithms ``Log(T_truth^-1 T_estimate)`` of paired poses, not aligned.

    Returns
    -------
    ndarray, shape (N, 6)
        xi = (rho, phi), metres and radians, in the body's true frame.

    Raises
    ------
    ValueError
        If the numbers of poses differ.

    Notes
    -----
    The root mean square length of these vectors is quoted by some books as one number for the whole pose.  It
    adds squares of metres to squares of radians, so it changes with the unit of length.

    Examples
    --------
    >>> path = Trajectory(None, np.eye(3), np.broadcast_to(np.eye(3), (3, 3, 3)))
    >>> moved = Trajectory(None, np.eye(3) + [0, 0, 2], path.R_world_body)
    >>> pose_logarithms(moved, path)[0].tolist()
    [0.0, 0.0, 2.0, 0.0, 0.0, 0.0]
    """
    require_pairs(estimate, truth, least=1)
    back = np.swapaxes(truth.R_world_body, 1, 2)
    phi = so3.log(back @ estimate.R_world_body)
    t = np.einsum("kij,kj->ki", back, estimate.t_world_body - truth.t_world_body)
    rho = np.einsum("kij,kj->ki", so3.left_jacobian_inverse(phi), t)
    return np.concatenate([rho, phi], axis=1)


def require_pairs(estimate: Trajectory, truth: Trajectory, least: int = LEAST_PAIRS) -> None:
    """Raise ValueError unless both have the same number of poses, and enough."""
    if len(estimate) != len(truth):
        raise ValueError(f"{len(estimate)} estimated and {len(truth)} true poses: need pairs")
    if len(estimate) < least:
        pairs = "1 pair" if len(estimate) == 1 else f"{len(estimate)} pairs"
        raise ValueError(f"{pairs} of poses: need {least} or more")


def move(S: Alignment, path: Trajectory) -> Trajectory:
    """Return ``S T_world_body`` for every pose: the scale changes positions only."""
    turned = S.R_target_source @ path.R_world_body
    return Trajectory(path.times, S.act(path.t_world_body), turned)


def _alignment(source: Array, target: Array, mode: str) -> Alignment:
    if mode == "none":
        rmse = float(np.sqrt(np.mean(np.sum((source - target) ** 2, axis=1))))
        return Alignment(1.0, np.eye(3), np.zeros(3), rmse, "", False)
    found = align(source, target, with_scale=mode == "sim3")
    if mode == "sim3" and not found.scale_known:
        raise ValueError(f"no scale can be found: {found.reason}; align with se3")
    return found

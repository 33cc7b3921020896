r"""Relative pose error (RPE): what each step of the way adds.

From pose k to pose k + n the body truly moves by :math:`\Delta_k = T_k^{-1} T_{k+n}`, and by
:math:`\hat\Delta_k = \hat T_k^{-1} \hat T_{k+n}` in the estimate.  The error of the step is the rest

.. math:: E_k = \Delta_k^{-1} \hat\Delta_k ,

a motion in the frame of the body at the end of the true step.  Its translation is measured in metres, its
rotation by the angle.  A common turn and shift of the whole estimate cancels in E; a scale does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.geometry import so3
from vslam_ref.metrics.trajectory.ate import require_pairs
from vslam_ref.metrics.trajectory.poses import Summary, Trajectory, summary


@dataclass(frozen=True)
class RelativeError:
    """Errors of the steps.

    Attributes
    ----------
    start : ndarray of int, shape (M,)
        Number of the pose at which each step begins; it ends ``frames`` later.
    frames : int
        Length of a step in pairs of poses.
    translation : ndarray, shape (M,)
        Metres.
    rotation : ndarray, shape (M,)
        Radians, 0 to pi.
    """

    start: IntArray
    frames: int
    translation: Array
    rotation: Array

    @property
    def translation_stats(self) -> Summary:
        """Statistics of the translations, metres."""
        return summary(self.translation)

    @property
    def rotation_stats_deg(self) -> Summary:
        """Statistics of the rotations, **degrees**, as published tables have them."""
        return summary(np.degrees(self.rotation))


def relative_error(
    estimate: Trajectory, truth: Trajectory, frames: int = 1, *, overlapping: bool = True
) -> RelativeError:
    """Measure the errors of the steps between paired poses.

    Parameters
    ----------
    estimate, truth : Trajectory
        N poses each; pose k of one belongs to pose k of the other.  In metres of the truth: align the
        estimate first if its scale is free.
    frames : int
        Length n >= 1 of a step, counted in pairs: where pairs are missing a step takes longer.
    overlapping : bool
        Steps from every pose (0 to n, 1 to n + 1, ...), else end to end (0 to n, n to 2 n, ...).
        For n = 1 both are the same steps.

    Returns
    -------
    RelativeError

    Raises
    ------
    ValueError
        With fewer than 3 pairs, different lengths, or no step of that length.

    Examples
    --------
    >>> path = Trajectory(None, np.arange(12.0).reshape(4, 3), np.broadcast_to(np.eye(3), (4, 3, 3)))
    >>> twice = Trajectory(None, 2 * path.t_world_body, path.R_world_body)
    >>> bool(np.allclose(relative_error(twice, path).translation, np.sqrt(27)))
    True
    """
    require_pairs(estimate, truth)
    if not 1 <= frames < len(truth):
        raise ValueError(f"steps of {frames} frames in {len(truth)} pairs: need 1 to {len(truth) - 1}")
    start = np.arange(0, len(truth) - frames, 1 if overlapping else frames)
    R_hat, t_hat = _steps(estimate, start, frames)
    R, t = _steps(truth, start, frames)
    R_error = np.swapaxes(R, 1, 2) @ R_hat
    # the translation of E is R^T (t_hat - t); a rotation does not change its length
    return RelativeError(start, frames, np.linalg.norm(t_hat - t, axis=1), rotation_angle(R_error))


def _steps(path: Trajectory, start: IntArray, frames: int) -> tuple[Array, Array]:
    """Rotations (M, 3, 3) and translations (M, 3) of ``T_k^-1 T_{k+n}``."""
    back = np.swapaxes(path.R_world_body[start], 1, 2)
    moved = path.t_world_body[start + frames] - path.t_world_body[start]
    return back @ path.R_world_body[start + frames], np.einsum("kij,kj->ki", back, moved)


def rotation_angle(R: ArrayLike) -> Array:
    """Angle of rotation matrices, shape (..., 3, 3) -> (...), radians, 0 to pi.

    Notes
    -----
    The length of the logarithm, whose error is a few eps everywhere.  An arccos of the trace cannot see
    angles below 1e-8, the square root of eps.

    Examples
    --------
    >>> float(rotation_angle([[1, -1e-12, 0], [1e-12, 1, 0], [0, 0, 1]]))
    1e-12
    """
    return np.asarray(np.linalg.norm(so3.log(R), axis=-1))

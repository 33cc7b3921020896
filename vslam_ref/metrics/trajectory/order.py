r"""Whether the four numbers of a quaternion were read in the wrong order: w last that is first, or w first.

Neither lengths nor positions show it.  Reading :math:`(x, y, z, w)` as :math:`(w, x, y, z)` is a permutation
of the four, which keeps lengths and the angle from each pose to the next.  What it breaks is the tie between
rotations and world: with the rotation :math:`R_A` that lays the estimated positions over the true ones,

.. math:: X_k = R_k^T R_A \hat R_k

is the same for every pose k of a right file: 1, or how one body (a camera) is turned in the other (an IMU).
In the wrong order it changes as much as the body turns.  How much the :math:`X_k` differ is told by the
largest eigenvalue of the mean of :math:`x_k x_k^T`, with their quaternions :math:`x_k`: it is the mean of
:math:`\cos^2(\theta_k/2)` over the angles from the best common rotation, so that

.. math:: e = 2 \arcsin \sqrt{1 - \lambda_\text{max}}

is, for small angles, their root mean square.  It is measured as the numbers were read and in the other order.
The other order is likely where e as read is a fifth or more of what the body turns (e of its own rotations),
at most a quarter of it is left, and inverse rotations (world in body) do not explain it better.  The errors
of a bad estimate have nothing in common with the permutation: they stay as large in either order.  Positions
that do not fit give no :math:`R_A` to rely on; then nothing is said.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry import quaternion
from vslam_ref.geometry.alignment import align
from vslam_ref.metrics.trajectory.poses import Trajectory

SHARE_OF_TURN, SHARE_OF_ERROR = 0.2, 0.25
LEAST_TURN = np.radians(1.0)
"""A body that turns less says nothing."""
LEAST_POSES = 5
MISFIT = 0.3
"""Largest error of the aligned positions, as a share of the spread of the true ones."""


class Order(NamedTuple):
    """What the order of quaternions' numbers was judged by; radians.

    Attributes
    ----------
    read, other : float
        How much the body's turn between the two differs from pose to pose: as read, and in the other order.
    turn : float
        How much the body turns.
    likely : bool
        Whether the other order is the likely one.
    """

    read: float
    other: float
    turn: float
    likely: bool


def judge_order(
    estimate: Trajectory, truth: Trajectory, w_first: tuple[bool | None, bool | None]
) -> Order | None:
    """Judge whether the quaternions of one or both were read in the wrong order.

    Parameters
    ----------
    estimate, truth : Trajectory
        N poses each; pose k of one belongs to pose k of the other.
    w_first : (bool or None, bool or None)
        For each of the two: whether the first of four numbers was read as w, if its order is in question;
        None if it is not.

    Returns
    -------
    Order or None
        None where the positions fix no rotation or do not fit, the body hardly turns, or there are fewer than
        5 poses.
    """
    if len(truth) < LEAST_POSES:
        return None
    found = align(estimate.t_world_body, truth.t_world_body, with_scale=True)
    as_read = (estimate.R_world_body, truth.R_world_body)
    R, R_true = (
        R if first is None else other_order(R, first) for R, first in zip(as_read, w_first, strict=True)
    )
    turn = max(spread(R), spread(R_true))
    size = float(np.sqrt(truth.t_world_body.var(axis=0).sum()))
    if found.reason or turn < LEAST_TURN or found.rmse > MISFIT * size:
        return None
    A = found.R_target_source
    read, other = (_differ(A, *rotations) for rotations in (as_read, (R, R_true)))
    inverse = min(_differ(A, _inverse(as_read[0]), as_read[1]), _differ(A, as_read[0], _inverse(as_read[1])))
    left = min(SHARE_OF_ERROR * read, inverse)
    return Order(read, other, turn, read >= SHARE_OF_TURN * turn and other <= left)


def _differ(A: Array, R: Array, R_true: Array) -> float:
    return spread(_inverse(R_true) @ A @ R)


def _inverse(R: Array) -> Array:
    return np.swapaxes(R, 1, 2)


def other_order(R: Array, w_first: bool) -> Array:
    """Rotations as they are when the numbers of their quaternions are taken in the other order.

    Parameters
    ----------
    R : ndarray, shape (N, 3, 3)
        As they were read.
    w_first : bool
        Whether the first of the four was read as w.

    Returns
    -------
    ndarray, shape (N, 3, 3)

    Examples
    --------
    >>> half_turn = np.diag([1.0, -1, -1])[None]  # 1 0 0 0, read with w last
    >>> other_order(half_turn, w_first=False)[0].tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    return quaternion.matrix(np.roll(quaternion.from_matrix(R), 1 if w_first else -1, axis=1))


def spread(R: Array) -> float:
    """How much rotations differ, as the head of this module has it.

    Parameters
    ----------
    R : ndarray, shape (N, 3, 3)

    Returns
    -------
    float
        Radians: the root mean square angle from the best common rotation, where angles are small.

    Examples
    --------
    >>> two = quaternion.matrix(quaternion.exp([[0.1, 0, 0], [-0.1, 0, 0]]))
    >>> round(spread(two), 12)
    0.1
    """
    q = quaternion.from_matrix(R)
    largest = np.linalg.eigvalsh(q.T @ q / len(q))[-1]
    return float(2 * np.arcsin(np.sqrt(max(0.0, 1.0 - largest))))

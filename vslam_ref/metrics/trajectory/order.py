r"""Whether the four numbers of a quaternion were read in the wrong order: w last that is first, or w first.

Neither lengths nor positions show it.  Reading :math:`(x, y, z, w)` as :math:`(w, x, y, z)` is a permutation
of the four, which keeps lengths *and* the angle of every step from one pose to the next; only its axis is
wrong.  So the error of a step's rotation (RPE) is about as large as the step's rotation itself, and it nearly
vanishes when the numbers are put in the other order.  That is the test, on steps long enough to turn:

.. math:: e = \operatorname{rms}_k \angle\bigl(\Delta_k^T \hat\Delta_k\bigr), \qquad
          e_\text{read} \ge \tfrac12 \operatorname{rms}_k \angle(\Delta_k), \qquad
          e_\text{other} \le \tfrac14\, e_\text{read} .

A bad estimate in the right order does not pass: its errors have nothing in common with the permutation, and
stay as large.  A path that does not turn has no :math:`\angle(\Delta_k)` to compare with.  An estimate of
another body (a camera beside an IMU) turns about other axes by one rotation X; so the test is made once more
with the X that fits each reading best, where the axes of the steps determine it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry import quaternion, so3
from vslam_ref.metrics.trajectory.poses import Trajectory
from vslam_ref.metrics.trajectory.rpe import rotation_angle

SHARE_OF_MOTION, SHARE_OF_ERROR = 0.5, 0.25
ENOUGH_TURN = np.radians(15.0)
"""Steps grow, up to a quarter of the path, until half of them turn by this."""
LEAST_TURN = np.radians(0.5)
"""Where the longest steps turn less, nothing is said."""
LEAST_STEPS = 3
LEAST_TO_FIT = 10
"""Steps from which a rotation of the body may be fitted, too."""


class Order(NamedTuple):
    """What the order of a quaternion's numbers was judged by; radians.

    Attributes
    ----------
    read, other : float
        Root mean square error of the steps' rotations, as they were read and in the other order.
    turn : float
        Root mean square rotation of the true steps.
    likely : bool
        Whether the other order is the likely one.
    fitted : bool
        Whether a rotation of the body was fitted to both.
    """

    read: float
    other: float
    turn: float
    likely: bool
    fitted: bool


def other_order(R: Array, w_first: bool) -> Array:
    """Rotations (N, 3, 3) as they are when the quaternions' numbers are taken in the other order.

    Parameters
    ----------
    R : ndarray, shape (N, 3, 3)
        As they were read.
    w_first : bool
        Whether the first of the four was read as w.

    Examples
    --------
    >>> half_turn = np.diag([1.0, -1, -1])[None]  # 1 0 0 0, read with w last
    >>> other_order(half_turn, w_first=False)[0].tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    return quaternion.matrix(np.roll(quaternion.from_matrix(R), 1 if w_first else -1, axis=1))


def judge_order(suspect: Trajectory, trusted: Trajectory, w_first: bool) -> Order:
    """Judge whether the suspect's quaternions were read in the wrong order.

    Parameters
    ----------
    suspect, trusted : Trajectory
        N poses each; pose k of one belongs to pose k of the other.
    w_first : bool
        Whether the suspect's first of four was read as w.

    Returns
    -------
    Order
    """
    nothing = Order(0.0, 0.0, 0.0, False, False)
    length, turn = _step_length(trusted)
    if turn < LEAST_TURN or len(trusted) - length < LEAST_STEPS:
        return nothing
    true = _steps(trusted.R_world_body, length)
    read = _steps(suspect.R_world_body, length)
    other = _steps(other_order(suspect.R_world_body, w_first), length)
    plain = _verdict(_rms(_between(true, read)), _rms(_between(true, other)), turn, False)
    if plain.likely or len(true) < LEAST_TO_FIT:
        return plain
    fitted = [_fit_error(true, steps) for steps in (read, other)]
    if None in fitted:
        return plain
    a, b = (float(e) for e in fitted if e is not None)
    return _verdict(a, b, turn, True)


def _verdict(read: float, other: float, turn: float, fitted: bool) -> Order:
    likely = read >= SHARE_OF_MOTION * turn and other <= SHARE_OF_ERROR * read
    return Order(read, other, turn, likely, fitted)


def _steps(R: Array, length: int) -> Array:
    """Rotations (N - length, 3, 3) from each pose to the one ``length`` later, in the body's frame."""
    return np.swapaxes(R[:-length], 1, 2) @ R[length:]


def _step_length(path: Trajectory) -> tuple[int, float]:
    """Length of the steps, in poses, and how far they turn."""
    length, turn = 1, 0.0
    while length == 1 or length <= len(path) // 4:
        turn = _rms(rotation_angle(_steps(path.R_world_body, length)))
        if turn >= ENOUGH_TURN:
            return length, turn
        length *= 2
    return length // 2, turn


def _between(a: Array, b: Array) -> Array:
    return rotation_angle(np.swapaxes(a, 1, 2) @ b)


def _rms(angles: Array) -> float:
    return float(np.sqrt(np.mean(angles**2)))


def _fit_error(true: Array, steps: Array) -> float | None:
    """Error that remains after the best turn X of the body, true = X steps X^T; None if X is not unique."""
    mine, theirs = so3.log(steps), so3.log(true)
    U, s, Vt = np.linalg.svd(theirs.T @ mine)
    if s[1] < 0.05 * s[0]:
        return None
    X = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    return _rms(_between(true, X @ steps @ X.T))

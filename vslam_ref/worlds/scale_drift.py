r"""A lap whose scale drifts, with exact truth: what a loop in Sim(3) mends and one in SE(3) does not.

::

         ____                     true: a circle, one lap, looking ahead
       /      \    drifted:       mapped: every step as it was, but its length times drift^(k / n);
      |        |    a spiral      the last keyframe is where the first one is,
       \______/                   and its unit is ``drift`` times as long

All else is exact, so that whatever error is left after the closing is the closing's own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry import se3, sim3, so3

RADIUS = 10.0


class DriftedLap(NamedTuple):
    """A lap as it was and as it was mapped.

    Attributes
    ----------
    true, T_kf_world : ndarray, shape (n + 1, 4, 4)
        T_kf_world in truth, and in the drifted map.
    S_first_last : ndarray, shape (4, 4)
        From the last keyframe's frame and unit to the first one's.
    scale : ndarray, shape (n + 1,)
        Length of each keyframe's unit, as a ratio to the first one's.
    """

    true: Array
    T_kf_world: Array
    S_first_last: Array
    scale: Array


def make_drifted_lap(n: int = 100, drift: float = 1.35, radius: float = RADIUS) -> DriftedLap:
    """Make a lap of n steps whose scale grows to ``drift``, a ratio, on a circle of ``radius`` metres.

    Examples
    --------
    >>> lap = make_drifted_lap(n=8)
    >>> lap.T_kf_world.shape, round(float(sim3.scale(lap.S_first_last)), 4)
    ((9, 4, 4), 0.7407)
    """
    if n < 3 or not drift > 0 or not radius > 0:
        raise ValueError(f"n={n}, drift={drift}, radius={radius}: need n >= 3 and the others above 0")
    angle = 2 * np.pi * np.arange(n + 1) / n
    centre = radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], -1)
    first = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])  # x outwards, y down, z ahead
    poses = se3.from_rt(so3.exp(angle[:, None] * [0.0, 0, 1.0]) @ first, centre)
    scale = drift ** (np.arange(n + 1) / n)
    step = se3.between(poses[:-1], poses[1:])
    step[:, :3, 3] *= scale[:-1, None]
    mapped = [poses[0]]
    for one in step:
        mapped.append(mapped[-1] @ one)
    back = se3.between(poses[0], poses[-1])
    S = sim3.from_srt(1.0 / drift, back[:3, :3], back[:3, 3])
    return DriftedLap(se3.inverse(poses), se3.inverse(np.array(mapped)), S, scale)

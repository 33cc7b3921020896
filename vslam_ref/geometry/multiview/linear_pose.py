"""What a pose by linear equations is, why there may be none, and the check of what is given to find it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array


class PoseState(Enum):
    """What became of a linear resection; the value is the sentence."""

    OK = ""
    TOO_FEW = "too few points"
    ONE_PLACE = "the points lie at one place"
    COLLINEAR = "the points lie on one line: a turn about it changes nothing"
    COPLANAR = "the points lie in one plane: use the planar method"
    NOT_COPLANAR = "the points do not lie in one plane"
    AMBIGUOUS = "the equations have more than one solution"
    BEHIND = "in the best pose a point lies behind the camera"
    NO_ROTATION = "the linear solution is far from any rotation"


@dataclass(frozen=True)
class LinearPose:
    """Pose by linear equations.

    Attributes
    ----------
    T_cam_world : ndarray, shape (4, 4)
        The identity where ``state`` is neither ``OK`` nor ``BEHIND``.
    state : PoseState
    method : str
        ``dlt``, ``planar`` or ``p3p``.
    spread : float
        Ratio of the two smallest singular values, 0 to 1: how close the equations were to a second answer;
        0 for ``p3p``.
    """

    T_cam_world: Array
    state: PoseState
    method: str
    spread: float

    @property
    def ok(self) -> bool:
        """Whether the pose may be used."""
        return self.state is PoseState.OK

    @property
    def reason(self) -> str:
        """Empty, or what is wrong."""
        return self.state.value


def no_pose(state: PoseState, method: str, spread: float = 1.0) -> LinearPose:
    """The answer where there is no pose, with its reason; no unit."""
    return LinearPose(np.eye(4), state, method, spread)


def checked_rays(bearings: ArrayLike, X_world: ArrayLike) -> tuple[Array, Array]:
    """``bearings (N, 3)``, no unit, and ``X_world (N, 3)`` as arrays, or a ValueError that says why not.

    Points in any unit, such as metres.
    """
    b, X = as_array("bearings", bearings, 3), as_array("X_world", X_world, 3)
    if b.ndim != 2 or b.shape != X.shape:
        raise ValueError(f"bearings {b.shape} and X_world {X.shape}: need (N, 3) twice")
    for name, values in (("bearing", b), ("point", X)):
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if len(bad):
            raise ValueError(f"{name} {bad[0]} is {values[bad[0]].tolist()}: must be finite")
    bad = np.flatnonzero(~(np.abs(np.linalg.norm(b, axis=1) - 1.0) < 1e-6))
    if len(bad):
        raise ValueError(f"bearing {bad[0]} is {b[bad[0]].tolist()}: must be a unit vector")
    return b, X

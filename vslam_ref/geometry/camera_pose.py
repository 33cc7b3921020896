"""The pose of a moving camera: centre and rotation, ``T_cam_world``, and where it will be in the next frame.

Two ways to write one pose are in use.  ``T_cam_world`` has the translation ``t_cam_world``: the world's
origin, seen from the camera.  The other has the camera's centre ``p_world``, seen from the world.  They are
the same numbers only for the identity, and with the sign left out.
"""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array, times, transpose
from vslam_ref.geometry import se3


def camera_from_world(R_cam_world: ArrayLike, p_world: ArrayLike, X_world: ArrayLike) -> Array:
    """Coordinates in the camera of world points, by rotation and camera centre: R (X - p).

    Implements :eq:`eq-a1-1` (A1.1).

    Parameters
    ----------
    R_cam_world : array_like, shape (..., 3, 3)
    p_world : array_like, shape (..., 3)
        Camera centre in the world, metres.
    X_world : array_like, shape (..., 3)
        Metres.

    Returns
    -------
    ndarray, shape (..., 3)

    Notes
    -----
    For points far from the world's origin this form is more exact than R X + t: the difference is taken
    first.

    Examples
    --------
    >>> import numpy as np
    >>> camera_from_world(np.eye(3), [0.0, 0.0, -2.0], [1.0, 0.0, 3.0]).tolist()
    [1.0, 0.0, 5.0]
    """
    difference = as_array("X_world", X_world, 3) - as_array("p_world", p_world, 3)
    return times(as_array("R_cam_world", R_cam_world, 3, 3), difference)


def pose_from_centre(R_cam_world: ArrayLike, p_world: ArrayLike) -> Array:
    """``T_cam_world (..., 4, 4)`` from rotation (..., 3, 3) and centre (..., 3), metres: t = -R p.

    Implements :eq:`eq-centre`.
    """
    R = as_array("R_cam_world", R_cam_world, 3, 3)
    return se3.from_rt(R, -times(R, as_array("p_world", p_world, 3)))


def centre_from_pose(T_cam_world: ArrayLike) -> Array:
    """Camera centre in the world, metres, shape (..., 4, 4) -> (..., 3): p = -R^T t, as in T_world_cam.

    >>> import numpy as np
    >>> centre_from_pose(pose_from_centre(np.eye(3), [1.0, 2.0, 3.0])).tolist()
    [1.0, 2.0, 3.0]
    """
    T = as_array("T_cam_world", T_cam_world, 4, 4)
    return -times(transpose(se3.rotation(T)), se3.translation(T))


class DecayingVelocity(NamedTuple):
    """Motion model of a camera in a hand: it goes on as before, but a little less.

    Attributes
    ----------
    velocity : ndarray, shape (..., 6)
        Motion (rho, phi) from one frame to the next, in the camera's frame; metres and radians per frame.
    decay : float
        What is left of the velocity after a frame, in [0, 1].  At 1 it is a constant velocity.
    weight : float
        Share of the newest motion in the new velocity, in (0, 1]; the rest is the old one's.

    Examples
    --------
    >>> import numpy as np
    >>> model = DecayingVelocity(np.array([0.0, 0.0, 0.1, 0.0, 0.0, 0.0]))
    >>> T_next = model.predict(np.eye(4))
    >>> model = model.update(np.eye(4), T_next)  # it came as predicted
    >>> np.round(model.velocity, 12).tolist()
    [0.0, 0.0, 0.09, 0.0, 0.0, 0.0]
    """

    velocity: Array
    decay: float = 0.9
    weight: float = 0.5

    def predict(self, T_cam_world: ArrayLike) -> Array:
        """Pose in the next frame, exp(velocity) T.

        Implements :eq:`eq-a2-5` (A2.5), with the velocity as mu.
        """
        return se3.perturb(T_cam_world, self.velocity)

    def update(self, T_before: ArrayLike, T_now: ArrayLike) -> DecayingVelocity:
        """Model after a frame that led from one pose to another.

        Implements :eq:`eq-decaying-velocity`: decay ((1 - weight) old + weight Log(T_now T_before^-1)).
        Where nothing was measured, call it with the predicted pose: the velocity then dies away by ``decay``.

        Raises
        ------
        ValueError
            If decay or weight lie outside their ranges.
        """
        if not (0.0 <= self.decay <= 1.0 and 0.0 < self.weight <= 1.0):
            raise ValueError(
                f"decay={self.decay}, weight={self.weight}: need 0 <= decay <= 1 and 0 < weight <= 1"
            )
        motion = se3.log_of_motion(se3.compose(T_now, se3.inverse(T_before)))
        blend = (1.0 - self.weight) * self.velocity + self.weight * motion
        return self._replace(velocity=self.decay * blend)

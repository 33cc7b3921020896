"""Vehicle models: how a control turns into a motion of the vehicle.

Every model here is split in two.  A *drive* turns a control into an :class:`Increment`: the signed
distance ds along the vehicle's axis and the turn dalpha, with their covariance.  :func:`propagate`
then moves a pose by an increment::

         y                      the reference point is the middle of the REAR axle;
         |   o theta            ds runs along the heading, then the vehicle turns by dalpha
         |  /                   L = wheelbase: distance of the two axles (the paper's text says
         | P--->                track width, an erratum: B4 needs the distance between the axles)
         +------- x

Filters see increments only, so they work with any drive.  In :func:`front_wheel_step` the speed is
that of the steered front wheel: the model of Bailey's simulator, the other common convention.

Speeds are in m/s, steering angles and headings in radians, turn rates in rad/s, distances in metres.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array
from vslam_ref.geometry import so2


class Increment(NamedTuple):
    """Motion of a vehicle during one time step, for a batch of B runs.

    Attributes
    ----------
    ds : ndarray, shape (B,)
        Signed distance along the heading, metres.
    dalpha : ndarray, shape (B,)
        Turn, radians.
    cov : ndarray, shape (B, 2, 2)
        Covariance of (ds, dalpha), m^2, m rad, rad^2.
    """

    ds: Array
    dalpha: Array
    cov: Array


class DriveJacobians(NamedTuple):
    """Value (..., 2) of (ds, dalpha) and its Jacobian (..., 2, 2) in the control."""

    value: Array
    J_control: Array


def ackermann(control: ArrayLike, wheelbase: float, dt: float) -> Array:
    """(ds, dalpha) of a rear-axle Ackermann vehicle.

    Implements :eq:`eq-b4` (B4): ds = v dt, dalpha = v dt tan(phi) / L.

    Parameters
    ----------
    control : array_like, shape (..., 2)
        Speed v of the rear axle (m/s) and steering angle phi (radians, left positive).
    wheelbase : float
        Distance L between the axles, metres.
    dt : float
        Duration, seconds.

    Returns
    -------
    ndarray, shape (..., 2)
        ds (m) and dalpha (rad).

    Examples
    --------
    >>> ackermann([1.0, 0.0], wheelbase=1.0, dt=0.1)
    array([0.1, 0. ])
    """
    return ackermann_with_jacobians(control, wheelbase, dt).value


def ackermann_with_jacobians(control: ArrayLike, wheelbase: float, dt: float) -> DriveJacobians:
    """:func:`ackermann` and its Jacobian in (v, phi); same parameters."""
    u = np.asarray(control, dtype=np.float64)
    v, phi = u[..., 0], u[..., 1]
    tan = np.tan(phi)
    value = np.stack([v * dt, v * dt * tan / wheelbase], -1)  # eq-increment
    J = np.zeros((*u.shape[:-1], 2, 2))
    J[..., 0, 0] = dt  # eq-jacobian-drive
    J[..., 1, 0] = dt * tan / wheelbase
    J[..., 1, 1] = v * dt * (1.0 + tan * tan) / wheelbase
    return DriveJacobians(value, J)


def ackermann_increment(control: ArrayLike, cov_u: ArrayLike, wheelbase: float, dt: float) -> Increment:
    """Increment of noisy Ackermann controls, its covariance mapped to first order.

    Implements :eq:`eq-increment` and :eq:`eq-jacobian-drive`.

    Parameters
    ----------
    control : array_like, shape (B, 2)
        Measured (v, phi).
    cov_u : array_like, shape (2, 2) or (B, 2, 2)
        Covariance of the control noise, (m/s)^2 and rad^2.
    wheelbase, dt : float
        As in :func:`ackermann`.

    Returns
    -------
    Increment
        ds (m), dalpha (rad) and their covariance.
    """
    value, J = ackermann_with_jacobians(control, wheelbase, dt)
    cov = J @ np.asarray(cov_u, dtype=np.float64) @ np.swapaxes(J, -1, -2)
    return Increment(value[..., 0], value[..., 1], cov)


def differential_increment(control: ArrayLike, cov_u: ArrayLike, dt: float) -> Increment:
    """Increment of a differential drive: ds = v dt and dalpha = omega dt.

    Linear in the control, so that the covariance is dt^2 cov_u exactly.

    Parameters
    ----------
    control : array_like, shape (B, 2)
        Speed v (m/s) and turn rate omega (rad/s).
    cov_u : array_like, shape (2, 2) or (B, 2, 2)
        Covariance of the control noise, (m/s)^2 and (rad/s)^2.
    dt : float
        Duration, seconds.

    Returns
    -------
    Increment
    """
    u = np.asarray(control, dtype=np.float64)
    cov = np.broadcast_to(np.asarray(cov_u, dtype=np.float64) * dt**2, (*u.shape[:-1], 2, 2))
    return Increment(u[..., 0] * dt, u[..., 1] * dt, cov)


class PropagateJacobians(NamedTuple):
    """Moved pose (..., 3), its Jacobian in the pose (..., 3, 3) and in (ds, dalpha) (..., 3, 2)."""

    value: Array
    J_pose: Array
    J_increment: Array


def motion_model(T_world_vehicle: Array, ds: Array, dalpha: Array) -> PropagateJacobians:
    """Move a pose by an increment, first along the old heading, then turn; with F and G.

    Implements :eq:`eq-b4` (B4) and :eq:`eq-jacobians-motion`.  This is the package's one motion model:
    worlds, :func:`propagate` and the filters all call it.  (Numba's twin of the EKF repeats it.)

    Parameters
    ----------
    T_world_vehicle : ndarray, shape (..., 3)
        Pose (x, y, theta), world frame, metres and radians.
    ds, dalpha : ndarray, shapes (...)
        Distance along the heading, metres, and turn, radians.

    Returns
    -------
    PropagateJacobians
        The new pose, its angle in (-pi, pi]; ``J_pose`` is F, ``J_increment`` is G.
    """
    x, y, theta = T_world_vehicle[..., 0], T_world_vehicle[..., 1], T_world_vehicle[..., 2]
    c, s = np.cos(theta), np.sin(theta)
    ahead, left = ds * c, ds * s
    shape = np.shape(x + ahead)
    value, F, G = np.empty((*shape, 3)), np.zeros((*shape, 3, 3)), np.zeros((*shape, 3, 2))
    value[..., 0] = x + ahead  # eq-b4
    value[..., 1] = y + left
    value[..., 2] = so2.wrap(theta + dalpha)
    F[..., 0, 0] = F[..., 1, 1] = F[..., 2, 2] = 1.0  # eq-jacobians-motion
    F[..., 0, 2], F[..., 1, 2] = -left, ahead
    G[..., 0, 0], G[..., 1, 0], G[..., 2, 1] = c, s, 1.0
    return PropagateJacobians(value, F, G)


def propagate(T_world_vehicle: ArrayLike, increment: ArrayLike) -> Array:
    """Move a pose by (ds, dalpha): first along the old heading, then turn.

    Implements :eq:`eq-b4` (B4) together with a drive.

    Parameters
    ----------
    T_world_vehicle : array_like, shape (..., 3)
        Pose (x, y, theta), world frame, metres and radians.
    increment : array_like, shape (..., 2)
        ds (m) and dalpha (rad).

    Returns
    -------
    ndarray, shape (..., 3)
        The new pose, its angle in (-pi, pi].

    Examples
    --------
    >>> propagate([1.0, 2.0, 0.0], [0.5, 0.25])
    array([1.5 , 2.  , 0.25])
    """
    return propagate_with_jacobians(T_world_vehicle, increment).value


def propagate_with_jacobians(T_world_vehicle: ArrayLike, increment: ArrayLike) -> PropagateJacobians:
    """:func:`propagate` and its Jacobians F and G; same parameters."""
    pose, inc = as_array("T_world_vehicle", T_world_vehicle, 3), as_array("increment", increment, 2)
    return motion_model(pose, inc[..., 0], inc[..., 1])


def front_wheel_step(T_world_vehicle: ArrayLike, control: ArrayLike, wheelbase: float, dt: float) -> Array:
    """Move a pose by the front-wheel model of Bailey's simulator, the alternative to B4.

    x += V dt cos(theta + G), y += V dt sin(theta + G), theta += V dt sin(G) / WB: the speed V is that
    of the steered front wheel, and the reference point moves along the wheel, not along the axis.
    The two models agree when the rear axle's speed is V cos(G) and the pose is that of the rear axle;
    yaw = sin(G / WB), seen in some teaching code, is wrong.

    Parameters
    ----------
    T_world_vehicle : array_like, shape (..., 3)
        Pose of the front wheel's contact point, heading of the vehicle's axis.
    control : array_like, shape (..., 2)
        Front wheel speed V (m/s) and steering angle G (rad).
    """
    pose, u = np.asarray(T_world_vehicle, dtype=np.float64), np.asarray(control, dtype=np.float64)
    step, direction = u[..., 0] * dt, pose[..., 2] + u[..., 1]
    turn = step * np.sin(u[..., 1]) / wheelbase
    return np.stack(
        [
            pose[..., 0] + step * np.cos(direction),
            pose[..., 1] + step * np.sin(direction),
            so2.wrap(pose[..., 2] + turn),
        ],
        -1,
    )

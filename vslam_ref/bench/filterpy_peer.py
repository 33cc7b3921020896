"""The peer of the filter benchmarks: filterpy's ExtendedKalmanFilter as a planar EKF-SLAM.

Dense F, Q and H, as its interface asks, given the same state and the same motion as our step.  Three ways:

* ``"users"``: range and bearing, one landmark at a time, models in NumPy with a wrapped residual, as in
  textbooks and in its users' code.  This is the peer of goal EKF-1;
* ``"one at a time"``: our relative Cartesian measurement, models written for speed with plain floats;
* ``"stacked"``: the same with all five landmarks in one measurement: the mathematics of our update.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.worlds.mapped_vehicle import MappedVehicle

WAYS = ("users", "one at a time", "stacked")


def filterpy_step(world: MappedVehicle, way: str) -> Callable[[], object]:
    """One prediction and five landmarks by filterpy, in one of the ``WAYS``."""
    from filterpy.kalman import ExtendedKalmanFilter

    mean, cov = world.start(EkfSlam).blocks.full()
    seen = world.seen.tolist()
    groups = [seen] if way == "stacked" else [[i] for i in seen]
    kalman: Any = ExtendedKalmanFilter(dim_x=mean.shape[1], dim_z=2 * len(groups[0]))
    kalman.x, kalman.P = mean[0].copy(), cov[0].copy()
    predict = _prediction(kalman, world)
    sights: list[tuple[Any, Array]]
    models: dict[str, Callable[..., Array]]
    if way == "users":
        models = {"HJacobian": range_bearing_jacobian, "Hx": range_bearing, "residual": polar_residual}
        kalman.R = np.diag([0.01, 0.001])
        sights = [(i, range_bearing(mean[0], i)) for i in seen]
    else:
        models = {"HJacobian": relative_jacobian, "Hx": relative}
        kalman.R = np.kron(np.eye(len(groups[0])), world.cov_z)
        sights = [(ids, world.z[ids].ravel()) for ids in groups]

    def step() -> None:
        predict()
        for which, z in sights:
            kalman.update(z, **models, args=(which,), hx_args=(which,))

    return step


def _prediction(kalman: Any, world: MappedVehicle) -> Callable[[], None]:
    """Filterpy's prediction by the world's increment."""
    increment, d = world.increment(), len(kalman.x)
    ds, dalpha, cov = increment.ds[0], increment.dalpha[0], increment.cov[0]

    def predict() -> None:
        x = kalman.x.copy()
        c, s = math.cos(x[2]), math.sin(x[2])
        F, Q = np.eye(d), np.zeros((d, d))
        F[0, 2], F[1, 2] = -ds * s, ds * c
        G = np.array([[c, 0.0], [s, 0.0], [0.0, 1.0]])
        Q[:3, :3] = G @ cov @ G.T
        kalman.F, kalman.Q = F, Q
        x[0] += ds * c
        x[1] += ds * s
        x[2] += dalpha
        kalman.predict_x = lambda u=0: setattr(kalman, "x", x)
        kalman.predict()

    return predict


def relative(x: Array, ids: list[int]) -> Array:
    """Landmarks in the vehicle frame, (2 m,), with plain floats."""
    c, s, out = math.cos(x[2]), math.sin(x[2]), []
    for i in ids:
        dx, dy = x[3 + 2 * i] - x[0], x[4 + 2 * i] - x[1]
        out += [c * dx + s * dy, c * dy - s * dx]
    return np.array(out)


def relative_jacobian(x: Array, ids: list[int]) -> Array:
    """Jacobian (2 m, 3 + 2 n) of :func:`relative`."""
    H = np.zeros((2 * len(ids), len(x)))
    c, s = math.cos(x[2]), math.sin(x[2])
    for k, i in enumerate(ids):
        dx, dy = x[3 + 2 * i] - x[0], x[4 + 2 * i] - x[1]
        H[2 * k, :3] = -c, -s, c * dy - s * dx
        H[2 * k + 1, :3] = s, -c, -c * dx - s * dy
        H[2 * k, 3 + 2 * i : 5 + 2 * i] = c, s
        H[2 * k + 1, 3 + 2 * i : 5 + 2 * i] = -s, c
    return H


def range_bearing(x: Array, i: int) -> Array:
    """Range and bearing of landmark i."""
    d = x[3 + 2 * i : 5 + 2 * i] - x[:2]
    return np.array([np.hypot(d[0], d[1]), np.arctan2(d[1], d[0]) - x[2]])


def range_bearing_jacobian(x: Array, i: int) -> Array:
    """Jacobian (2, 3 + 2 n) of :func:`range_bearing`."""
    d = x[3 + 2 * i : 5 + 2 * i] - x[:2]
    q = d @ d
    along = np.array([d / np.sqrt(q), [-d[1] / q, d[0] / q]])
    H = np.zeros((2, len(x)))
    H[:, :2], H[:, 3 + 2 * i : 5 + 2 * i] = -along, along
    H[1, 2] = -1.0
    return H


def polar_residual(a: Array, b: Array) -> Array:
    """A - b with the bearing in [-pi, pi)."""
    y = a - b
    y[1] = (y[1] + np.pi) % (2 * np.pi) - np.pi
    return y

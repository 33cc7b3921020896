"""Chapters 15 and 16: vehicle models and filters."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeVar

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.filters import observation, vehicle
from vslam_ref.filters.block_covariance import Blocks
from vslam_ref.filters.carleman_ekf import LiftedCarlemanEkf, ReducedCarlemanEkf, carleman_ekf, lift, moments
from vslam_ref.filters.carleman_ekf.reduced_moments import start_moments
from vslam_ref.filters.ekf_slam import AnchoredEkf, EkfSlam, IdealEkf, Truth
from vslam_ref.filters.estimates import SlamFilter
from vslam_ref.filters.polar_update import update_polar
from vslam_ref.filters.range_bearing import cartesian_from_polar
from vslam_ref.filters.sigma_points import predict_pose, sigma_points, update_pose
from vslam_ref.geometry import se2
from vslam_ref.grids.landmarks.association import gate

Slam = TypeVar("Slam", bound=SlamFilter)
Steps = list[dict[str, Array]]


# -- chapter 15 ------------------------------------------------------------------------------------


def _slam(x: Array, P: Array) -> EkfSlam:
    """The filter in the middle of a run."""
    slam = EkfSlam(x[:3], P[:3, :3])
    n = (len(x) - 3) // 2
    _fill(slam.blocks, n, x, P)
    return slam


def _fill(blocks: Blocks, n: int, x: Array, P: Array) -> None:
    """Put a mean (p + 2 n,) and a covariance of a whole run into blocks that hold no landmark yet."""
    p = len(x) - 2 * n
    blocks.append(np.arange(n), x[None, p:], np.zeros((1, 2 * n, p)), np.zeros((1, n, 2, 2)))
    blocks.x_p[:], blocks.P_pp[:], blocks.P_pm[:], blocks.P_mm[:] = x[:p], P[:p, :p], P[:p, p:], P[p:, p:]


def _named(names: str, found: tuple[Array, Array]) -> dict[str, Array]:
    """The first run of a mean and a covariance, by two names."""
    return {name: value[0] for name, value in zip(names.split(), found, strict=True)}


def _state(slam: EkfSlam | LiftedCarlemanEkf) -> dict[str, Array]:
    if isinstance(slam, LiftedCarlemanEkf):
        return _named("Z P", slam.state())
    return _named("x P", slam.blocks.full())


def _updated(slam: EkfSlam | LiftedCarlemanEkf, ids: Any, z: Array, cov_z: Array) -> dict[str, Array]:
    slam.update(np.asarray(ids, dtype=int), z.reshape(1, -1, 2), cov_z)
    return _state(slam)


def _predict(
    x: Array, P: Array, control: Array, cov_u: Array, wheelbase: float, dt: float
) -> dict[str, Array]:
    slam = _slam(x, P)
    slam.predict(vehicle.ackermann_increment(control[None], cov_u, wheelbase, dt))
    return _state(slam)


def _predict_additive(
    x: Array, P: Array, control: Array, cov_pose: Array, wheelbase: float, dt: float
) -> dict[str, Array]:
    found = _predict(x, P, control, np.zeros((2, 2)), wheelbase, dt)
    found["P"][:3, :3] += cov_pose
    return found


def _gate(x: Array, P: Array, id: int, z: Array, cov_z: Array) -> Array:
    at = slice(3 + 2 * int(id), 5 + 2 * int(id))
    seen = observation.vehicle_from_world_with_jacobians(x[:3], x[at])
    H = np.zeros((2, len(x)))
    H[:, :3], H[:, at] = seen.J_pose, seen.J_landmark
    return gate(z - seen.value, H @ P @ H.T + cov_z)


def _yaw_rate(x: Array, control: Array, dt: float) -> Array:
    ahead, turn, _ = vehicle.differential_increment(control, np.zeros((2, 2)), dt)
    return vehicle.propagate(x, [ahead, turn])


def _arc(x: Array, control: Array, dt: float) -> Array:
    return se2.compose(x, se2.exp([control[0] * dt, 0.0, control[1] * dt]))


def _from_polar(polar: Array, sigma_range: float, sigma_bearing: float) -> dict[str, Array]:
    z, cov = cartesian_from_polar(polar, sigma_range, sigma_bearing)
    return {"z": z, "cov": cov}


def _drive(slam: Slam, controls: Array, sightings: Any, cov_z: Array, **drive: Any) -> Iterator[Slam]:
    """Feed a filter; yield after every step."""
    for control, seen in zip(controls, sightings, strict=True):
        slam.predict(vehicle.ackermann_increment(control[None], **drive))
        if seen["ids"]:  # without a call predictions are put together, as they are in use
            slam.update(seen["ids"], np.reshape(seen["z"], (1, -1, 2)), cov_z)
        yield slam


def _trace(x: Array, P: Array, **run: Any) -> Steps:
    return [_state(slam) for slam in _drive(EkfSlam(x, P), **run)]


# -- chapter 16 ------------------------------------------------------------------------------------


def _lifted(Z: Array, P: Array, control: str = "first_order") -> LiftedCarlemanEkf:
    """The lifted filter in the middle of a run."""
    return LiftedCarlemanEkf.from_state(Z[None], P[None], control)


def _increment(increment: Array, cov: Array) -> vehicle.Increment:
    return vehicle.Increment(increment[None, 0], increment[None, 1], cov[None])


def _lifted_predict(
    Z: Array, P: Array, increment: Array, cov: Array, control: str = "first_order"
) -> dict[str, Array]:
    slam = _lifted(Z, P, control)
    slam.predict(_increment(increment, cov))
    return _state(slam)


def _pose(z: Array, P: Array) -> dict[str, Array]:
    Z, P_Z = np.zeros(lift.VEHICLE), np.zeros((lift.VEHICLE, lift.VEHICLE))
    Z[:4], P_Z[:4, :4] = z, P
    return _named("x P", _lifted(Z, P_Z).pose())


def _reduced_predict(
    m: Array, P: Array, increment: Array, cov: Array, control: str = "first_order"
) -> dict[str, Array]:
    n = (len(m) - 4) // 2
    slam = ReducedCarlemanEkf(np.zeros(3), np.zeros((3, 3)), capacity=n, control=control)
    _fill(slam.blocks, n, m, P)
    slam.predict(_increment(increment, cov))
    mean, cov = slam.state()
    return {"m": mean[0], "P": cov[0]}


def _ideal(x: Array, P: Array, truth: Array, landmarks: Array, **run: Any) -> Steps:
    return _pose_steps(IdealEkf(x, P, Truth(truth, landmarks)), **run)


def _pose_steps(slam: SlamFilter, **run: Any) -> Steps:
    return [_named("x P", step.pose()) for step in _drive(slam, **run)]


TABLE: Answers = {
    "vehicle.relative": lambda x, landmark: observation.vehicle_from_world(x, landmark),
    "vehicle.place": lambda x, z: observation.world_from_vehicle(x, z),
    "ekf.ideal_trace": _ideal,
    "lift.landmark": lambda x, landmark: lift.lift_landmark(x, landmark),
    "lift.gaussian": lambda x, P: _named("Z P_Z", moments.lifted_start(x[None], P[None], "gaussian")),
    "lift.gaussian_predict": lambda **inputs: _lifted_predict(control="gaussian", **inputs),
    "reduced.start": lambda x, P: _named("m P", start_moments(x[None], P[None], "gaussian")),
    "reduced.gaussian_predict": lambda **inputs: _reduced_predict(control="gaussian", **inputs),
    "consistency.anchored_trace": lambda x, P, **run: _pose_steps(AnchoredEkf(x, P), **run),
    "vehicle.ackermann": lambda x, control, wheelbase, track, dt: vehicle.propagate(
        x, vehicle.ackermann(control, wheelbase, dt)
    ),
    "vehicle.front_wheel": lambda x, **drive: vehicle.front_wheel_step(x, **drive),
    "vehicle.yaw_rate": _yaw_rate,
    "vehicle.velocity_arc": _arc,
    "ekf.predict": _predict,
    "ekf.predict_additive": _predict_additive,
    "ekf.gate": _gate,
    "sigma_points.points": lambda **inputs: sigma_points(**inputs)._asdict(),
    "sigma_points.predict": lambda **inputs: predict_pose(**inputs)._asdict(),
    "sigma_points.update": lambda **inputs: update_pose(**inputs)._asdict(),
    "range_bearing.update": lambda **inputs: update_polar(**inputs)._asdict(),
    "ekf.update": lambda x, P, **seen: _updated(_slam(x, P), **seen),
    # no landmark of the map has the number that is added
    "ekf.augment": lambda x, P, **seen: _updated(_slam(x, P), [len(x)], **seen),
    "ekf.from_polar": _from_polar,
    "ekf.trace": _trace,
    "lift.vehicle": lambda x, P: _named("Z P_Z", moments.lifted_start(x[None], P[None], "first_order")),
    "carleman.predict": _lifted_predict,
    "carleman.update": lambda Z, P, **seen: _updated(_lifted(Z, P), **seen),
    "carleman.augment": lambda Z, P, **seen: _updated(_lifted(Z, P), [len(Z)], **seen),
    "lift.pose": _pose,
    "reduced.predict": _reduced_predict,
    "carleman.trace": lambda x, P, **run: _pose_steps(carleman_ekf(x, P, form="lifted"), **run),
    "reduced.trace": lambda x, P, **run: _pose_steps(carleman_ekf(x, P, form="reduced"), **run),
}

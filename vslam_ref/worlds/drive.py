"""A filter taken along a course: the one loop over time of every study, step by step.

::

    world, noise --> Drive (increments, sightings) --follow--> after every step: pose, covariance, innovation

Positions are in metres, angles in radians, times in seconds.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from vslam_ref.arrays import Array, IntArray
from vslam_ref.filters import vehicle
from vslam_ref.filters.estimates import Innovation, SlamFilter
from vslam_ref.worlds.vehicle_field import Noise, VehicleField


class Drive(NamedTuple):
    """What B runs of a filter are given on T steps.

    Attributes
    ----------
    increments : Increment
        Measured motions: ds (B, T), dalpha (B, T), cov (B, T, 2, 2).
    seen : mapping of int to (ids, z, cov_z)
        Before which step (0 is the start) which landmarks (m,) are seen, at z (B, m, 2), metres, vehicle's
        frame, with which covariance.
    """

    increments: vehicle.Increment
    seen: Mapping[int, tuple[IntArray, Array, Array]]


class FilterStep(NamedTuple):
    """After a step: mean (B, 3) and cov (B, 3, 3) of the pose; the innovation of an update, or None."""

    mean: Array
    cov: Array
    innovation: Innovation | None


def field_drive(world: VehicleField, noise: Noise, scale: float = 1.0) -> Drive:
    """Return what B runs on the field measure.

    Parameters
    ----------
    world : VehicleField
    noise : Noise
        Standard normal draws of the B runs.
    scale : float
        Factor on all standard deviations.
    """
    c = world.config
    controls = world.controls + noise.controls * scale * [c.sigma_v, c.sigma_phi]
    cov_z = c.cov_z * scale**2
    seen = {
        s.step: (s.ids, s.z + scale * c.sigma_z * e, cov_z)
        for s, e in zip(world.sightings, noise.sightings, strict=True)
    }
    return Drive(vehicle.ackermann_increment(controls, c.cov_u * scale**2, c.wheelbase, c.dt), seen)


def follow(slam: SlamFilter, drive: Drive, every: int = 1) -> Iterator[FilterStep]:
    """Yield the start and every so many steps: predict, update where something is seen, read the pose.

    A filter that puts increments down until they are needed is asked for its pose no more often than that.

    Yields
    ------
    FilterStep
    """
    ds, dalpha, cov = drive.increments
    for k in range(ds.shape[1] + 1):
        if k:
            slam.predict(vehicle.Increment(ds[:, k - 1], dalpha[:, k - 1], cov[:, k - 1]))
        innovation = slam.update(*drive.seen[k]) if k in drive.seen else None
        if k % every == 0:
            yield FilterStep(*slam.pose(), innovation)

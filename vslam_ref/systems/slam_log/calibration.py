"""What has to be known about a vehicle and its sensor before a filter can run: gains, delays, noises.

All of it can be found without any truth (see ``vslam_ref.systems.slam_log.identify``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.filters import range_bearing


def _value(default: float, unit: str, what: str) -> float:
    return field(default=default, metadata={"unit": unit, "reason": what})


@dataclass(frozen=True)
class RobotCalibration:
    """Gains and offsets of odometry and sensor, and the noises of both.

    The increment of a time step is ds = distance_gain ds', dalpha = turn_gain dalpha' + drift ds, where
    ds', dalpha' come from the logged controls (after ``steering_offset`` has been added to a steering
    angle).  Its noises are independent from step to step, with variances that grow with the way and
    the turn, so that a vehicle at rest gathers none::

        var(ds)     = sigma_distance^2 |ds|
        var(dalpha) = sigma_turn^2 |dalpha| + sigma_drift^2 |ds|

    A sighting stamped t was taken at t - sighting_delay; the sensor sits ``sensor_ahead`` in front of
    the vehicle's origin.  The true range is (r + range_offset) / cos(b)^range_cosine: an exponent of 1
    says that the sensor's "range" is a depth along its optical axis.
    """

    distance_gain: float = _value(1.0, "", "true over logged distance")
    turn_gain: float = _value(1.0, "", "true over logged turn")
    drift: float = _value(0.0, "rad/m", "turn per distance that the log knows nothing of")
    steering_offset: float = _value(0.0, "rad", "added to the steering angle")
    sighting_delay: float = _value(0.0, "s", "stamp of a sighting less the time it was taken")
    sensor_ahead: float = _value(0.0, "m", "place of the sensor in front of the vehicle's origin")
    bearing_offset: float = _value(0.0, "rad", "subtracted from bearings")
    range_offset: float = _value(0.0, "m", "added to ranges")
    range_cosine: float = _value(0.0, "", "exponent c of r / cos(b)^c")
    sigma_distance: float = _value(0.05, "m/sqrt(m)", "random walk of the distance")
    sigma_turn: float = _value(0.05, "rad/sqrt(rad)", "random walk of the heading while turning")
    sigma_drift: float = _value(0.05, "rad/sqrt(m)", "random walk of the heading while driving")
    sigma_range: float = _value(0.1, "m", "range noise")
    sigma_bearing: float = _value(0.02, "rad", "bearing noise")

    def __post_init__(self) -> None:
        """Refuse values no filter can use."""
        for entry in fields(self):
            value = getattr(self, entry.name)
            if not np.isfinite(value):
                raise ValueError(f"{entry.name}={value}: must be a finite number")
            if entry.name.startswith("sigma_") and value <= 0:
                raise ValueError(f"{entry.name}={value}: must be > 0")

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> RobotCalibration:
        """Build from a mapping; an unknown name raises a ValueError."""
        known = [entry.name for entry in fields(cls)]
        for name in values:
            if name not in known:
                raise ValueError(f"unknown value {name!r}; known: {', '.join(known)}")
        return cls(**{name: float(value) for name, value in values.items()})

    def correct(self, polar: ArrayLike) -> Array:
        """Ranges and bearings (m, 2) without offsets, of logged ones."""
        polar = np.array(polar, dtype=np.float64)
        polar[..., 1] -= self.bearing_offset
        polar[..., 0] = (polar[..., 0] + self.range_offset) / np.cos(polar[..., 1]) ** self.range_cosine
        return polar

    def measure(self, polar: ArrayLike) -> range_bearing.Converted:
        """Relative Cartesian measurements in the vehicle frame of logged ranges and bearings (m, 2)."""
        z, cov = range_bearing.cartesian_from_polar(self.correct(polar), self.sigma_range, self.sigma_bearing)
        z[..., 0] += self.sensor_ahead
        return range_bearing.Converted(z, cov)

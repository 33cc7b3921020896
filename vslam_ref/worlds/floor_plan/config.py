"""Every number of the floor plan's world, with its unit (metres, radians, seconds) and its reason."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, Literal

import numpy as np

from vslam_ref.support.config import assume


def _refuse_not_finite(config: Any) -> None:
    """Raise for a number of the config that is NaN or infinite: comparisons would let NaN through."""
    for f in fields(config):
        value = getattr(config, f.name)
        if isinstance(value, float) and not np.isfinite(value):
            raise ValueError(f"{f.name}={value}: need a finite number")


@dataclass(frozen=True)
class CrowdConfig:
    """People.

    ``density`` is the share of the free floor that bodies cover: people x pi radius^2 / (floor - furniture).
    Free floor is the area of rooms and corridor less that of the furniture.
    """

    density: float = assume(
        0.2, "", "share of the free floor covered by bodies; 0.2 is one person per square metre"
    )
    radius: float = assume(0.25, "m", "half a shoulder's width: the body's disc")
    legs: bool = assume(True, "", "a laser at 0.3 m sees two legs; False: it sees the body's disc")
    leg_radius: float = assume(0.07, "m", "a leg with trousers, at half calf's height")
    leg_gap: float = assume(0.22, "m", "distance of the two legs' centres, across")
    leg_swing: float = assume(0.12, "m", "amplitude along the way; legs stay inside the body's disc")
    stride: float = assume(1.3, "m", "walked length of a full cycle of both legs")
    speed: float = assume(1.2, "m/s", "mean wish; usual walking pace indoors")
    speed_spread: float = assume(0.2, "m/s", "standard deviation between people; cut at two of them")
    pause_most: float = assume(4.0, "s", "pauses at a goal are uniform up to this; shorter than ``memory``")
    leave: float = assume(0.2, "", "chance that the next goal lies in another room")
    patience: float = assume(12.0, "s", "a goal not reached by then is given up")
    relax: float = assume(0.5, "s", "Helbing and Molnar: time to reach the wished velocity")
    push: float = assume(5.0, "m/s^2", "social force at contact; a body can accelerate at half g")
    reach: float = assume(0.15, "m", "length over which that force falls by e")
    step: float = assume(
        0.1, "s", "of the crowd's motion: 12 cm at walking pace, half the radius; split to fit scans"
    )

    def __post_init__(self) -> None:
        """Refuse crowds that cannot be."""
        _refuse_not_finite(self)
        if not 0.0 <= self.density <= 0.5:
            raise ValueError(
                f"density={self.density}: need 0 to 0.5 of the free floor; discs thrown at random jam above"
            )
        lengths = (self.radius, self.leg_radius, self.stride, self.speed, self.relax, self.reach, self.step)
        if not (np.isfinite(lengths).all() and min(lengths) > 0):
            raise ValueError(
                "radius, leg_radius, stride, speed, relax, reach and step: need finite numbers > 0"
            )
        if np.hypot(self.leg_gap / 2, self.leg_swing) + self.leg_radius > self.radius:
            raise ValueError(
                f"leg_gap={self.leg_gap}, leg_swing={self.leg_swing}, leg_radius={self.leg_radius}: "
                f"legs must stay inside the body, radius={self.radius}"
            )
        if not 0.0 <= self.leave <= 1.0 or self.pause_most < 0 or self.push < 0 or self.patience <= 0:
            raise ValueError("need 0 <= leave <= 1, pause_most >= 0, push >= 0 and patience > 0")


@dataclass(frozen=True)
class LaserConfig:
    """The range finder; it sits in the robot's reference point and looks ahead."""

    beams: int = assume(361, "", "one every 0.75 degree: 13 cm apart at 10 m, about a cell")
    field_of_view: float = assume(float(np.deg2rad(270.0)), "rad", "a usual indoor scanner's 270 degrees")
    sigma: float = assume(0.015, "m", "standard deviation of a range; indoor scanners give 10 to 30 mm")
    max_range: float = assume(10.0, "m", "beyond it nothing returns; the plan is 14 m long")
    dropout: float = assume(0.01, "", "share of beams without a reading: dark or slanted surfaces")

    def __post_init__(self) -> None:
        """Refuse lasers that cannot be."""
        _refuse_not_finite(self)
        if self.beams < 2:
            raise ValueError(f"beams={self.beams}: need at least 2")
        if not 0.0 < self.field_of_view <= 2 * np.pi:
            raise ValueError(f"field_of_view={self.field_of_view}: need more than 0 and at most 2 pi")
        if not (self.sigma >= 0 and 0 < self.max_range < np.inf and 0 <= self.dropout < 1):
            raise ValueError("need sigma >= 0, a finite max_range > 0 and 0 <= dropout < 1")

    @property
    def angles(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Directions (beams,) of the beams in the robot's frame, radians; a full circle has none twice."""
        half = self.field_of_view / 2
        return np.linspace(-half, half, self.beams, endpoint=bool(self.field_of_view < 2 * np.pi))


@dataclass(frozen=True)
class RobotConfig:
    """The robot and its odometry.

    A step drives ``ds`` along the heading, then turns by ``dalpha``; both are measured with independent
    Gaussian errors of variance ``drift_ds^2 |ds|`` and ``drift_turn^2 |dalpha| + drift_heading^2 |ds|``.
    """

    radius: float = assume(0.3, "m", "people keep their bodies out of this disc")
    speed: float = assume(0.5, "m/s", "slow enough for a crowd")
    turn_rate: float = assume(0.8, "rad/s", "turns on the spot")
    scan_period: float = assume(0.2, "s", "five scans a second; the robot moves a cell between two")
    drift_ds: float = assume(0.05, "m^0.5", "5 cm per metre, 0.3 m after the route's 30 m")
    drift_turn: float = assume(0.05, "rad^0.5", "3 degrees per turn of 1 rad")
    drift_heading: float = assume(0.03, "rad/m^0.5", "1.7 degrees per metre: a wheel pair's slip")

    def __post_init__(self) -> None:
        """Refuse robots that cannot be."""
        _refuse_not_finite(self)
        if not (min(self.radius, self.speed, self.turn_rate, self.scan_period) > 0):
            raise ValueError("radius, speed, turn_rate and scan_period: need numbers > 0")
        if min(self.drift_ds, self.drift_turn, self.drift_heading) < 0:
            raise ValueError("drift_ds, drift_turn and drift_heading: need numbers >= 0")


@dataclass(frozen=True)
class FloorPlanConfig:
    """A floor, who is on it, and who looks."""

    crowd: CrowdConfig = field(default_factory=CrowdConfig)
    laser: LaserConfig = field(default_factory=LaserConfig)
    robot: RobotConfig = field(default_factory=RobotConfig)
    plan: Literal["office", "hall", "depot"] = assume(
        "office", "", "five rooms and a corridor; hall: one room, for tests; depot: a bare room, for carts"
    )
    memory: float = assume(
        10.0, "s", "T: a thing counts as moving while its pose changed within the last T seconds"
    )
    moved_least: float = assume(
        0.05, "m", "a person who shifted less than this within T stands: swaying is no walk"
    )
    carts: int = assume(0, "", "boxes on wheels that are pushed to and fro: moving things with corners")
    cart_speed: float = assume(0.3, "m/s", "a trolley that somebody loads as it goes")
    duration: float = assume(1e9, "s", "stop after this long, or at the end of the route")

    def __post_init__(self) -> None:
        """Refuse floors that cannot be."""
        _refuse_not_finite(self)
        if min(self.memory, self.duration, self.cart_speed) <= 0 or self.moved_least < 0 or self.carts < 0:
            raise ValueError("need memory > 0, duration > 0, cart_speed > 0, moved_least >= 0 and carts >= 0")

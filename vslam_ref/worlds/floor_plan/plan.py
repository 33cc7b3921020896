"""Floor plans: walls, doors that swing, boxes that are moved, zones where people walk, and the robot's route.

::

        10 +--------+-------+--------+
           |   C    |   D   |   E    |      walls are thin and lie on the middle lines of 10 cm cells:
         6 +--=-----+--=----+----=---+      which cell a wall covers is then no matter of rounding
           |        corridor         |      = a door, one metre wide
         4 +-----=-----+-------=-----+
           |     A     |     B       |      the robot starts in A, goes along the corridor into B,
         0 +-----------+-------------+      back, and into D
           0           7            14 m
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.geometry import se2, so2


class Schedule(NamedTuple):
    """A quantity given at some times, linear between them and constant outside.

    Attributes
    ----------
    times : ndarray, shape (k,)
        Seconds, increasing.
    values : ndarray, shape (k, ...)
    """

    times: Array
    values: Array

    def at(self, t: float) -> Array:
        """Value (...,) at time t, s."""
        i = int(np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 1))
        j = min(i + 1, len(self.times) - 1)
        if i == j or t <= self.times[0]:
            return np.asarray(self.values[i], dtype=np.float64)
        share = (t - self.times[i]) / (self.times[j] - self.times[i])
        return np.asarray(self.values[i] + share * (self.values[j] - self.values[i]), dtype=np.float64)

    def changed(self, t: float, memory: float) -> bool:
        """Whether the value was not constant on [t - memory, t]: exact, from the pieces."""
        for i in range(len(self.times) - 1):
            moving = bool(np.any(self.values[i + 1] != self.values[i]))
            if moving and self.times[i] < t and self.times[i + 1] > t - memory:
                return True
        return False


def schedule(times: ArrayLike, values: ArrayLike) -> Schedule:
    """Build a :class:`Schedule` of times (k,), s, that must increase, and values (k, ...)."""
    t, v = np.asarray(times, dtype=np.float64), np.asarray(values, dtype=np.float64)
    if t.ndim != 1 or len(t) == 0 or len(t) != len(v) or not np.isfinite(t).all() or np.any(np.diff(t) <= 0):
        raise ValueError(
            f"schedule with {t.size} times and {len(v)} values: need as many, finite and increasing"
        )
    return Schedule(t, v)


@dataclass(frozen=True)
class Door:
    """A leaf that turns about its hinge.

    Parameters
    ----------
    hinge, end : tuple of two floats
        The leaf when closed, metres.
    angle : Schedule
        Turn of the leaf from closed, radians.
    """

    hinge: tuple[float, float]
    end: tuple[float, float]
    angle: Schedule

    def segment(self, t: float) -> Array:
        """Leaf (ax, ay, bx, by) at time t."""
        hinge, arm = np.array(self.hinge), np.subtract(self.end, self.hinge)
        return np.concatenate([hinge, hinge + so2.rotate(self.angle.at(t), arm)])

    def open(self, t: float) -> bool:
        """Whether one can walk through: the leaf stands at more than 60 degrees."""
        return bool(abs(self.angle.at(t)) > np.deg2rad(60.0))


@dataclass(frozen=True)
class Box:
    """A thing with four sides that stands, or is moved.

    Parameters
    ----------
    size : tuple of two floats
        Along its own x and y, metres.
    T_world_box : Schedule
        Poses (x, y, theta) of its middle.
    """

    size: tuple[float, float]
    T_world_box: Schedule

    def corners(self, t: float) -> Array:
        """Corners (4, 2) at time t, anticlockwise."""
        half = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * np.array(self.size) / 2
        return se2.act(self.T_world_box.at(t), half)

    def segments(self, t: float) -> Array:
        """Its sides (4, 4) at time t."""
        corners = self.corners(t)
        return np.concatenate([corners, np.roll(corners, -1, axis=0)], axis=1)


class Gate(NamedTuple):
    """A way through a door: the room's zone, a point before it inside the room, one in the corridor."""

    zone: int
    inside: tuple[float, float]
    outside: tuple[float, float]
    door: int


@dataclass(frozen=True)
class FloorPlan:
    """A floor.

    Parameters
    ----------
    walls : ndarray, shape (m, 4)
        Segments, metres.
    zones : ndarray, shape (z, 4)
        Rectangles ``(xmin, ymin, xmax, ymax)`` where people walk; zone 0 is the one that the gates lead to.
    route : ndarray, shape (k, 2)
        Where the robot goes, from point to point.
    furniture, things : tuple of Box
        What never moves, and what is moved.
    doors : tuple of Door
    gates : tuple of Gate
    """

    walls: Array
    zones: Array
    route: Array
    furniture: tuple[Box, ...] = ()
    things: tuple[Box, ...] = ()
    doors: tuple[Door, ...] = ()
    gates: tuple[Gate, ...] = field(default=())

    @property
    def free_area(self) -> float:
        """Area of the zones less that of furniture and things, square metres."""
        floor = float(np.sum((self.zones[:, 2] - self.zones[:, 0]) * (self.zones[:, 3] - self.zones[:, 1])))
        return floor - sum(box.size[0] * box.size[1] for box in self.furniture + self.things)

    @property
    def fixed(self) -> Array:
        """Segments that never move: walls and furniture, (m, 4)."""
        return np.concatenate([self.walls, *(box.segments(0.0) for box in self.furniture)])

    def moved(self, t: float) -> Array:
        """Segments of doors, then of things, at time t: (doors + 4 things, 4)."""
        parts = [door.segment(t)[None] for door in self.doors] + [box.segments(t) for box in self.things]
        return np.concatenate(parts) if parts else np.zeros((0, 4))


def standing(xmin: float, ymin: float, xmax: float, ymax: float) -> Box:
    """A box that never moves, from its sides."""
    return Box((xmax - xmin, ymax - ymin), schedule([0.0], [[(xmin + xmax) / 2, (ymin + ymax) / 2, 0.0]]))


def rectangle(xmin: float, ymin: float, xmax: float, ymax: float) -> Array:
    """Four walls (4, 4)."""
    return standing(xmin, ymin, xmax, ymax).segments(0.0)


def _wall(y: float, x: float, end: float, gaps: tuple[tuple[float, float], ...]) -> Array:
    """A wall along x with gaps for doors."""
    edges = [x, *(edge for gap in gaps for edge in gap), end]
    return np.array([[a, y, b, y] for a, b in zip(edges[::2], edges[1::2], strict=True)])


def _swing(*steps: tuple[float, float]) -> Schedule:
    """Angles of a door: (begin of a swing of two seconds, angle after it); the first one is the start."""
    times, values = [steps[0][0]], [steps[0][1]]
    for t, angle in steps[1:]:
        times += [t, t + 2.0]
        values += [values[-1], angle]
    return schedule(times, values)


def _office_furniture() -> tuple[Box, ...]:
    return (
        standing(5.05, 0.65, 6.25, 1.45), standing(0.05, 3.25, 0.65, 4.05),  # A: table, cupboard
        standing(8.05, 1.25, 9.25, 2.05), standing(13.25, 2.05, 14.05, 3.25),  # B
        standing(0.65, 8.25, 1.85, 9.05), standing(4.05, 9.45, 4.65, 10.05),  # C
        standing(5.05, 8.85, 6.25, 9.65), standing(8.45, 8.45, 9.45, 9.05),  # D
        standing(11.05, 8.45, 12.25, 9.25),  # E
        standing(5.35, 4.05, 5.65, 4.35), standing(8.75, 5.75, 9.05, 6.05),
        standing(13.05, 4.05, 13.35, 4.35),
    )  # fmt: skip


def office() -> FloorPlan:
    """Five rooms and a corridor, 14 m by 10 m, with doors that open and close and a chair that is carried."""
    quarter = np.pi / 2
    walls = np.concatenate(
        [
            rectangle(0.05, 0.05, 14.05, 10.05),
            _wall(4.05, 0.05, 14.05, ((3.05, 4.05), (10.05, 11.05))),
            _wall(6.05, 0.05, 14.05, ((2.05, 3.05), (6.55, 7.55), (11.05, 12.05))),
            [[7.05, 0.05, 7.05, 4.05], [4.65, 6.05, 4.65, 10.05], [9.45, 6.05, 9.45, 10.05]],
        ]
    )
    doors = (
        Door((3.05, 4.05), (4.05, 4.05), _swing((0.0, -quarter), (30.0, 0.0))),
        Door((11.05, 4.05), (10.05, 4.05), _swing((0.0, quarter))),
        Door((2.05, 6.05), (3.05, 6.05), _swing((0.0, quarter), (24.0, 0.0), (44.0, quarter))),
        Door((6.55, 6.05), (7.55, 6.05), _swing((0.0, quarter))),
        Door((12.05, 6.05), (11.05, 6.05), _swing((0.0, 0.0), (22.0, -quarter))),
    )
    furniture = _office_furniture()
    chair = Box((0.4, 0.4), schedule([2.5, 6.5], [[5.65, 3.05, 0.0], [1.85, 3.05, 0.0]]))
    zones = np.array(
        [
            [0.05, 4.05, 14.05, 6.05],
            [0.05, 0.05, 7.05, 4.05], [7.05, 0.05, 14.05, 4.05],
            [0.05, 6.05, 4.65, 10.05], [4.65, 6.05, 9.45, 10.05], [9.45, 6.05, 14.05, 10.05],
        ]
    )  # fmt: skip
    middles = ((3.55, 4.05, 1, -0.7), (10.55, 4.05, 2, -0.7), (2.55, 6.05, 3, 0.7), (7.05, 6.05, 4, 0.7),
               (11.55, 6.05, 5, 0.7))  # fmt: skip
    gates = tuple(Gate(zone, (x, y + d), (x, y - d), i) for i, (x, y, zone, d) in enumerate(middles))
    route = np.array(
        [[1.5, 1.5], [3.55, 1.5], [3.55, 5.05], [10.55, 5.05],
         [10.55, 2.5], [10.55, 5.05], [7.05, 5.05], [7.05, 7.5]]
    )  # fmt: skip
    return FloorPlan(walls, zones, route, furniture, (chair,), doors, gates)


def hall() -> FloorPlan:
    """One room of 6 m by 5 m with a pillar and a box that is moved: small enough to check by hand."""
    pillar = standing(4.05, 3.05, 4.55, 3.55)
    box = Box((0.4, 0.4), schedule([3.0, 5.0], [[4.65, 1.25, 0.7], [2.65, 3.85, 0.7]]))
    room = np.array([[0.05, 0.05, 6.05, 5.05]])
    return FloorPlan(
        rectangle(*room[0]), room, np.array([[1.0, 1.0], [3.5, 1.0], [3.5, 2.5]]), (pillar,), (box,)
    )


def depot() -> FloorPlan:
    """One room of 12 m by 8 m with two pillars: few corners that stay, and room for carts."""
    room = np.array([[0.05, 0.05, 12.05, 8.05]])
    pillars = (standing(3.85, 3.85, 4.25, 4.25), standing(7.85, 3.85, 8.25, 4.25))
    route = np.array([[1.5, 1.0], [10.5, 1.0], [10.5, 7.0], [1.5, 7.0], [1.5, 2.5]])
    return FloorPlan(rectangle(*room[0]), room, route, pillars)


PLANS = {"office": office, "hall": hall, "depot": depot}

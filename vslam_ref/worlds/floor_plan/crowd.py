"""People who walk: goals, a social force between them, and no one through a wall.

The force is Helbing and Molnar's (Phys. Rev. E 51, 1995) in its circular form::

    dv/dt = (v_wish - v) / tau  +  sum over others of  A exp((2 r - d) / B) n  +  the same from walls, with
    r - d

After each step bodies that overlap are pushed apart, bodies that stand in the robot's disc or too near to
a wall are pushed out, and a move through a wall is taken back.

Places are in metres, velocities in m/s, times in seconds.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.worlds.floor_plan.config import CrowdConfig
from vslam_ref.worlds.floor_plan.plan import FloorPlan
from vslam_ref.worlds.floor_plan.rays import CORNER

ARRIVED = 0.35
"""Metres from a goal at which it counts as reached."""
KEEP_OFF = 0.3
"""Metres between a goal and the sides of its zone."""


def nearest_on_segments(points: Array, segments: Array) -> tuple[Array, Array]:
    """Vectors (n, m, 2) from the nearest point of each segment to each point, and lengths (n, m)."""
    ex, ey = segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1]
    length2 = np.maximum(ex * ex + ey * ey, 1e-300)
    away = np.empty((len(points), len(segments), 2))
    x, y = points[:, :1] - segments[:, 0], points[:, 1:] - segments[:, 1]
    share = np.minimum(np.maximum((x * ex + y * ey) / length2, 0.0), 1.0)
    away[..., 0], away[..., 1] = x - share * ex, y - share * ey
    return away, np.sqrt(away[..., 0] ** 2 + away[..., 1] ** 2)


def crosses(start: Array, end: Array, segments: Array) -> BoolArray:
    """Whether the way (n, 2) to (n, 2) of each person meets any segment (m, 4)."""
    d = end - start
    a, e = segments[None, :, :2] - start[:, None], segments[None, :, 2:] - segments[None, :, :2]
    det = d[:, None, 0] * e[..., 1] - d[:, None, 1] * e[..., 0]
    safe = np.where(det == 0.0, 1.0, det)
    t = (a[..., 0] * e[..., 1] - a[..., 1] * e[..., 0]) / safe
    u = (a[..., 0] * d[:, None, 1] - a[..., 1] * d[:, None, 0]) / safe
    met = (det != 0.0) & (t >= 0) & (t <= 1) & (u >= -CORNER) & (u <= 1 + CORNER)
    return np.asarray(met.any(axis=1))


class Crowd:
    """The people of a floor.

    Parameters
    ----------
    plan : FloorPlan
    config : CrowdConfig
    start : float
        Time of the start, seconds: it decides which doors are open.
    rng : numpy.random.Generator
        Wishes, goals, pauses and places.

    Attributes
    ----------
    position, velocity : ndarray, shape (n, 2)
    heading, walked : ndarray, shape (n,)
        Direction in which each one walks (rad) and length walked so far (m), which places the legs.
    """

    def __init__(self, plan: FloorPlan, config: CrowdConfig, start: float, rng: np.random.Generator) -> None:
        self._plan, self._config, self._rng = plan, config, rng
        if plan.free_area <= 0:
            raise ValueError(
                f"plan: free area {plan.free_area:.2f} m^2: furniture covers more than the zones"
            )
        n = round(config.density * plan.free_area / (np.pi * config.radius**2))
        self.position = self._places(n, start)
        self.velocity = np.zeros((n, 2))
        self.heading = rng.uniform(-np.pi, np.pi, n)
        self.walked = rng.uniform(0.0, config.stride, n)
        spread = np.clip(rng.standard_normal(n), -2.0, 2.0)
        self._wish = np.maximum(config.speed + config.speed_spread * spread, 0.1)
        self._ways: list[list[tuple[float, float]]] = [[] for _ in range(n)]
        self._wait = rng.uniform(0.0, config.pause_most, n)
        self._given = np.full(n, start)
        self._goal = self.position.copy()

    def __len__(self) -> int:
        return len(self.position)

    def _places(self, n: int, t: float) -> Array:
        """Draw places on the free floor, clear of walls and boxes; bodies that overlap part later."""
        zones, radius = self._plan.zones, self._config.radius
        area = (zones[:, 2] - zones[:, 0]) * (zones[:, 3] - zones[:, 1])
        segments = np.concatenate([self._plan.fixed, self._plan.moved(t)])
        boxes = np.array([b.corners(t)[[0, 2]].ravel() for b in self._plan.furniture + self._plan.things])
        found = np.zeros((0, 2))
        for _ in range(200):
            if len(found) >= n:
                return found[:n]
            zone = self._rng.choice(len(zones), size=2 * n, p=area / area.sum())
            share = self._rng.uniform(size=(2 * n, 2))
            places = zones[zone, :2] + share * (zones[zone, 2:] - zones[zone, :2])
            clear = nearest_on_segments(places, segments)[1].min(axis=1) > radius
            for low_x, low_y, high_x, high_y in boxes.reshape(-1, 4):
                x, y = places.T
                clear &= ~((x > low_x) & (x < high_x) & (y > low_y) & (y < high_y))
            found = np.concatenate([found, places[clear]])
        raise ValueError(f"plan: {n} people find no place clear of walls and boxes in its zones")

    def zone_of(self, points: Array) -> IntArray:
        """Index (n,) of the zone in which each point (n, 2), metres, lies; 0 if it lies in none."""
        z = self._plan.zones
        inside = (points[:, None] >= z[:, :2]) & (points[:, None] <= z[:, 2:])
        return np.asarray(np.argmax(inside.all(axis=2), axis=1), dtype=np.int64)

    def step(self, t: float, robot: Array, robot_radius: float) -> None:
        """Move everybody by one step that begins at time t; the robot stands at ``robot`` (2,)."""
        if len(self) == 0:
            return
        dt, radius = self._config.step, self._config.radius
        self._choose(t)
        segments = np.concatenate([self._plan.fixed, self._plan.moved(t + dt)])
        self.velocity += dt * self._force(segments, robot, robot_radius)
        speed = np.linalg.norm(self.velocity, axis=1)
        self.velocity *= (np.minimum(1.0, 1.3 * self._wish / np.maximum(speed, 1e-12)))[:, None]
        moved = self.position + dt * self.velocity
        moved = _out_of(self._apart(moved), robot, robot_radius + radius)
        moved = _off(moved, segments, radius)
        moved = np.where(crosses(self.position, moved, segments)[:, None], self.position, moved)
        moved = _out_of(moved, robot, robot_radius + radius)
        step = moved - self.position
        length = np.linalg.norm(step, axis=1)
        self.velocity = step / dt * np.minimum(1.0, 2.0 / np.maximum(length / dt, 1e-12))[:, None]
        walking = length > 0.2 * dt
        self.heading = np.where(walking, np.arctan2(step[:, 1], step[:, 0]), self.heading)
        self.walked = self.walked + np.where(walking, length, 0.0)
        self.position = moved

    def _choose(self, t: float) -> None:
        """Go on to the next point of the way, wait, or think of a new goal."""
        reached = np.linalg.norm(self._goal - self.position, axis=1) < ARRIVED
        late = t - self._given > self._config.patience
        self._wait = np.where(reached | late, self._wait - self._config.step, self._wait)
        for i in np.flatnonzero(
            late | (reached & ((self._wait <= 0.0) | np.array([bool(w) for w in self._ways])))
        ):
            if late[i] or not self._ways[i]:
                self._ways[i] = self._new_way(int(i), t)
                self._wait[i] = self._rng.uniform(0.0, self._config.pause_most)
            self._goal[i] = self._ways[i].pop(0)
            self._given[i] = t

    def _new_way(self, i: int, t: float) -> list[tuple[float, float]]:
        """Points to walk through: a goal in this zone, or in another one through doors that are open."""
        here = int(self.zone_of(self.position[i : i + 1])[0])
        ways = {g.zone: g for g in self._plan.gates if self._plan.doors[g.door].open(t)}
        reachable = [z for z in [0, *ways] if z != here] if here == 0 or here in ways else []
        there = here
        if reachable and self._rng.uniform() < self._config.leave:
            there = int(self._rng.choice(reachable))
        low, high = self._plan.zones[there, :2] + KEEP_OFF, self._plan.zones[there, 2:] - KEEP_OFF
        way = [tuple(self._rng.uniform(low, high))]
        if there != here and there != 0:
            way = [ways[there].outside, ways[there].inside, *way]
        if there != here and here != 0:
            way = [ways[here].inside, ways[here].outside, *way]
        return way

    def _force(self, segments: Array, robot: Array, robot_radius: float) -> Array:
        """Accelerations (n, 2)."""
        c = self._config
        way = self._goal - self.position
        left = np.linalg.norm(way, axis=1, keepdims=True)
        wish = np.where(left > ARRIVED, way / np.maximum(left, 1e-9) * self._wish[:, None], 0.0)
        force = (wish - self.velocity) / c.relax
        i, j, n, d = self._pairs(self.position, 2 * c.radius + 5 * c.reach)
        push = c.push * np.exp((2 * c.radius - d) / c.reach)[:, None] * n
        np.add.at(force, i, push)
        np.add.at(force, j, -push)
        away, near = nearest_on_segments(self.position, segments)
        strength = c.push * np.exp((c.radius - near) / c.reach) / np.maximum(near, 1e-9)
        force += np.einsum("nm,nmk->nk", strength, away)
        from_robot = self.position - robot
        gap = np.linalg.norm(from_robot, axis=1)
        force += (c.push * np.exp((c.radius + robot_radius - gap) / c.reach) / np.maximum(gap, 1e-9))[
            :, None
        ] * from_robot
        return np.asarray(force)

    def _pairs(self, position: Array, within: float) -> tuple[IntArray, IntArray, Array, Array]:
        """Pairs nearer than ``within``: indices, unit vectors from j to i, distances."""
        from scipy.spatial import cKDTree

        pairs = cKDTree(position).query_pairs(within, output_type="ndarray")
        pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
        i, j = pairs[:, 0], pairs[:, 1]
        between = position[i] - position[j]
        d = np.linalg.norm(between, axis=1)
        n = np.where(d[:, None] > 1e-9, between / np.maximum(d, 1e-9)[:, None], [1.0, 0.0])
        return i, j, n, d

    def _apart(self, position: Array) -> Array:
        """Push overlapping bodies apart, most of the overlap."""
        i, j, n, d = self._pairs(position, 2 * self._config.radius)
        half = 0.4 * (2 * self._config.radius - d)[:, None] * n  # 0.5 would let chains of three swing
        moved = position.copy()
        np.add.at(moved, i, half)
        np.add.at(moved, j, -half)
        return moved

    def discs(self) -> Array:
        """What the laser sees, (k, 3): two legs per person, all of the first person first, or one body."""
        c = self._config
        if not c.legs:
            return np.column_stack([self.position, np.full(len(self), c.radius)])
        ahead = np.stack([np.cos(self.heading), np.sin(self.heading)], 1)
        left = np.stack([-ahead[:, 1], ahead[:, 0]], 1)
        swing = c.leg_swing * np.sin(2 * np.pi * self.walked / c.stride)[:, None] * ahead
        legs = np.stack(
            [self.position + c.leg_gap / 2 * left + swing, self.position - c.leg_gap / 2 * left - swing], 1
        )
        return np.column_stack([legs.reshape(-1, 2), np.full(2 * len(self), c.leg_radius)])


def _off(position: Array, segments: Array, radius: float) -> Array:
    """Push bodies off the segment that is nearest to them."""
    away, near = nearest_on_segments(position, segments)
    which = np.argmin(near, axis=1)
    rows = np.arange(len(position))
    d, n = near[rows, which], away[rows, which]
    push = np.maximum(radius - d, 0.0) / np.maximum(d, 1e-9)
    return np.asarray(position + push[:, None] * n)


def _out_of(position: Array, centre: Array, radius: float) -> Array:
    """Push bodies out of a disc around the robot."""
    away = position - centre
    d = np.linalg.norm(away, axis=1, keepdims=True)
    n = np.where(d > 1e-9, away / np.maximum(d, 1e-9), [1.0, 0.0])
    return np.where(d < radius, centre + radius * n, position)

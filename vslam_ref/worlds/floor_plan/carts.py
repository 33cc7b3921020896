"""Carts: boxes on wheels that are pushed to and fro, moving things with corners."""

from __future__ import annotations

import dataclasses

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.worlds.floor_plan.crowd import nearest_on_segments
from vslam_ref.worlds.floor_plan.plan import Box, FloorPlan, Schedule, schedule

CART = (0.8, 0.5)
"""Metres; its corners lie 0.47 m from its middle."""
CART_GAP = 0.1
"""Metres between the circle around a cart and walls, things, other carts, and the robot."""


def with_carts(
    plan: FloorPlan, carts: int, rng: np.random.Generator, robot_radius: float = 0.3, speed: float = 0.3
) -> FloorPlan:
    """Add boxes on wheels, each pushed to and fro on a free straight line.

    A cart stands for 12 to 25 s (the first time 4 to 15 s), then moves by 1 to 2.5 m, and so on.

    Raises
    ------
    ValueError
        If no free line is found for a cart in 5000 draws.
    """
    things = list(plan.things)
    swept = [
        box.segments(t)
        for box in plan.things
        for t in np.linspace(box.T_world_box.times[0], box.T_world_box.times[-1], 9)
    ]
    swept += [door.segment(t)[None] for door in plan.doors for t in np.linspace(0.0, 60.0, 61)]
    fixed = np.concatenate([plan.fixed, *swept])
    route = np.concatenate([plan.route[:-1], plan.route[1:]], axis=1)
    radius = float(np.hypot(*CART)) / 2 + CART_GAP
    lines = np.zeros((0, 4))
    for _ in range(carts):
        keep_off = ((fixed, radius), (lines, 2 * radius), (route, radius + robot_radius))
        line = _free_line(plan, keep_off, rng)
        lines = np.concatenate([lines, line.reshape(1, 4)])
        things.append(Box(CART, _to_and_fro(line, speed, rng)))
    return dataclasses.replace(plan, things=tuple(things))


def _to_and_fro(line: Array, speed: float, rng: np.random.Generator, until: float = 200.0) -> Schedule:
    """Poses of a cart on a line (2, 2)."""
    way = line[1] - line[0]
    heading, duration = float(np.arctan2(way[1], way[0])), float(np.hypot(*way)) / speed
    t, at = float(rng.uniform(4.0, 15.0)), 0
    times, values = [0.0], [[*line[0], heading]]
    while t < until:
        times += [t, t + duration]
        values += [[*line[at], heading], [*line[1 - at], heading]]
        at, t = 1 - at, times[-1] + float(rng.uniform(12.0, 25.0))
    return schedule(times, values)


def _free_line(plan: FloorPlan, keep_off: tuple[tuple[Array, float], ...], rng: np.random.Generator) -> Array:
    """Ends (2, 2) of a line in one zone that stays away from segments by the given distances."""
    for _ in range(5000):
        zone = plan.zones[rng.integers(len(plan.zones))]
        start = rng.uniform(zone[:2], zone[2:])
        angle = rng.uniform(-np.pi, np.pi)
        end = start + rng.uniform(1.0, 2.5) * np.array([np.cos(angle), np.sin(angle)])
        if not ((end > zone[:2]).all() and (end < zone[2:]).all()):
            continue
        points = start + np.linspace(0.0, 1.0, 26)[:, None] * (end - start)
        if all(nearest_on_segments(points, s)[1].min(initial=np.inf) > d for s, d in keep_off):
            return np.stack([start, end])
    raise ValueError(
        "carts: no free straight line was found for one more; ask for fewer, or give a larger plan"
    )

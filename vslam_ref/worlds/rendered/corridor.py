"""``corridor``: a walk along a corridor with posters and doors, around a bend, and on."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.worlds.rendered import motion, painting
from vslam_ref.worlds.rendered.desk import Builder, Paint
from vslam_ref.worlds.rendered.quads import Built, joined, quad
from vslam_ref.worlds.rendered.textures import Bytes

Rng = np.random.Generator
WIDTH, HEIGHT = 2.2, 2.6
FIRST, SECOND = 16.0, 11.0
"""Metres from the start to the far wall of the bend, and from there to the end."""
SECONDS = 20.0
PANEL = 4.0
EYE = 1.5
"""Metres above the floor."""


def build(rng: Rng) -> Built:
    """The corridor runs along x to the bend, then along y: quads in metres, and textures."""
    b = Builder(rng)
    half = WIDTH / 2
    left_end, right_end = FIRST - WIDTH, SECOND + half
    add_wall(b, [-3.0, half, 0.0], [1.0, 0, 0], left_end + 3.0, [0, -1.0, 0])
    add_wall(b, [FIRST, -half, 0.0], [-1.0, 0, 0], FIRST + 3.0, [0, 1.0, 0])
    add_wall(b, [left_end, half, 0.0], [0, 1.0, 0], right_end - half, [1.0, 0, 0])
    add_wall(b, [FIRST, right_end, 0.0], [0, -1.0, 0], right_end + half, [-1.0, 0, 0])
    add_wall(b, [left_end, right_end, 0.0], [1.0, 0, 0], WIDTH, [0, -1.0, 0])
    add_level(b, [-3.0, -half], [FIRST + 3.0, WIDTH])
    add_level(b, [left_end, half], [WIDTH, right_end - half])
    return Built(joined(b.parts), b.images)


def add_wall(b: Builder, start: list[float], along: list[float], length: float, inwards: list[float]) -> None:
    """Add a wall of ``length`` metres, seen from the side ``inwards`` (3,), with posters and doors."""
    way, normal = np.array(along), np.array(inwards)
    right = way if np.cross(way, [0, 0, 1.0]) @ normal > 0 else -way
    at = 0.0
    while at < length - 1e-9:
        wide = min(PANEL, length - at)
        foot = np.array(start) + at * way + (0 if right is way else wide) * way
        light = 0.95 if abs(normal[1]) > 0.5 else 0.85
        plaster = _plaster(float(b.rng.uniform(150, 190)))
        image = b.texture(plaster, wide, HEIGHT, 0.005)
        b.parts.append(quad(foot + [0, 0, HEIGHT], wide * right, [0, 0, -HEIGHT], image, light))
        _hang(b, foot + 0.012 * normal, right, wide, light)
        at += wide


def _plaster(grey: float) -> Paint:
    def paint(rng: Rng, shape: tuple[int, int]) -> Bytes:
        return painting.speckled(rng, shape, grey, 55.0, 5e-4)

    return paint


def _hang(b: Builder, foot: np.ndarray, right: np.ndarray, wide: float, light: float) -> None:
    """Posters side by side on a panel, and sometimes a door."""
    x = float(b.rng.uniform(0.15, 0.4))
    while x < wide - 0.5:
        if b.rng.random() < 0.22 and x < wide - 1.0:
            across, low, tall, paint = 0.9, 0.0, 2.05, painting.door
        else:
            across, tall = float(b.rng.uniform(0.4, 0.85)), float(b.rng.uniform(0.4, 1.0))
            low, paint = float(b.rng.uniform(1.0, 1.35)), painting.poster
        if x + across > wide - 0.05:
            break
        image = b.texture(paint, across, tall, 0.004)
        b.parts.append(
            quad(foot + x * right + [0, 0, low + tall], across * right, [0, 0, -tall], image, light)
        )
        x += across + float(b.rng.uniform(0.1, 0.45))


def add_level(b: Builder, corner: list[float], size: list[float]) -> None:
    """Floor and ceiling over a rectangle (2,) of ``size`` (2,), metres, in panels."""
    axis = 0 if size[0] > size[1] else 1
    at = 0.0
    while at < size[axis] - 1e-9:
        part = np.array(size)
        part[axis] = min(PANEL, size[axis] - at)
        start = np.array([*corner, 0.0])
        start[axis] += at
        x, y = np.array([part[0], 0, 0]), np.array([0, part[1], 0])
        floor = b.texture(lambda r, s: painting.tiles(r, s, 50), part[0], part[1], 0.008)
        b.parts.append(quad(start + y, x, -y, floor, 0.8))
        ceiling = b.texture(lambda r, s: painting.tiles(r, s, 60, 190.0), part[0], part[1], 0.012)
        b.parts.append(quad(start + [0, 0, HEIGHT], x, y, ceiling, 1.0))
        at += part[axis]


def path(rng: Rng) -> motion.Path:
    """A walk of twenty seconds at eye's height: straight, around the bend in an arc, straight."""
    radius, speed = 1.4, 1.1
    corner = FIRST - WIDTH / 2
    first, arc = corner - radius, radius * np.pi / 2
    shake = motion.tremor(rng, [0.012, 0.02, 0.01, 0.012, 0.012, 0.01], slowest=0.5)
    gaze = motion.tremor(rng, [0.12, 0.05], slowest=0.15, octaves=2)

    def smooth(t: Array) -> Array:
        s = speed * t
        angle = np.clip((s - first) / radius, 0.0, np.pi / 2)
        x = np.minimum(s, first) + radius * np.sin(angle)
        y = radius * (1 - np.cos(angle)) + np.maximum(s - first - arc, 0.0)
        # the eyes turn ahead of the feet
        ahead = np.clip((s + 0.9 - first) / (arc + 0.9), 0.0, 1.0)
        turn = np.pi / 2 * ahead * ahead * (3 - 2 * ahead)
        yaw, pitch = np.moveaxis(gaze(t), -1, 0)
        eye = np.stack([x, y, np.full_like(x, EYE)], -1)
        view = np.stack([np.cos(turn + yaw), np.sin(turn + yaw), pitch - 0.03], -1)
        return motion.looking(eye, eye + view)

    return motion.held(smooth, shake)

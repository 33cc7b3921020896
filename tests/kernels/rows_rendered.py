"""Inputs for the twins of the renderer: boxes on a floor, textured, before a camera."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vslam_ref.geometry.cameras import Fov
from vslam_ref.worlds.pictures import painted_wall, picture
from vslam_ref.worlds.rendered import motion, quads, raster, textures

Rng = np.random.Generator
SIZE = (32, 24)


def read_only(a: np.ndarray) -> np.ndarray:
    a = np.ascontiguousarray(a)
    a.setflags(write=False)
    return a


def before(rng: Rng, n: int) -> tuple[quads.Quads, textures.Textures, raster.RayTable, list[np.ndarray]]:
    """n boxes on a floor, two textures, the rays of a camera with a lens, and what is placed before it."""
    images = [picture(painted_wall(rng, 60, size), size=size) for size in ((64, 128), (128, 64))]
    boxes = [
        quads.box(rng.uniform(-1, 1, 2), rng.uniform(0.1, 0.8, 3), rng.uniform(0, 3), (0, 1, 0))
        for _ in range(n)
    ]
    things = quads.joined([quads.quad([-2.0, 2.0, 0.0], [4.0, 0, 0], [0, -4.0, 0], 1), *boxes])
    packed = textures.pack(images)
    rays = raster.ray_table(Fov(28.0, 28.0, 15.5, 11.5, 0.8), SIZE)
    T_cam_world = motion.looking(rng.uniform([-1, -3, 1], [1, -2, 2]), rng.uniform(-0.3, 0.3, 3))
    at = [read_only(a) for a in raster.placed(things, packed, T_cam_world, rays.span)]
    return things, packed, rays, at


def for_nearest(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    _, _, rays, at = before(rng, n)
    return rays.xn, *at


def some_rays(rng: Rng, rays: raster.RayTable, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rays within half a pixel of random pixels, (N, 2), and these pixels' columns and rows."""
    column, row = (rng.integers(0, most, 40 * n) for most in SIZE)
    shift = rng.uniform(-0.5, 0.5, (40 * n, 2))
    xn = rays.xn[row, column] + np.einsum("nij,nj->ni", rays.spread[row, column], shift)
    return xn, read_only(column), read_only(row)


def for_nearest_of(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    _, _, rays, at = before(rng, n)
    return *some_rays(rng, rays, n), *at


def for_shade(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    things, packed, rays, at = before(rng, n)
    xn, column, row = some_rays(rng, rays, n)
    quad, _ = raster.nearest_of(xn, column, row, *at)
    given = (rays.spread[row, column], quad, at[0], things.texture, things.light, packed.texels, packed.table)
    return xn, *(read_only(a) for a in given)


ROWS: dict[str, list[Callable[[Rng, int, int], tuple[Any, ...]]]] = {
    "rendered:nearest": [for_nearest],
    "rendered:nearest_of": [for_nearest_of],
    "rendered:shade": [for_shade],
}

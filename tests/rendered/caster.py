"""A slow ray caster that shares nothing with the renderer: rays in the own coordinates of every quad."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.worlds.rendered import RenderedScene

FOCAL, CENTRE = 525.0, np.array([319.5, 239.5])


class Met(NamedTuple):
    """Depth along a ray, number of the quad (-1: none), and where on it, 0 to 1."""

    depth: float
    quad: int
    share: np.ndarray


def cast(made: RenderedScene, k: int, uv: np.ndarray) -> list[Met]:
    """What rays through pixels (N, 2) of picture k meet first.

    A quad's own coordinates are the shares of its sides, and the way along its normal, where it is at 0.
    """
    T, things = made.T_cam_world[k], made.things(float(made.times[k]))
    R, eye = T[:3, :3].T, -T[:3, :3].T @ T[:3, 3]
    p, q = things.side[:, 0], things.side[:, 1]
    own_world = np.linalg.inv(np.stack([p, q, np.cross(p, q)], -1))
    xn = (uv - CENTRE) / FOCAL
    d = np.concatenate([xn, np.ones((len(xn), 1))], 1) @ R.T
    start = np.einsum("qij,qj->qi", own_world, eye - things.corner)
    way = np.einsum("qij,nj->nqi", own_world, d)
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = -start[:, 2] / way[..., 2]
        share = start[:, :2] + depth[..., None] * way[..., :2]
    hit = (depth > 0.01) & ((share >= 0) & (share <= 1)).all(-1)
    first = np.argmin(np.where(hit, depth, np.inf), 1)
    return [
        Met(depth[n, j], int(j), share[n, j]) if hit[n].any() else Met(np.inf, -1, np.zeros(2))
        for n, j in enumerate(first)
    ]


def texture(made: RenderedScene, number: int) -> np.ndarray:
    begin, height, width = made.textures.table[number, 0]
    image: np.ndarray = made.textures.texels[begin : begin + height * width].reshape(height, width)
    return image.astype(np.float64)


def point_grey(made: RenderedScene, met: Met) -> float:
    """Grey value at a point, between the four nearest texels of the finest level."""
    quads = made.quads
    image = texture(made, int(quads.texture[met.quad]))
    h, w = image.shape
    a, b = np.clip(met.share[0] * w - 0.5, 0, w - 1), np.clip(met.share[1] * h - 0.5, 0, h - 1)
    i, j = min(int(b), h - 2), min(int(a), w - 2)
    v, u = b - i, a - j
    four = image[i : i + 2, j : j + 2]
    return float(quads.light[met.quad] * (np.array([1 - v, v]) @ four @ np.array([1 - u, u])))

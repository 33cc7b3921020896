"""Inputs for the twins of the visual map: patches of a noisy picture, looked for around wrong places."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vslam_ref.features.corners import detect
from vslam_ref.features.templates import cut
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.systems.ptam.mapper.curve_search import Gates, with_bearings
from vslam_ref.systems.visual_map.visibility import _Known

from .rows_features import image, read_only

Rng = np.random.Generator


def _for_locate(rng: Rng, n: int, absolute: float, correlate: bool, first: bool) -> tuple[Any, ...]:
    """Places off by up to 3 pixels, half of them whole; templates of noise; flat ones; one at no place."""
    drawn = image(rng, n)
    found = detect(drawn, 12)
    xy = found.xy[rng.permutation(len(found.xy))[: 20 * n]]
    patch = cut(drawn, xy).patch.reshape(-1, 64)
    patch[::5] = rng.integers(0, 256, patch[::5].shape)
    patch[1::9] = 77
    uv = xy + rng.integers(-3, 4, xy.shape) * rng.choice([0.3, 1.0], (len(xy), 1))
    uv[2:4] = [[1e12, 3.0], [-50.0, 20.0]]
    picture, radius = read_only(drawn.reshape(-1)), rng.uniform(0, 9, len(xy))
    corners = read_only(found.xy), found.row_start
    return (picture, drawn.shape[1], *corners, read_only(patch), uv, radius, 0.5, absolute, correlate, first)


def for_locate(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return _for_locate(rng, n, 0.0, False, True)


def for_locate_by_corners(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return _for_locate(rng, n, 9000.0 * (n % 2), B % 2 == 0, False)


CAMERA = Pinhole(90.0, 80.0, 40.0, 30.0)
T_B_A = se3.exp([-0.3, 0.05, 0.1, 0.05, -0.1, 0.08])


def for_pinhole_rays(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """One pixel has no ray."""
    uv = rng.uniform(-20, 100, (8 * n, 2))
    uv[0] = [1e9, 3.0]
    return CAMERA.params, uv


def for_search_curve(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Corners of one picture, looked for in itself as if the camera had moved: some fit, some never."""
    drawn = read_only(image(rng, n))
    xy = detect(drawn, 15).xy
    a = with_bearings(CAMERA, xy[rng.permutation(len(xy))[: 20 * n]], 0)
    a.valid[:1] = False
    patch = read_only(cut(drawn, a.xy).patch.reshape(-1, 64))
    gates = Gates(B % 3, 0.2, 2.0, 1.5 if B % 2 else 0.5)
    return patch, a, drawn, with_bearings(CAMERA, xy, 0), T_B_A, gates


def known(rng: Rng, n: int) -> _Known:
    """Points before three keyframes, with slopes of a pinhole."""
    count = 20 * n
    T_kf_world, level = se3.exp(rng.normal(0, 0.1, (3, 6))), rng.integers(0, 4, count)
    X, uv = rng.uniform([-2, -2, 1], [2, 2, 8], (count, 3)), rng.uniform(0, 60, (count, 2))
    slope = np.array([[1 / 90, 0], [0, 1 / 80]]) + rng.normal(0, 1e-3, (count, 2, 2))
    return _Known(T_kf_world, X, rng.integers(0, 3, count), level, uv, slope)


def for_pinhole_visible(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Nearly all points, in any order, from a place near the keyframes."""
    there = known(rng, n)
    number = rng.permutation(len(there.X_world))[1:]
    return there, se3.exp(rng.normal(0, 0.1, 6)), number, CAMERA.params, 60, 80, 4


def for_read_templates(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Three pictures one under another; some patches leave theirs."""
    there, each = known(rng, n), B % 2
    images = np.concatenate([image(rng, n)[:40] for _ in range(3)])
    count = len(there.slope)
    A, level = np.eye(2) + rng.normal(0, 0.2, (count, 2, 2)), rng.integers(0, 2, count)
    filled = np.zeros((count, 64), np.uint8), np.zeros(count, np.bool_)
    at = there.source_kf, there.source_level, there.source_uv
    return read_only(images.reshape(-1)), images.shape[1], 40, each, *at, A, level, *filled


ROWS: dict[str, list[Callable[[Rng, int, int], tuple[Any, ...]]]] = {
    "curves:pinhole_rays": [for_pinhole_rays],
    "curves:search_curve": [for_search_curve],
    "visibility:pinhole_visible": [for_pinhole_visible],
    "visibility:read_templates": [for_read_templates],
    "looking:locate": [for_locate, for_locate_by_corners],
}

"""FREAK in plain loops: the pattern, one mean, one direction, one descriptor, as the paper reads."""

from __future__ import annotations

import math

from vslam_ref.arrays import IntArray
from vslam_ref.features.levels import Bytes

Field = tuple[float, float, float]
"""Centre x, y and half side of a field, pixels at scale 1."""


def pattern() -> list[Field]:
    """43 fields: seven rings of six, every second one turned by 30 degrees, and the middle."""
    fields = []
    r = 22 * 2 / 3  # its field reaches r / 2 further: 22 pixels
    for ring in range(7):
        for k in range(6):
            phi = math.radians(60 * k + 30 * (ring % 2))
            fields.append((r * math.cos(phi), r * math.sin(phi), r / 2))
        innermost = r
        r /= math.sqrt(2)  # sizes grow exponentially with the distance from the middle
    return [*fields, (0.0, 0.0, innermost / 2)]


def symmetric_pairs() -> list[tuple[int, int]]:
    """45 pairs of one ring each: opposite ones of all rings, and those two steps apart of the outer four."""
    pairs = []
    for ring in range(7):
        for k in range(6):
            if k < 3:
                pairs.append((6 * ring + k, 6 * ring + k + 3))
            if ring < 4:
                pairs.append((6 * ring + k, 6 * ring + (k + 2) % 6))
    return pairs


def mean(image: Bytes, x: float, y: float, half: float) -> float:
    """Mean grey level of a box; a pixel counts with the part of its square that the box covers.

    Edges are rounded to 64ths of a pixel, and a box is at least one pixel wide.
    """
    side = max(round(128 * half), 64)
    left, top = round(64 * (x + 0.5) - side / 2), round(64 * (y + 0.5) - side / 2)
    total = 0
    for j in range(top // 64, (top + side - 1) // 64 + 1):
        high = min(top + side, 64 * j + 64) - max(top, 64 * j)
        for i in range(left // 64, (left + side - 1) // 64 + 1):
            wide = min(left + side, 64 * i + 64) - max(left, 64 * i)
            total += high * wide * int(image[j, i])
    return total / side**2


def means(image: Bytes, u: float, v: float, scale: float, theta: float) -> list[float]:
    """Grey levels of all fields around pixel (u, v); centres turn by theta, radians, boxes stay upright."""
    c, s = math.cos(theta), math.sin(theta)
    return [
        mean(image, u + scale * (c * x - s * y), v + scale * (s * x + c * y), scale * half)
        for x, y, half in pattern()
    ]


def direction(level: list[float]) -> tuple[float, float]:
    """Mean over symmetric pairs of difference times normalised offset, in grey levels: paper, equation 4."""
    p, ox, oy = pattern(), 0.0, 0.0
    for i, j in symmetric_pairs():
        dx, dy = p[i][0] - p[j][0], p[i][1] - p[j][1]
        length = math.hypot(dx, dy)
        ox += (level[i] - level[j]) * dx / length / 45
        oy += (level[i] - level[j]) * dy / length / 45
    return ox, oy


def angle(image: Bytes, u: float, v: float, scale: float) -> float:
    """Angle of the direction, radians, from x towards y; 0 where a patch has none."""
    ox, oy = direction(means(image, u, v, scale, 0.0))
    return math.atan2(oy, ox) if math.hypot(ox, oy) >= 1e-9 else 0.0


def descriptor(image: Bytes, u: float, v: float, scale: float, theta: float, pairs: IntArray) -> list[int]:
    """Bits: 1 where the first field of a pair (2,) is brighter than the second: paper, equations 1 and 2."""
    level = means(image, u, v, scale, theta)
    return [int(level[i] > level[j]) for i, j in pairs.tolist()]

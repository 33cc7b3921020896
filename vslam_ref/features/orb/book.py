"""ORB in plain loops: one octave, one patch, one descriptor, one tree, as chapter 14 reads them."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from vslam_ref.arrays import IntArray
from vslam_ref.features.levels import Bytes

Corner = tuple[int, int, int]
"""x, y and FAST's score."""


def octave(image: Bytes, s: float) -> Bytes:
    """Next octave: its pixels are s times as wide, and lie between four pixels of this one."""
    H, W = image.shape
    out = np.zeros((int(H / s), int(W / s)), np.uint8)
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            y, x = s * (i + 0.5) - 0.5, s * (j + 0.5) - 0.5  # eq-orb-octave
            y0, x0 = int(y), int(x)
            y1, x1 = min(y0 + 1, H - 1), min(x0 + 1, W - 1)
            b, a = y - y0, x - x0
            top = (1 - a) * image[y0, x0] + a * image[y0, x1]
            low = (1 - a) * image[y1, x0] + a * image[y1, x1]
            out[i, j] = math.floor((1 - b) * top + b * low + 0.5)
    return out


def angle(image: Bytes, x: int, y: int) -> float:
    """Direction of the intensity centroid, radians, from x towards y."""
    m10 = m01 = 0
    for v in range(-15, 16):
        for u in range(-15, 16):
            if math.hypot(u, v) <= 15.5:
                m10 += u * int(image[y + v, x + u])  # eq-orb-moments
                m01 += v * int(image[y + v, x + u])
    return math.atan2(m01, m10)  # eq-orb-angle


def smoothed(image: Bytes, x: int, y: int) -> int:
    """Grey level of the smoothed picture: a Gaussian of two pixels on 7 x 7, in whole numbers."""
    w = [18, 34, 49, 54, 49, 34, 18]  # round(256 g), and in the middle what is left of 256
    total = 0
    for j in range(7):
        for i in range(7):
            total += w[i] * w[j] * int(image[y + j - 3, x + i - 3])  # eq-orb-smooth
    return (total + 2**15) // 2**16


def descriptor(image: Bytes, x: int, y: int, theta: float, pairs: IntArray) -> list[int]:
    """Bits of a patch: 1 where the first pixel of a pair (4,), turned by theta, is darker than the second."""
    c, s = math.cos(theta), math.sin(theta)
    bits = []
    for ax, ay, bx, by in pairs.tolist():
        p = smoothed(image, x + round(c * ax - s * ay), y + round(s * ax + c * ay))  # eq-orb-steer
        q = smoothed(image, x + round(c * bx - s * by), y + round(s * bx + c * by))
        bits.append(int(p < q))  # eq-orb-test
    return bits


class Leaf:
    """A rectangle of the picture: its first pixel, its size, and the corners in it."""

    def __init__(self, x: int, y: int, w: int, h: int, corners: list[Corner]) -> None:
        self.x, self.y, self.w, self.h = x, y, w, h
        self.corners = [c for c in corners if x <= c[0] < x + w and y <= c[1] < y + h]

    def four(self) -> list[Leaf]:
        """Its quarters, those of odd sizes larger on the left and above; empty ones are left out."""
        w, h = (self.w + 1) // 2, (self.h + 1) // 2
        quarters = [
            Leaf(self.x, self.y, w, h, self.corners),
            Leaf(self.x + w, self.y, self.w - w, h, self.corners),
            Leaf(self.x, self.y + h, w, self.h - h, self.corners),
            Leaf(self.x + w, self.y + h, self.w - w, self.h - h, self.corners),
        ]
        return [q for q in quarters if q.corners]


def spread(corners: list[Corner], width: int, height: int, wanted: int) -> list[Corner]:
    """Split where there are most corners until there are enough nodes, and keep the best of each."""
    squares = max(math.floor(width / height + 0.5), 1)
    edge = [math.ceil(k * width / squares) for k in range(squares + 1)]
    nodes = [Leaf(a, 0, b - a, height, corners) for a, b in pairwise(edge)]
    nodes = [n for n in nodes if n.corners]
    while len(nodes) < min(wanted, len(corners)):
        fullest = sorted((n for n in nodes if len(n.corners) > 1), key=lambda n: -len(n.corners))
        count, split = len(nodes), []
        for node in fullest:
            if count >= wanted:
                break
            split.append(node)
            count += len(node.four()) - 1
        nodes = [part for n in nodes for part in (n.four() if n in split else [n])]
    best = [max(n.corners, key=lambda c: c[2]) for n in nodes]  # eq-orb-quadtree
    return sorted(best, key=lambda c: (-c[2], corners.index(c)))[:wanted]


def hamming(a: Bytes, b: Bytes) -> int:
    """Bits in which two descriptors differ."""
    return sum((int(p) ^ int(q)).bit_count() for p, q in zip(a, b, strict=True))  # eq-hamming

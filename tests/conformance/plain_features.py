"""Chapter 08 in plain NumPy, and its known mistakes on demand.

FAST walks around the circle and counts, patches are read with weights of four pixels, sums are arrays' sums:
none of it is the generator's way, and none the library's.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Array = Any
ANGLE = np.arange(16) * np.pi / 8
CIRCLE = np.rint(3.1 * np.stack([np.sin(ANGLE), np.cos(ANGLE)], 1)).astype(int)


def _longest(flags: Array, closed: bool) -> int:
    longest = run = 0
    for flag in [*flags, *flags] if closed else flags:
        run = run + 1 if flag else 0
        longest = max(longest, run)
    return min(longest, 16)


def _is_corner(image: Array, x: int, y: int, t: float, arc: float, wrong: str | None) -> bool:
    d = np.array([image[y + j, x + i] - image[y, x] for i, j in CIRCLE])
    t, arc = t - 0.5 * (wrong == "not-strict"), arc - (wrong == "arc-one-short")
    closed = wrong != "arc-not-closed"
    kinds = [np.abs(d) > t] if wrong == "signs-mixed" else [d > t, d < -t]
    return any(_longest(flags, closed) >= arc for flags in kinds)


def segment_test(image: Array, threshold: float, arc: float, wrong: str | None = None) -> Array:
    height, width = image.shape
    found = [
        [x, y]
        for y in range(3, height - 3)
        for x in range(3, width - 3)
        if _is_corner(image, x, y, threshold, arc, wrong)
    ]
    return np.array(found)[:, ::-1] if wrong == "rows-for-columns" else found


def corner_score(image: Array, arc: float, wrong: str | None = None) -> float:
    """Half the thresholds at a time."""
    low, high = -1, 255
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if _is_corner(image, 3, 3, middle, arc, wrong) else (low, middle)
    if wrong == "score-is-sum" and low >= 0:
        d = np.array([image[3 + j, 3 + i] - image[3, 3] for i, j in CIRCLE])
        arcs = np.array([np.roll(d, -k)[: int(arc)] for k in range(16)])
        best = np.maximum(arcs.min(1), -arcs.max(1)).argmax()
        return float(np.abs(arcs[best]).sum())
    return low + (wrong == "score-first-failure")


def halve(image: Array, wrong: str | None = None) -> Array:
    if wrong == "subsampled":
        return image[: len(image) // 2 * 2 : 2, : image.shape[1] // 2 * 2 : 2]
    height, width = (n // 2 for n in image.shape)
    mean = image[: 2 * height, : 2 * width].reshape(height, 2, width, 2).mean((1, 3))
    return np.floor(mean + (0.0 if wrong == "rounded-down" else 0.5))


def _half(level: float, wrong: str | None) -> float:
    return {"half-pixel-forgotten": 0, "half-pixel-subtracted": -1}.get(wrong or "", 1) * (2.0**level - 1) / 2


def finest_from_level(uv: Array, level: float, wrong: str | None = None) -> Array:
    return 2.0**level * uv + _half(level, wrong)


def level_from_finest(uv: Array, level: float, wrong: str | None = None) -> Array:
    return (uv - _half(level, wrong)) / 2.0**level


def zmssd(a: Array, b: Array, wrong: str | None = None) -> float:
    """Sum of squares less the square of the sum over n."""
    d = (a - b).ravel()
    value = d @ d - (0.0 if wrong == "mean-forgotten" else d.sum() ** 2 / d.size)
    return float(value / (d.size if wrong == "mean-of-squares" else 1))


def zncc(a: Array, b: Array, wrong: str | None = None) -> float:
    if wrong == "sum-of-products":
        return float(np.sum(a * b) / np.sqrt(np.sum(a * a) * np.sum(b * b)))
    return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])


def shi_tomasi(image: Array, wrong: str | None = None) -> float:
    gx = (image[1:-1, 2:] - image[1:-1, :-2]).ravel() / 2
    gy = (image[2:, 1:-1] - image[:-2, 1:-1]).ravel() / 2
    G = np.stack([gx, gy]) * (2 if wrong == "whole-differences" else 1)
    tensor = G @ G.T / (1 if wrong == "window-sum" else G.shape[1])
    if wrong == "harris":
        return float(np.linalg.det(tensor) - 0.04 * np.trace(tensor) ** 2)
    return float(np.linalg.eigvalsh(tensor)[-1 if wrong == "larger-eigenvalue" else 0])


def warp(image: Array, uv: Array, M: Array, wrong: str | None = None) -> Array:
    maps = {"warp-inverted": np.round(np.linalg.inv(M), 6), "warp-transposed": M.T}
    first = -3 if wrong == "patch-off-centre" else -4
    d = np.stack(np.meshgrid(np.arange(first, first + 8), np.arange(first, first + 8)), -1)
    at = uv + d @ maps.get(wrong or "", M).T
    height, width = image.shape
    if (at < 0).any() or (at > [width - 1, height - 1]).any():
        raise ValueError("outside")
    if wrong == "nearest-pixel":
        x, y = np.floor(at + 0.5).astype(int).transpose(2, 0, 1)
        return image[y, x]
    # the four nearest pixels, each weighed by what is left to the other side
    weights_x = np.maximum(0, 1 - np.abs(at[..., 0, None] - np.arange(width)))
    weights_y = np.maximum(0, 1 - np.abs(at[..., 1, None] - np.arange(height)))
    return np.floor(np.einsum("ijy,yx,ijx->ij", weights_y, image, weights_x) + 0.5)


def sampling(A: Array, target_level: float, source_level: float, wrong: str | None = None) -> Array:
    octaves = target_level - source_level
    if wrong == "not-inverted":
        return A * 2.0**octaves
    return np.linalg.solve(A, np.eye(2)) * 2.0 ** (-octaves if wrong == "levels-swapped" else octaves)


PROGRAM = {
    "features.segment_test": segment_test,
    "features.corner_score": corner_score,
    "features.halve": halve,
    "features.finest_from_level": finest_from_level,
    "features.level_from_finest": level_from_finest,
    "features.zmssd": zmssd,
    "features.zncc": zncc,
    "features.shi_tomasi": shi_tomasi,
    "features.warp": warp,
    "features.sampling": sampling,
}

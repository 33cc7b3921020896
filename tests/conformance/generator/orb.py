"""ORB: moments and direction of a patch, smoothing, and comparisons of turned pairs, in whole numbers.

Turned offsets are rounded from 50 digits; pairs whose offset is as near as 1e-6 to a half are not asked.
"""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.draws import digits
from generator.features import Image
from generator.features import _case as case

TOPIC, CHAPTER = "orb", 14
RADIUS, MIDDLE = 15, 22
WEIGHTS = (18, 34, 49, 54, 49, 34, 18)

NOTES = {
    "moments-exchanged": ("your moments are exchanged: m10 is the one with x", "(m01, m10)"),
    "y-up": ("your y points up; rows are counted downwards", "-y I(x, y)"),
    "square-window": ("your window is a square; it is a disc", "|x|, |y| <= 15"),
    "disc-too-small": (
        "your disc ends at 15; pixels whose distance rounds to 15 belong to it",
        "x^2 + y^2 <= 15^2",
    ),
    "about-the-corner": ("you count pixels from the patch's corner; they count from its centre", "x + 15"),
    "one-half-only": ("your angle has only half of the circle", "atan(m01 / m10)"),
    "arguments-exchanged": ("your angle counts from y; it counts from x towards y", "atan2(m10, m01)"),
    "rounded-down": ("your smoothed grey levels are rounded down; half goes up", "floor(sum / 2^16)"),
    "border-repeated": (
        "you repeat the pixel at the border beyond it; the picture is mirrored there",
        "I(0) for I(1) at -1",
    ),
    "border-twice": ("your mirror image has the border's pixel twice", "I(0), I(1) at -1, -2"),
    "all-alike": ("your smoothing weighs all 49 pixels alike", "1/49 sum I"),
    "steered-back": ("you turn the pairs by the opposite angle", "R_-theta a"),
    "not-steered": ("you do not turn the pairs", "a for R_theta a"),
    "not-smoothed": ("you compare grey levels as they are; the picture is smoothed first", "I for I~"),
    "brighter": ("your bit is set where the first pixel is the brighter one", "I~(a) > I~(b)"),
    "equal-counts": ("your bit is set where both pixels are alike", "I~(a) <= I~(b)"),
    "bit-order": ("your first comparison is the byte's highest bit; it is the lowest", "2^(7 - k)"),
    "rows-for-columns": ("you read pairs as (y, x)", "(y, x) of a"),
    "offsets-cut": ("your turned offsets lose their fraction; they are rounded", "trunc(R_theta a)"),
    "bytes-counted": ("you count bytes that differ; bits count", "sum [a_k != b_k] of bytes"),
    "bits-in-common": ("you count bits that agree", "256 - d"),
    "sum-of-differences": ("you add up differences of bytes", "sum |a_k - b_k|"),
}
OF_MOMENTS = ("moments-exchanged", "y-up", "square-window", "disc-too-small", "about-the-corner")
OF_ANGLE = ("y-up", "square-window", "disc-too-small", "one-half-only", "arguments-exchanged")
OF_SMOOTH = ("rounded-down", "border-repeated", "border-twice", "all-alike")
OF_BITS = (
    *("steered-back", "not-steered", "not-smoothed", "brighter", "equal-counts", "bit-order"),
    *("rows-for-columns", "offsets-cut"),
)
WHOLE = "whole numbers, from the definition"


def build(rng: np.random.Generator) -> Topic:
    """All groups of directions and descriptors."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    exact = tolerance(1e-15, "whole numbers", float32=1e-6)
    for flag, count in (("", 3), ("dim", 2), ("flat", 1)):
        cases = []
        for _ in range(count):
            image = _patch(rng, flag)
            wrong = {note: list(_moments(image, note)) for note in OF_MOMENTS}
            cases.append(case({"image": image}, "moments", list(_moments(image)), wrong))
        topic.group("orb.moments", "eq-orb-moments", WHOLE, exact, cases, flags=flag)
    fine = tolerance(1e-14, "one arc tangent of whole numbers: a few eps")
    for flag, count in (("", 6), ("flat", 1)):
        cases = []
        for _ in range(count):
            image = _patch(rng, flag)
            wrong = {} if flag else {note: _angle(image, note) for note in OF_ANGLE}
            cases.append(case({"image": image}, "angle", _angle(image), wrong))
        topic.group("orb.angle", "eq-orb-angle", "arc tangent in 50 digits", fine, cases, flags=flag)
    cases = []
    for size in ((9, 9), (7, 12), (4, 5), (11, 8)):
        image = rng.integers(0, 256, size).tolist()
        wrong = {note: _smooth(image, note) for note in OF_SMOOTH}
        cases.append(case({"image": image}, "image", _smooth(image), wrong))
    topic.group("orb.smooth", "eq-orb-smooth", WHOLE, exact, cases)
    for flag, count in (("", 4), ("spot", 2), ("upright", 1)):
        cases = [_descriptor(rng, flag) for _ in range(count)]
        topic.group("orb.descriptor", "eq-orb-test", WHOLE, exact, cases, flags=flag)
    cases = [_hamming(rng, n) for n in (32, 32, 32, 8)]
    topic.group("orb.hamming", "eq-hamming", WHOLE, exact, cases)
    return topic


def _patch(rng: np.random.Generator, flag: str) -> Image:
    """Thirty-one by thirty-one grey levels; ``dim`` with few of them, ``flat`` with one."""
    if flag == "flat":
        return np.full((31, 31), 90).tolist()  # type: ignore[no-any-return]
    slope = rng.uniform(-3, 3, 2)
    y, x = np.mgrid[-15:16, -15:16]
    image = 128 + slope[0] * x + slope[1] * y + rng.uniform(-30, 30, (31, 31))
    image = np.clip(np.rint(image / 40 if flag == "dim" else image), 0, 255)
    return image.astype(int).tolist()  # type: ignore[no-any-return]


def _moments(image: Image, wrong: str = "") -> tuple[int, int]:
    m10 = m01 = 0
    from_zero = RADIUS if wrong == "about-the-corner" else 0
    for y in range(-RADIUS, RADIUS + 1):
        for x in range(-RADIUS, RADIUS + 1):
            # 4 (x^2 + y^2) <= 31^2: the distance is at most 15.5
            inside = 4 * (x * x + y * y) <= (2 * RADIUS + (wrong != "disc-too-small")) ** 2
            if inside or wrong == "square-window":
                grey = image[y + RADIUS][x + RADIUS]
                m10 += (x + from_zero) * grey
                m01 += (y + from_zero) * grey
    if wrong == "y-up":
        m01 = -m01
    return (m01, m10) if wrong == "moments-exchanged" else (m10, m01)


def _angle(image: Image, wrong: str = "") -> float:
    m10, m01 = (mpf(m) for m in _moments(image, wrong))
    if wrong == "one-half-only":
        return float(mpmath.atan(m01 / m10))
    if wrong == "arguments-exchanged":
        m10, m01 = m01, m10
    return float(mpmath.atan2(m01, m10)) if m10 or m01 else 0.0


def _at(n: int, i: int, wrong: str) -> int:
    """Pixel of n that stands at i, beyond the border as well."""
    if wrong == "border-repeated":
        return min(max(i, 0), n - 1)
    twice = wrong == "border-twice"
    if i < 0:
        return -i - twice
    return 2 * n - 2 - i + twice if i >= n else i


def _smooth(image: Image, wrong: str = "") -> Image:
    height, width = len(image), len(image[0])
    if wrong == "all-alike":
        weight, half, whole = (1,) * 7, 49 // 2, 49
    else:
        weight, half, whole = WEIGHTS, 0 if wrong == "rounded-down" else 2**15, 2**16
    found = []
    for y in range(height):
        row = []
        for x in range(width):
            total = half
            for j, g in enumerate(weight):
                line = image[_at(height, y + j - 3, wrong)]
                total += g * sum(h * line[_at(width, x + i - 3, wrong)] for i, h in enumerate(weight))
            row.append(total // whole)
        found.append(row)
    return found


def _descriptor(rng: np.random.Generator, flag: str) -> dict[str, Any]:
    """A patch of 45 x 45 pixels, an angle, and 32 pairs of pixels of its disc of radius 18."""
    angle = 0.0 if flag == "upright" else float(digits(rng.uniform(0.3, 3.0) * rng.choice([-1, 1])))
    side = 2 * MIDDLE + 1
    if flag == "spot":  # dark but for one bright spot: many comparisons of equals
        image = np.full((side, side), 20)
        x, y = rng.integers(14, 24, 2)
        image[y : y + 9, x : x + 9] = 200
    else:
        image = rng.integers(0, 256, (side, side))
    pairs: list[list[int]] = []
    while len(pairs) < 32:
        ax, ay, bx, by = (int(v) for v in rng.integers(-13, 14, 4))
        if (ax, ay) != (bx, by) and _clear(ax, ay, angle) and _clear(bx, by, angle):
            pairs.append([ax, ay, bx, by])
    grey = image.tolist()
    inputs = {"image": grey, "pairs": pairs, "angle": angle}
    wrong = {note: _bits(grey, pairs, angle, note) for note in OF_BITS}
    return case(inputs, "bytes", _bits(grey, pairs, angle), wrong)


def _turned(x: int, y: int, angle: float) -> tuple[Any, Any]:
    c, s = mpmath.cos(mpf(angle)), mpmath.sin(mpf(angle))
    return c * x - s * y, s * x + c * y


def _clear(x: int, y: int, angle: float) -> bool:
    """Whether rounding does not hang on the last digits."""
    return all(abs(v - mpmath.floor(v) - mpf("0.5")) > 1e-6 for v in _turned(x, y, angle))


def _bits(image: Image, pairs: list[list[int]], angle: float, wrong: str = "") -> list[int]:
    grey = image if wrong == "not-smoothed" else _smooth(image)
    angle = {"steered-back": -angle, "not-steered": 0.0}.get(wrong, angle)

    def level(x: int, y: int) -> int:
        if wrong == "rows-for-columns":
            x, y = y, x
        u, v = (int(w) if wrong == "offsets-cut" else int(mpmath.nint(w)) for w in _turned(x, y, angle))
        return grey[MIDDLE + v][MIDDLE + u]

    found = [0] * (len(pairs) // 8)
    for k, (ax, ay, bx, by) in enumerate(pairs):
        a, b = level(ax, ay), level(bx, by)
        bit = a > b if wrong == "brighter" else a <= b if wrong == "equal-counts" else a < b
        found[k // 8] += int(bit) << (7 - k % 8 if wrong == "bit-order" else k % 8)
    return found


def _hamming(rng: np.random.Generator, n: int) -> dict[str, Any]:
    a, b = rng.integers(0, 256, (2, n)).tolist()
    pairs = list(zip(a, b, strict=True))
    right = sum((p ^ q).bit_count() for p, q in pairs)
    wrong = {
        "bytes-counted": sum(p != q for p, q in pairs),
        "bits-in-common": 8 * n - right,
        "sum-of-differences": sum(abs(p - q) for p, q in pairs),
    }
    return case({"a": a, "b": b}, "distance", right, wrong)

"""Image features: FAST, levels, patches and their comparison, in whole numbers and fractions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from math import floor
from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.draws import digits

TOPIC, CHAPTER = "features", 8
Image = list[list[int]]

# The 16 pixels whose distance from the centre rounds to 3, by their angle from below to the right.
RING = [(0, 3), (1, 3), (2, 2), (3, 1), (3, 0), (3, -1), (2, -2), (1, -3)]
RING += [(-x, -y) for x, y in RING]

NOTES = {
    "arc-one-short": ("your arc is one pixel short: N - 1 in a row are enough for you", "N - 1 for N"),
    "arc-not-closed": (
        "your arc does not run on from the last pixel of the circle to the first",
        "starts 0 to 16 - N only",
    ),
    "not-strict": ("your pixels of an arc may differ by the threshold itself; it must be more", ">= for >"),
    "signs-mixed": (
        "your arc may be brighter in one part and darker in another",
        "|I(p) - I(c)| > t for all pixels of an arc",
    ),
    "rows-for-columns": ("your corners are (row, column); (x, y) was asked for", "(y, x)"),
    "score-first-failure": (
        "your score is the smallest threshold at which the pixel is no corner; one less was asked for",
        "max min difference",
    ),
    "score-is-sum": ("your score is the sum of the differences of the best arc", "sum |I(p) - I(c)|"),
    "subsampled": ("your coarser level keeps every second pixel; it is the mean of four", "I(2x, 2y)"),
    "rounded-down": ("your mean of four is rounded down; half goes up", "floor(sum / 4)"),
    "half-pixel-forgotten": (
        "you scale pixels of a level by 2^l: their centres are half a pixel further, of each level",
        "2^l u",
    ),
    "half-pixel-subtracted": ("your half pixel has the other sign", "2^l u - (2^l - 1)/2"),
    "mean-forgotten": ("your patches keep their means: brightness counts", "sum (a - b)^2"),
    "mean-of-squares": ("your sum is divided by the number of pixels", "sum / n"),
    "sum-of-products": ("your correlation keeps the means", "sum a b / (sum a^2 sum b^2)^(1/2)"),
    "larger-eigenvalue": ("you give the larger eigenvalue: an edge has it, too", "(a + c + root)/2"),
    "harris": ("you give Harris's measure", "det - 0.04 trace^2"),
    "whole-differences": (
        "your slopes are I(x+1) - I(x-1), twice the slope: four times the eigenvalue",
        "g = I(x+1) - I(x-1)",
    ),
    "window-sum": ("your tensor is the sum over the window; it is the mean", "sum g g^T"),
    "warp-inverted": ("you read the patch through the inverse of M", "u + M^-1 d"),
    "warp-transposed": ("you read the patch through the transpose of M", "u + M^T d"),
    "nearest-pixel": (
        "you take the nearest pixel; between pixels grey levels are interpolated",
        "I(round(x))",
    ),
    "patch-off-centre": ("your patch begins 3 pixels before its pixel; it begins 4 before", "d from -3 to 4"),
    "not-inverted": ("your sampling is A itself: it leads from the source to the target", "2^(t - s) A"),
    "levels-swapped": ("your factor of the levels is turned over", "2^(s - t) A^-1"),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups of image features."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    _corners(topic, rng)
    _levels(topic, rng)
    _comparisons(topic, rng)
    _eigenvalues(topic, rng)
    _patches(topic, rng)
    return topic


def _case(inputs: dict[str, Any], name: str, right: Any, wrong: dict[str, Any]) -> dict[str, Any]:
    """A case, with the mistakes whose answers differ from the right one and from each other."""
    kept: dict[str, Any] = {}
    for note, value in wrong.items():
        if all(_differ(value, other) for other in (right, *kept.values())):
            kept[note] = value
    case: dict[str, Any] = {"inputs": inputs, "expected": {name: right}}
    return {**case, "mistakes": {n: {name: v} for n, v in kept.items()}} if kept else case


def _differ(a: Any, b: Any) -> bool:
    p, q = np.asarray(a, np.float64), np.asarray(b, np.float64)
    if p.shape != q.shape:
        return True
    return bool(np.abs(p - q).max(initial=0.0) > 1e-6 * max(1.0, np.abs(p).max(initial=0.0)))


# -- FAST ------------------------------------------------------------------------------------------


def _differences(image: Image, x: int, y: int) -> list[int]:
    return [image[y + dy][x + dx] - image[y][x] for dx, dy in RING]


def _arcs(around: list[int], arc: int, closed: bool = True) -> Iterator[list[int]]:
    for start in range(16 if closed else 17 - arc):
        yield [around[(start + k) % 16] for k in range(arc)]


def _corner(around: list[int], t: int, arc: int, wrong: str = "") -> bool:
    arc -= wrong == "arc-one-short"
    least = t if wrong == "not-strict" else t + 1
    for part in _arcs(around, arc, wrong != "arc-not-closed"):
        if wrong == "signs-mixed" and all(abs(d) >= least for d in part):
            return True
        if all(d >= least for d in part) or all(d <= -least for d in part):
            return True
    return False


def _found(image: Image, t: int, arc: int, wrong: str = "") -> list[list[int]]:
    places = [(x, y) for y in range(3, len(image) - 3) for x in range(3, len(image[0]) - 3)]
    found = [[x, y] for x, y in places if _corner(_differences(image, x, y), t, arc, wrong)]
    return [[y, x] for x, y in found] if wrong == "rows-for-columns" else found


def _score(around: list[int], arc: int) -> int:
    return max([t for t in range(255) if _corner(around, t, arc)], default=-1)


def _ring_image(rng: np.random.Generator, t: int, length: int, kind: str) -> Image:
    """Seven by seven grey levels: an arc of so many pixels, brighter or darker than the centre."""
    centre, sign, start = int(rng.integers(90, 160)), int(rng.choice([-1, 1])), int(rng.integers(16))
    image = (centre + rng.integers(-t // 2, t // 2 + 1, (7, 7))).tolist()
    image[3][3] = centre
    for k in range(length):
        more = t + 1 + int(rng.integers(0, 25))
        if kind == "equal" and k == length // 2:
            more = t
        dx, dy = RING[(start + k) % 16]
        turned = -sign if kind == "mixed" and k >= length // 2 else sign
        image[3 + dy][3 + dx] = centre + turned * more
    return image  # type: ignore[no-any-return]


NOTES_OF_FAST = ("arc-one-short", "arc-not-closed", "not-strict", "signs-mixed", "rows-for-columns")


def _corners(topic: Topic, rng: np.random.Generator) -> None:
    exact = tolerance(1e-15, "whole numbers", float32=1e-6)
    for flag in ("whole_arc", "one_short", "equal", "mixed"):
        cases = []
        for k in range(12):
            arc, t = 9 + k % 4, int(rng.integers(8, 40))
            kinds = [(arc - (flag == "one_short"), flag), (arc, "whole_arc"), (arc + 1, flag)]
            blocks = [_ring_image(rng, t, *kind) for kind in kinds]
            image = [a + b + c for a, b, c in zip(*blocks, strict=True)]
            wrong = {note: _found(image, t, arc, note) for note in NOTES_OF_FAST}
            inputs = {"image": image, "threshold": t, "arc": arc}
            cases.append(_case(inputs, "xy", _found(image, t, arc), wrong))
        topic.group("features.segment_test", "eq-segment-test", "all starts of an arc at all pixels", exact,
                    cases, flags=(flag,))  # fmt: skip
    for flag in ("whole_arc", "one_short"):
        cases = [_one_score(rng, 9 + k % 4, flag) for k in range(12)]
        topic.group("features.corner_score", "eq-corner-score", "all thresholds, from the definition", exact,
                    cases, flags=(flag,))  # fmt: skip


def _one_score(rng: np.random.Generator, arc: int, flag: str) -> dict[str, Any]:
    image = _ring_image(rng, 20, arc - (flag == "one_short"), flag)
    around = _differences(image, 3, 3)
    best = max(_arcs(around, arc), key=lambda part: max(min(part), -max(part)))
    right = _score(around, arc)
    wrong = {
        "arc-one-short": _score(around, arc - 1),
        "score-first-failure": right + 1,
        "score-is-sum": sum(abs(d) for d in best) if right >= 0 else -1,
    }
    return _case({"image": image, "arc": arc}, "score", right, wrong)


# -- levels ----------------------------------------------------------------------------------------


def _levels(topic: Topic, rng: np.random.Generator) -> None:
    exact = tolerance(1e-15, "whole numbers", float32=1e-6)
    cases = []
    for k in range(12):
        image = rng.integers(0, 256, (4 + k % 3, 4 + k % 4)).tolist()
        rows, columns = range(len(image) // 2), range(len(image[0]) // 2)
        sums = [[_block(image, 2 * x, 2 * y) for x in columns] for y in rows]
        wrong = {
            "subsampled": [[image[2 * y][2 * x] for x in columns] for y in rows],
            "rounded-down": [[s // 4 for s in row] for row in sums],
        }
        right = [[(s + 2) // 4 for s in row] for row in sums]
        cases.append(_case({"image": image}, "image", right, wrong))
    topic.group("features.halve", "eq-pyramid", "whole numbers", exact, cases)
    few = tolerance(4e-16, "a product by a power of two, and one sum", float32=1e-6)
    for name in ("features.finest_from_level", "features.level_from_finest"):
        cases = [_one_place(rng, name, 1 + k % 4) for k in range(12)]
        topic.group(name, "eq-level-position", "fractions", few, cases)


def _block(image: Image, x: int, y: int) -> int:
    return image[y][x] + image[y][x + 1] + image[y + 1][x] + image[y + 1][x + 1]


def _one_place(rng: np.random.Generator, name: str, level: int) -> dict[str, Any]:
    uv = digits(rng.uniform(20, 300, 2), 6).tolist()
    scale, half = Fraction(2**level), Fraction(2**level - 1, 2)
    finest = name == "features.finest_from_level"

    def moved(shift: Fraction) -> list[float]:
        return [float(Fraction(v) * scale + shift if finest else (Fraction(v) - shift) / scale) for v in uv]

    wrong = {"half-pixel-forgotten": moved(Fraction(0)), "half-pixel-subtracted": moved(-half)}
    return _case({"uv": uv, "level": level}, "uv", moved(half), wrong)


# -- comparing patches -----------------------------------------------------------------------------


def _comparisons(topic: Topic, rng: np.random.Generator) -> None:
    sums = "64 squares of grey levels, the mean taken off: 64 eps of the sum, twice"
    rule = tolerance(3e-14, sums, float32=2e-5)
    for flag in ("alike", "brighter", "other"):
        pairs = [_pair(rng, flag) for _ in range(10)]
        cases = [_one_zmssd(*pair) for pair in pairs]
        topic.group("features.zmssd", "eq-zmssd", "fractions", rule, cases, flags=(flag,))
        cases = [_one_zncc(*pair) for pair in pairs]
        root = "three sums of 64 products, a root and a quotient"
        topic.group(
            "features.zncc",
            "eq-zncc",
            "50 digits",
            tolerance(3e-14, root, float32=2e-5),
            cases,
            flags=(flag,),
        )


def _pair(rng: np.random.Generator, flag: str) -> tuple[Image, Image]:
    a = rng.integers(20, 180, (8, 8))
    b = rng.integers(20, 180, (8, 8)) if flag == "other" else a + rng.integers(-6, 7, (8, 8))
    return a.tolist(), (b + (50 if flag == "brighter" else 0)).tolist()


def _flat(image: Image) -> list[Fraction]:
    return [Fraction(v) for row in image for v in row]


def _free(values: list[Fraction]) -> list[Fraction]:
    mean = sum(values, Fraction(0)) / len(values)
    return [v - mean for v in values]


def _one_zmssd(a: Image, b: Image) -> dict[str, Any]:
    difference = [p - q for p, q in zip(_flat(a), _flat(b), strict=True)]
    right = sum((v * v for v in _free(difference)), Fraction(0))
    wrong = {"mean-forgotten": sum(v * v for v in difference), "mean-of-squares": right / 64}
    return _case({"a": a, "b": b}, "value", float(right), {n: float(v) for n, v in wrong.items()})


def _one_zncc(a: Image, b: Image) -> dict[str, Any]:
    def quotient(p: list[Fraction], q: list[Fraction]) -> float:
        pq, pp, qq = (sum(x * y for x, y in zip(s, t, strict=True)) for s, t in ((p, q), (p, p), (q, q)))
        of = [mpf(v.numerator) / v.denominator for v in (Fraction(pq), Fraction(pp), Fraction(qq))]
        return float(of[0] / mpmath.sqrt(of[1] * of[2]))

    p, q = _flat(a), _flat(b)
    return _case({"a": a, "b": b}, "value", quotient(_free(p), _free(q)), {"sum-of-products": quotient(p, q)})


# -- the structure tensor --------------------------------------------------------------------------


def _eigenvalues(topic: Topic, rng: np.random.Generator) -> None:
    cancel = "a + c less a root of its size: eps of the larger eigenvalue over the smaller, at most 100 here"
    rule = tolerance(1e-13, cancel, float32=1e-4)
    for flag in ("texture", "near_edge"):
        cases = []
        for _ in range(10):
            x, y = np.meshgrid(np.arange(9), np.arange(9))
            turn = rng.uniform(0, np.pi)
            edge = 80 * np.tanh((np.cos(turn) * (x - 4) + np.sin(turn) * (y - 4)) / 1.5)
            size = 60 if flag == "texture" else 25
            image = np.rint(np.clip(128 + edge + rng.integers(-size, size + 1, (9, 9)), 0, 255)).astype(int)
            cases.append(_one_eigenvalue(image.tolist()))
        topic.group("features.shi_tomasi", "eq-shi-tomasi", "fractions, and a root of 50 digits", rule, cases,
                    flags=(flag,))  # fmt: skip


def _one_eigenvalue(image: Image) -> dict[str, Any]:
    a = b = c = Fraction(0)
    for y in range(1, 8):
        for x in range(1, 8):
            gx = Fraction(image[y][x + 1] - image[y][x - 1], 2)
            gy = Fraction(image[y + 1][x] - image[y - 1][x], 2)
            a, b, c = a + gx * gx / 49, b + gx * gy / 49, c + gy * gy / 49
    under = (a - c) ** 2 + 4 * b * b
    root = mpmath.sqrt(mpf(under.numerator) / under.denominator)
    trace = mpf((a + c).numerator) / (a + c).denominator
    right = (trace - root) / 2
    wrong = {
        "larger-eigenvalue": (trace + root) / 2,
        "harris": right * (trace + root) / 2 - mpf("0.04") * trace**2,
        "whole-differences": 4 * right,
        "window-sum": 49 * right,
    }
    return _case({"image": image}, "value", float(right), {n: float(v) for n, v in wrong.items()})


# -- patches ---------------------------------------------------------------------------------------


def _patches(topic: Topic, rng: np.random.Generator) -> None:
    exact = tolerance(1e-15, "whole grey levels, none of them from within 1e-6 of a half", float32=1e-6)
    ranges: dict[str, Callable[[], Any]] = {
        "identity": lambda: np.eye(2),
        "affine": lambda: np.round(np.eye(2) + rng.normal(0, 0.35, (2, 2)), 3),
    }
    for flag, draw in ranges.items():
        cases: list[dict[str, Any]] = []
        while len(cases) < 8:
            image = np.clip(rng.integers(0, 256, (20, 22)), 0, 255).tolist()
            uv, M = np.round(rng.uniform(9, 11, 2), 2).tolist(), draw().tolist()
            right = _patch(image, uv, M)
            if right is not None and abs(np.linalg.det(M)) > 0.3:
                cases.append(
                    _case({"image": image, "uv": uv, "M": M}, "patch", right, _wrong_patches(image, uv, M))
                )
        topic.group("features.warp", "eq-warp", "fractions, rounded half up", exact, cases, flags=(flag,))
    image = rng.integers(0, 256, (20, 22)).tolist()
    outside = [[3.5, 10.0], [10.0, 3.5], [18.5, 10.0], [10.0, 16.5]]
    unit = [[1.0, 0.0], [0.0, 1.0]]
    cases = [
        {"inputs": {"image": image, "uv": uv, "M": unit}, "expected": {}, "result": "invalid"}
        for uv in outside
    ]
    topic.group("features.warp", "eq-warp", "definition", exact, cases, flags=("degenerate",))
    few = tolerance(2e-15, "an inverse of two by two; condition below 6", float32=1e-5)
    cases = [_one_sampling(rng, k % 4, (k // 4) % 3) for k in range(12)]
    topic.group("features.sampling", "eq-sampling", "fractions", few, cases)


def _wrong_patches(image: Image, uv: list[float], M: list[list[float]]) -> dict[str, Any]:
    wrong = {
        "warp-inverted": _patch(image, uv, np.round(np.linalg.inv(M), 6).tolist()),
        "warp-transposed": _patch(image, uv, np.array(M).T.tolist()),
        "nearest-pixel": _patch(image, uv, M, nearest=True),
        "patch-off-centre": _patch(image, uv, M, first=-3),
    }
    return {note: patch for note, patch in wrong.items() if patch is not None}


def _patch(
    image: Image, uv: list[float], M: list[list[float]], *, nearest: bool = False, first: int = -4
) -> list[list[int]] | None:
    """Grey levels, or None where the patch leaves the image or a level is too near to a half."""
    patch = []
    for j in range(first, first + 8):
        row = []
        for i in range(first, first + 8):
            x, y = (Fraction(u) + Fraction(a) * i + Fraction(b) * j for u, (a, b) in zip(uv, M, strict=True))
            if not (0 <= x <= len(image[0]) - 1 and 0 <= y <= len(image) - 1):
                return None
            level = _level(image, x, y, nearest)
            if not nearest and abs(level % 1 - Fraction(1, 2)) < Fraction(1, 10**6):
                return None
            row.append(floor(level + Fraction(1, 2)))
        patch.append(row)
    return patch


def _level(image: Image, x: Fraction, y: Fraction, nearest: bool) -> Fraction:
    if nearest:
        return Fraction(image[floor(y + Fraction(1, 2))][floor(x + Fraction(1, 2))])
    j, i = min(floor(x), len(image[0]) - 2), min(floor(y), len(image) - 2)
    fx, fy = x - j, y - i
    top = image[i][j] * (1 - fx) + image[i][j + 1] * fx
    bottom = image[i + 1][j] * (1 - fx) + image[i + 1][j + 1] * fx
    return top * (1 - fy) + bottom * fy


def _one_sampling(rng: np.random.Generator, target: int, source: int) -> dict[str, Any]:
    A = np.round(1.5 * np.eye(2) + rng.uniform(-0.5, 0.5, (2, 2)), 3)
    (a, b), (c, d) = ([Fraction(v) for v in row] for row in A.tolist())
    det = a * d - b * c
    inverse = [[d / det, -b / det], [-c / det, a / det]]

    def scaled(M: list[list[Fraction]], octaves: int) -> list[list[float]]:
        return [[float(v * Fraction(2) ** octaves) for v in row] for row in M]

    wrong = {
        "not-inverted": scaled([[a, b], [c, d]], target - source),
        "levels-swapped": scaled(inverse, source - target),
    }
    inputs = {"A": A, "target_level": target, "source_level": source}
    return _case(inputs, "M", scaled(inverse, target - source), wrong)

"""What the precision of FREAK hangs on: one thing is swapped at a time, all else stays.

    python tests/freak/causes.py

Rows: precision over all rendered pairs, on graf, and the difference from ours on graf with a 95 % interval
over its queries (drawn 2000 times with replacement, the same for both: one pair has no other interval).

* pattern: rings at equal distances; boxes of 0.35 or 0.7 of the ring's radius for 0.5;
* smoothing: edges rounded to whole pixels, one pixel at least;
* direction: ORB's centroid; or contrib's 256 steps of the circle, rounded down;
* table: all 903 pairs; 512 drawn from them with three seeds.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import freak_pairs
import numpy as np
import precision
from freak_pairs import KeyPoints, Pair, orb
from numpy.typing import NDArray

from vslam_ref.features import hamming
from vslam_ref.features.freak.description import directions, upright_means
from vslam_ref.features.freak.pair_table import PAIRS
from vslam_ref.features.freak.pattern import CENTRE, HALF, REACH, WIDTH
from vslam_ref.features.freak.sampling import field_means, sums
from vslam_ref.features.levels import Bytes

Numbers = NDArray[np.float64]
Sampler = Callable[[Bytes, KeyPoints, Numbers], Numbers]
Turned = Callable[[Bytes, KeyPoints], Numbers]
ALL = np.stack(np.triu_indices(43, 1), 1)[:896]  # whole bytes: all but seven pairs of the innermost


def measured(image: Bytes, points: KeyPoints) -> Numbers:
    return directions(upright_means(sums(image), points.uv, points.scale))[0]


def in_steps(image: Bytes, points: KeyPoints) -> Numbers:
    unit = measured(image, points)
    angle = np.floor(np.arctan2(unit[:, 1], unit[:, 0]) * 128 / np.pi) * np.pi / 128
    return np.stack([np.cos(angle), np.sin(angle)], 1)


def boxes(centre: Numbers, half: Numbers) -> Sampler:
    def sample(image: Bytes, points: KeyPoints, unit: Numbers) -> Numbers:
        return field_means(sums(image), points.uv, points.scale, unit, centre, half)

    return sample


def whole_pixels(image: Bytes, points: KeyPoints, unit: Numbers) -> Numbers:
    c, s, wide = unit[:, :1], unit[:, 1:], points.scale[:, None]
    x = points.uv[:, :1] + wide * (c * CENTRE[:, 0] - s * CENTRE[:, 1]) + 0.5
    y = points.uv[:, 1:] + wide * (s * CENTRE[:, 0] + c * CENTRE[:, 1]) + 0.5
    side = np.maximum(np.rint(2 * wide * HALF), 1).astype(int)
    x0, y0 = (np.rint(v - side / 2).astype(int) for v in (x, y))
    table = sums(image)
    total = table[y0 + side, x0 + side] - table[y0, x0 + side] - table[y0 + side, x0] + table[y0, x0]
    return total / side**2


def evenly() -> tuple[Numbers, Numbers]:
    """Rings at equal distances, the same outermost one."""
    ring = REACH / (1 + WIDTH) * np.arange(7, 0, -1) / 7
    old = np.append(np.repeat(np.hypot(*CENTRE[:42:6].T), 6), 1.0)
    new = np.append(np.repeat(ring, 6), 1.0)
    return CENTRE * (new / old)[:, None], np.append(WIDTH * new[:42], WIDTH * ring[-1])


def described(sample: Sampler, turned: Turned, pairs: NDArray[np.int64]) -> precision.Method:
    def method(name: str, image: Bytes, points: KeyPoints) -> Bytes:
        mean = sample(image, points, turned(image, points))
        return np.packbits(mean[:, pairs[:, 0]] > mean[:, pairs[:, 1]], axis=1, bitorder="little")

    return method


def variants() -> dict[str, precision.Method]:
    ours = boxes(CENTRE, HALF)
    found = {
        "ours": described(ours, measured, PAIRS),
        "contrib": precision.Contrib(),
        "pattern: rings evenly": described(boxes(*evenly()), measured, PAIRS),
        "pattern: boxes 0.35": described(boxes(CENTRE, 0.7 * HALF), measured, PAIRS),
        "pattern: boxes 0.7": described(boxes(0.88 * CENTRE, 0.88 * 1.4 * HALF), measured, PAIRS),
        "smoothing: whole pixels": described(whole_pixels, measured, PAIRS),
        "direction: centroid": described(ours, precision.centroid, PAIRS),
        "direction: 256 steps": described(ours, in_steps, PAIRS),
        "table: all pairs": described(ours, measured, ALL),
    }
    for seed in range(3):
        drawn = ALL[np.random.default_rng(seed).permutation(len(ALL))[:512]]
        found[f"table: drawn {seed}"] = described(ours, measured, drawn)
    return found


def answers(pair: Pair, image: Bytes, points: list[KeyPoints], bits: list[Bytes]) -> tuple[Numbers, Numbers]:
    """Distance of each query's answer, and whether it is right."""
    place = orb.moved(pair.H_b_a, points[0].uv)
    last = np.array(image.shape[::-1]) - 1 - orb.MARGIN
    near = np.linalg.norm(place[:, None] - points[1].uv, axis=2) <= orb.WITHIN
    query = np.flatnonzero(((place >= orb.MARGIN) & (place <= last)).all(1) & near.any(1))
    d = hamming.distances(bits[0][query], bits[1])
    answer = d.argmin(1)
    return d[np.arange(len(query)), answer], near[query, answer]


def main() -> int:
    pictures: dict[str, Bytes] = {}
    found = list(freak_pairs.pairs(pictures))
    points = {name: freak_pairs.points_of(name, image) for name, image in pictures.items()}
    rng, against = np.random.default_rng(7), None
    print(f"{'':26}{'rendered':>10}{'graf':>8}{'graf, less ours, 95 % over queries':>40}")
    for name, method in variants().items():
        bits = {n: method(n, image, points[n]) for n, image in pictures.items()}
        both = [precision.score(pair, pictures, points, bits) for pair in found]
        line = f"{name:26}{np.mean(both[:28]):10.3f}"
        if found[-1].motion == freak_pairs.GRAF:
            pair = found[-1]
            sides = [pair.a, pair.b]
            d, right = answers(pair, pictures[pair.b], [points[n] for n in sides], [bits[n] for n in sides])
            against = (d, right) if against is None else against
            drawn = rng.integers(0, len(d), (2000, len(d)))
            apart = [orb.area(d[k], right[k]) - orb.area(against[0][k], against[1][k]) for k in drawn]
            low, high = np.percentile(apart, [2.5, 97.5])
            line += f"{both[-1]:8.3f}   {both[-1] - orb.area(*against):+.3f} [{low:+.3f}, {high:+.3f}]"
            line += f", {len(d)} queries"
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())

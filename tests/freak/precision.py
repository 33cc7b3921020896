"""Average precision of FREAK under rotation, scale and blur, beside others: ``make freak-precision``.

    python tests/freak/precision.py

Rules, fixed before the first run:

* Pictures and key points are those of ``freak_pairs``: no table was learned from them, and every method
  describes the same ones.  Contrib's FREAK comes from the recording ``contrib.npz``; OpenCV's ORB gets our
  directions.
* A query, an answer, and the area under precision over recall are those of ``make orb-precision``: the place
  in the second picture at least 20 pixels inside, a partner within 3; the nearest descriptor of all.
* A row is a motion: mean over the scenes, and the difference of both FREAKs with its 95 % interval of
  Student's t over pairs.  The last row is over all pairs but graf.
* The verdict is yes if ours is at least contrib's in every row, and the means of the last row are, too.

``tests/freak/causes.py`` swaps one thing at a time.
"""

from __future__ import annotations

import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import cv2
import freak_pairs
import numpy as np
from freak_pairs import KeyPoints, Pair, orb
from numpy.typing import NDArray
from scipy.stats import t as student

from vslam_ref.features.freak import describe
from vslam_ref.features.levels import Bytes
from vslam_ref.features.orb import OrbFeatures
from vslam_ref.features.orb.description import describe as orb_describe
from vslam_ref.features.orb.description import smooth
from vslam_ref.features.orb.direction import moments, towards
from vslam_ref.features.orb.scales import octave_images

Numbers = NDArray[np.float64]
Method = Callable[[str, Bytes, KeyPoints], Bytes]
RECORDING = Path(__file__).with_name("contrib.npz")


def ours(name: str, image: Bytes, points: KeyPoints) -> Bytes:
    found = describe(image, points.uv, points.scale)
    assert len(found.kept) == len(points.octave)
    return found.descriptor


class Contrib:
    """The recording: key points and descriptors by the name of the picture."""

    def __init__(self) -> None:
        with np.load(RECORDING, allow_pickle=False) as held:
            first = np.cumsum(held["count"])[:-1]
            parts = (np.split(held[key], first) for key in ("xy", "octave", "descriptor"))
            self.held = dict(zip(held["name"].tolist(), zip(*parts, strict=True), strict=True))
            self.crc = dict(zip(held["name"].tolist(), held["crc"].tolist(), strict=True))

    def __call__(self, name: str, image: Bytes, points: KeyPoints) -> Bytes:
        xy, octave, bits = self.held[name]
        if self.crc[name] != zlib.crc32(image.tobytes()):
            raise SystemExit(f"{name}: another picture than was recorded")
        if not (np.array_equal(xy, points.xy) and np.array_equal(octave, points.octave)):
            raise SystemExit(f"{name}: other key points than were recorded")
        return bits


def centroid(image: Bytes, points: KeyPoints) -> Numbers:
    """ORB's directions (n, 2)."""
    found = np.zeros((len(points.octave), 2))
    for k, part in enumerate(octave_images(image, freak_pairs.OCTAVES, freak_pairs.STEP)):
        here = points.octave == k
        found[here] = towards(moments(part, points.xy[here].astype(np.int32)))
    return found


def house_orb(name: str, image: Bytes, points: KeyPoints) -> Bytes:
    bits, unit = np.zeros((len(points.octave), 32), np.uint8), centroid(image, points)
    for k, part in enumerate(octave_images(image, freak_pairs.OCTAVES, freak_pairs.STEP)):
        here = points.octave == k
        bits[here] = orb_describe(smooth(part), points.xy[here].astype(np.int32), unit[here])
    return bits


def opencv_orb(name: str, image: Bytes, points: KeyPoints) -> Bytes:
    """OpenCV's ORB; its octaves lose half a pixel, which it gets back."""
    unit, uv = centroid(image, points), points.xy * points.scale[:, None]
    angle = np.degrees(np.arctan2(unit[:, 1], unit[:, 0])) % 360
    given = [
        cv2.KeyPoint(*uv[k].tolist(), 31 * float(points.scale[k]), float(angle[k]), 0.0, int(o), k)
        for k, o in enumerate(points.octave)
    ]
    maker = cv2.ORB_create(1000, freak_pairs.STEP, freak_pairs.OCTAVES, edgeThreshold=15)
    found, bits = maker.compute(image, given)
    into = np.zeros((len(given), 32), np.uint8)
    into[[k.class_id for k in found]] = bits
    assert len(found) == len(given)
    return into


def score(
    pair: Pair, pictures: dict[str, Bytes], points: dict[str, KeyPoints], bits: dict[str, Bytes]
) -> float:
    sides = [
        OrbFeatures(points[n].uv, points[n].octave, np.zeros(0), np.zeros(0), bits[n])
        for n in (pair.a, pair.b)
    ]
    warp = orb.Warp(pair.motion, pictures[pair.a], pictures[pair.b], pair.H_b_a)
    return float(orb.score(*sides, warp).precision)


def study(methods: dict[str, Method]) -> tuple[list[Pair], Numbers]:
    """Average precision (pairs, methods)."""
    pictures: dict[str, Bytes] = {}
    found = list(freak_pairs.pairs(pictures))
    points = {name: freak_pairs.points_of(name, image) for name, image in pictures.items()}
    result = np.zeros((len(found), len(methods)))
    for m, method in enumerate(methods.values()):
        bits = {name: method(name, image, points[name]) for name, image in pictures.items()}
        result[:, m] = [score(pair, pictures, points, bits) for pair in found]
    return found, result


def interval(difference: Numbers) -> tuple[float, float]:
    """95 % of Student's t about the mean; nan for one pair."""
    if len(difference) < 2:
        return float("nan"), float("nan")
    wide = student.ppf(0.975, len(difference) - 1) * difference.std(ddof=1) / np.sqrt(len(difference))
    return float(difference.mean() - wide), float(difference.mean() + wide)


def rows(found: list[Pair], result: Numbers) -> list[tuple[str, Numbers]]:
    """Results (pairs, methods) of each motion, and of all but graf."""
    motion = np.array([pair.motion for pair in found])
    named = [(name, result[motion == name]) for name in dict.fromkeys(motion.tolist())]
    return [*named, ("all but graf", result[motion != freak_pairs.GRAF])]


def verdict(table: list[tuple[str, Numbers]]) -> bool:
    """Whether the first method is at least the second in every row."""
    return all(part[:, 0].mean() >= part[:, 1].mean() for _, part in table)


METHODS: dict[str, Callable[[], Method]] = {
    "ours": lambda: ours,
    "contrib FREAK": Contrib,
    "OpenCV ORB": lambda: opencv_orb,
    "our ORB": lambda: house_orb,
}


def main() -> int:
    found, result = study({name: make() for name, make in METHODS.items()})
    table = rows(found, result)
    print(
        f"{'precision':14}{'pairs':>6}"
        + "".join(f"{n:>15}" for n in METHODS)
        + f"{'ours - contrib, 95 %':>30}"
    )
    for name, part in table:
        low, high = interval(part[:, 0] - part[:, 1])
        tail = f"{(part[:, 0] - part[:, 1]).mean():+12.3f} [{low:+.3f}, {high:+.3f}]"
        print(f"{name:14}{len(part):6}" + "".join(f"{x:15.3f}" for x in part.mean(0)) + tail)
    print(f"ours at least contrib's in every row: {'yes' if verdict(table) else 'no'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Mean average precision of ORB over unseen warps, ours beside OpenCV's: ``make orb-precision``.

    python tests/orb/precision.py

Rules, fixed before the first run:

* Five pictures, each under seven warps with exact truth, and graf1 to graf3 with the data set's homography.
  None of them was used to learn a table: rendered scenes have other seeds.
* 1000 features of both libraries in both pictures, 8 octaves of 1.2, everything else as each sets it.
  OpenCV's positions get the half pixel that its octaves lose, so that it costs OpenCV nothing.
* A query is a feature of the first picture whose place in the second lies at least 20 pixels inside, and
  has a feature of the second within 3 pixels.  Its answer is the nearest descriptor of all, and right if it
  is one of those.  Answers are ranked by distance; those of one distance are taken together.
* Average precision is the area under precision over recall; the mean is over the warps.

The first run showed that features spread by the quadtree have a lower precision, whoever finds and describes
them: OpenCV keeps the best corners, wherever they are, and the tree takes the best of every region, strong or
weak, whose rivals the second picture may rank otherwise.  OpenCV's ORB has no tree.  So the fair comparisons
are of like with like, and each is a pair of rows:

===========================  ===============================  ==================================
what is compared             ours                             OpenCV's
===========================  ===============================  ==================================
bits, at the same places     ``ours, spread``                 ``ours, OpenCV's bits``
bits, at the same places     ``OpenCV's, our bits``           ``OpenCV``
all of it, both spread       ``ours, spread``                 ``OpenCV, spread``
all of it, neither spread    ``ours, best first``             ``OpenCV``
as its users get it          ``ours, spread``                 ``OpenCV``: no like with like
===========================  ===============================  ==================================

``OpenCV, spread`` is everything that OpenCV finds, by its Harris score through the same tree, with the same
share of each octave.  A claim that our ORB is as precise as OpenCV's means the first four.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from vslam_ref.datasets import catalogue
from vslam_ref.datasets.pictures import read_grey
from vslam_ref.features import hamming
from vslam_ref.features.orb import OrbFeatures, OrbSettings, extract
from vslam_ref.features.orb.description import describe, smooth
from vslam_ref.features.orb.direction import moments, towards
from vslam_ref.features.orb.extraction import shares
from vslam_ref.features.orb.scales import octave_images
from vslam_ref.features.orb.spread import spread
from vslam_ref.worlds.pictures import moved
from vslam_ref.worlds.rendered import scene

Bytes = NDArray[np.uint8]
Numbers = NDArray[np.float64]
FEATURES, WITHIN, MARGIN = 1000, 3.0, 20.0
EVERYTHING = 10**6
GRAF = "graf1 to graf3"


class Warp(NamedTuple):
    """Two pictures, and H_b_a (3, 3): pixels of the second from those of the first."""

    name: str
    a: Bytes
    b: Bytes
    H_b_a: Numbers


class Score(NamedTuple):
    """Average precision, number of queries, and the share of features inside that have a partner."""

    precision: float
    queries: int
    repeated: float


def about(shape: tuple[int, int], turn: float = 0.0, scale: float = 1.0, tilt: float = 0.0) -> Numbers:
    """Turn (degrees) and scale about the middle of a picture (H, W); tilt: perspective per half width."""
    middle = (np.array(shape[::-1], float) - 1) / 2
    c, s = np.cos(np.radians(turn)) * scale, np.sin(np.radians(turn)) * scale
    to, back = np.eye(3), np.eye(3)
    to[:2, 2], back[:2, 2] = -middle, middle
    H = np.array([[c, -s, 0], [s, c, 0], [tilt / middle[0], 0, 1]])
    found: Numbers = back @ H @ to
    return found


def seen(a: Bytes, H_b_a: Numbers) -> Numbers:
    """Picture ``a`` through a homography: means of 3 x 3 samples in each pixel; mirrored beyond it."""
    height, width = a.shape
    x, y = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    total = np.zeros(a.shape)
    for dx in (-1 / 3, 0, 1 / 3):
        for dy in (-1 / 3, 0, 1 / 3):
            at = moved(np.linalg.inv(H_b_a), np.stack([x + dx, y + dy], -1))
            total += map_coordinates(a.astype(float), [at[..., 1], at[..., 0]], order=1, mode="mirror")
    return total / 9


def finished(grey: Numbers) -> Bytes:
    return np.floor(np.clip(grey, 0, 255) + 0.5).astype(np.uint8)


def warps_of(name: str, a: Bytes, rng: np.random.Generator) -> Iterator[Warp]:
    """Seven of each picture: rotation, scale, tilt, blur, exposure."""
    plans: dict[str, tuple[dict[str, float], Callable[[Numbers], Numbers]]] = {
        "turn 25": ({"turn": 25.0}, lambda g: g),
        "turn 110": ({"turn": 110.0}, lambda g: g),
        "scale 0.7": ({"scale": 0.7, "turn": 10.0}, lambda g: g),
        "scale 1.4": ({"scale": 1.4, "turn": -10.0}, lambda g: g),
        "tilt": ({"tilt": 0.25, "turn": 5.0}, lambda g: g),
        "blur": ({"turn": 8.0}, lambda g: gaussian_filter(g, 2.0)),
        "exposure": ({"turn": -8.0}, lambda g: 0.55 * g + 10 + rng.normal(0, 4, g.shape)),
    }
    for plan, (motion, change) in plans.items():
        H = about((a.shape[0], a.shape[1]), **motion)
        yield Warp(f"{name}: {plan}", a, finished(change(seen(a, H))), H)


def warps(quick: bool = False) -> list[Warp]:
    """All of them; pictures of data sets that are not found are left out."""
    pictures = {
        "desk 901": lambda: scene("desk", 901).frame(40),
        "corridor 902": lambda: scene("corridor", 902).frame(90),
    }
    folder = catalogue.find("opencv_samples")
    if folder is not None:
        for name in ("home", "building", "blox"):
            pictures[name] = lambda name=name: read_grey(folder / f"{name}.jpg")  # type: ignore[misc]
    rng, found = np.random.default_rng(31), []
    for name, picture in list(pictures.items())[: 1 if quick else None]:
        found += list(warps_of(name, picture(), rng))
    if folder is not None and not quick:
        found.append(graf())
    return found


def graf() -> Warp:
    folder = catalogue.require("opencv_samples") / "planar"
    storage = cv2.FileStorage(str(folder / "H1to3p.xml"), cv2.FILE_STORAGE_READ)
    H = storage.getNode("H13").mat()
    return Warp(GRAF, read_grey(folder / "graf1.png"), read_grey(folder / "graf3.png"), H)


def ours(image: Bytes) -> OrbFeatures:
    return extract(image, OrbSettings(features=FEATURES))


def opencv(image: Bytes, features: int = FEATURES) -> OrbFeatures:
    """OpenCV's ORB, with the half pixel given back."""
    found, bits = cv2.ORB_create(features).detectAndCompute(image, None)
    octave = np.array([k.octave & 255 for k in found])
    uv = np.array([k.pt for k in found]) + (1.2 ** octave[:, None] - 1) / 2
    angle = np.radians([k.angle for k in found])
    return OrbFeatures(uv, octave, angle, np.array([k.response for k in found]), bits)


def score(a: OrbFeatures, b: OrbFeatures, warp: Warp) -> Score:
    """Average precision of the nearest descriptor."""
    place = moved(warp.H_b_a, a.uv)
    inside = ((place >= MARGIN) & (place <= np.array(warp.b.shape[::-1]) - 1 - MARGIN)).all(1)
    near = np.linalg.norm(place[:, None] - b.uv, axis=2) <= WITHIN
    query = np.flatnonzero(inside & near.any(1))
    d = hamming.distances(a.descriptor[query], b.descriptor)
    answer = d.argmin(1)
    right = near[query, answer]
    precision = area(d[np.arange(len(query)), answer], right)
    return Score(precision, len(query), len(query) / max(int(inside.sum()), 1))


def area(distance: NDArray[np.integer], right: NDArray[np.bool_]) -> float:
    """Area under precision over recall, the share of all queries that are answered rightly so far."""
    steps = np.unique(distance)
    so_far = np.array([right[distance <= k].sum() for k in steps], float)
    asked = np.array([(distance <= k).sum() for k in steps], float)
    return float((np.diff(so_far, prepend=0.0) * so_far / asked).sum() / max(len(right), 1))


def best_first(image: Bytes) -> OrbFeatures:
    """Ours without the quadtree."""
    return extract(image, OrbSettings(features=FEATURES, spread=False))


def described_by_us(image: Bytes) -> OrbFeatures:
    """OpenCV's features on the nearest pixels of our octaves, with our directions and bits."""
    found, parts = opencv(image), []
    for k, octave in enumerate(octave_images(image, 8, 1.2)):
        xy = np.rint((found.uv + 0.5) / 1.2**k - 0.5).astype(np.int32)
        inside = ((xy >= 19) & (xy < np.array(octave.shape[::-1]) - 19)).all(1) & (found.octave == k)
        bits = describe(smooth(octave), xy[inside], towards(moments(octave, xy[inside])))
        parts.append(OrbFeatures(*(part[inside] for part in found))._replace(descriptor=bits))
    return OrbFeatures(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def described_by_opencv(image: Bytes) -> OrbFeatures:
    """Ours, with OpenCV's bits: it is given place, octave and angle, and computes the bits alone."""
    found = ours(image)
    x, y = np.rint((found.uv.T + 0.5) / 1.2**found.octave - 0.5) * 1.2**found.octave  # it divides and rounds
    angle = np.degrees(found.angle) % 360
    keys = [
        cv2.KeyPoint(*map(float, row[:2]), 31.0, float(row[2]), k, int(row[3]), k)
        for k, row in enumerate(np.stack([x, y, angle, found.octave], 1).tolist())
    ]
    described, bits = cv2.ORB_create(FEATURES, edgeThreshold=19).compute(image, keys)
    kept = np.array([key.class_id for key in described])
    return OrbFeatures(*(part[kept] for part in found))._replace(descriptor=bits)


def spread_by_us(image: Bytes) -> OrbFeatures:
    """Of all that OpenCV finds, what the tree keeps: of each octave as many as of ours, by OpenCV's score."""
    found, kept = opencv(image, EVERYTHING), []
    wanted = shares(OrbSettings(features=FEATURES))
    for k, octave in enumerate(octave_images(image, 8, 1.2)):
        at = np.flatnonzero(found.octave == k)
        xy = np.rint((found.uv[at] + 0.5) / 1.2**k - 0.5).astype(np.int32)
        xy = np.clip(xy, 0, np.array(octave.shape[::-1]) - 1)
        rank = np.argsort(np.argsort(found.response[at], kind="stable"))
        kept.append(at[spread(xy, rank, (octave.shape[0], octave.shape[1]), wanted[k])])
    return OrbFeatures(*(part[np.concatenate(kept)] for part in found))


METHODS: dict[str, Callable[[Bytes], OrbFeatures]] = {
    "ours, spread": ours,
    "ours, OpenCV's bits": described_by_opencv,
    "OpenCV, spread": spread_by_us,
    "ours, best first": best_first,
    "OpenCV": opencv,
    "OpenCV's, our bits": described_by_us,
}
FAIR = {
    "bits at our places": ("ours, spread", "ours, OpenCV's bits"),
    "bits at OpenCV's places": ("OpenCV's, our bits", "OpenCV"),
    "all, both spread": ("ours, spread", "OpenCV, spread"),
    "all, neither spread": ("ours, best first", "OpenCV"),
}
"""Pairs of methods that are like with like: ours, OpenCV's."""


def study(found: list[Warp]) -> Numbers:
    """Average precision, queries and share repeated (warps, methods, 3)."""
    return np.array(
        [[score(method(warp.a), method(warp.b), warp) for method in METHODS.values()] for warp in found]
    )


def main() -> int:
    found = warps()
    result = study(found)
    print(f"{'precision (repeated)':24}" + "".join(f"{name:>20}" for name in METHODS))
    for warp, row in zip(found, result, strict=True):
        print(f"{warp.name:24}" + "".join(f"{p:12.3f} ({r:.3f})" for p, _, r in row))
    warped = np.array([warp.name != GRAF for warp in found])
    mean = result[warped].mean(0)
    print(f"{'mean without graf':24}" + "".join(f"{p:12.3f} ({r:.3f})" for p, _, r in mean))
    print("\nlike with like          ours  OpenCV's   graf: ours  OpenCV's   ours is better in")
    names = list(METHODS)
    for what, pair in {**FAIR, "as users get it (not like)": ("ours, spread", "OpenCV")}.items():
        a, b = (result[:, names.index(name), 0] for name in pair)
        better = f"{int((a > b)[warped].sum())} of {int(warped.sum())} warps"
        at_graf = f"{a[~warped].mean():11.3f}{b[~warped].mean():10.3f}" if not warped.all() else " " * 21
        print(f"{what:28}{a[warped].mean():.3f}{b[warped].mean():10.3f}{at_graf}   {better}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

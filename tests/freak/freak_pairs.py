"""Pairs of pictures that the table of FREAK's pairs has not seen, and the key points in them.

Four rendered scenes with a seed that no table was learned from, each turned, scaled and blurred with exact
truth; and graf1 and graf3 with the data set's homography.  Key points are ORB's corners in five octaves,
found in *both* pictures; only those are taken whose place keeps 26 pixels of its octave from the border, so
that every method describes all of them.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from vslam_ref.datasets import catalogue
from vslam_ref.features.levels import Bytes
from vslam_ref.features.orb import OrbSettings
from vslam_ref.features.orb.extraction import located, shares
from vslam_ref.features.orb.scales import finest_from_octave, octave_images
from vslam_ref.worlds.rendered import NAMES, scene

SEED, OCTAVES, STEP, MARGIN = 901, 5, 1.2, 26
POINTS, GRAF_POINTS = 165, 400
GRAF = "graf"
MOTIONS: dict[str, tuple[dict[str, float], float]] = {
    "turn 25": ({"turn": 25.0}, 0.0),
    "turn 110": ({"turn": 110.0}, 0.0),
    "turn 200": ({"turn": 200.0}, 0.0),
    "scale 0.7": ({"scale": 0.7}, 0.0),
    "scale 1.4": ({"scale": 1.4}, 0.0),
    "blur 1.5": ({}, 1.5),
    "blur 3": ({}, 3.0),
}


def neighbour(name: str, path: Path) -> ModuleType:
    """Import a file of another folder of tests; they are no packages."""
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


orb = neighbour("orb_precision_for_freak", Path(__file__).parents[1] / "orb" / "precision.py")


class KeyPoints(NamedTuple):
    """Pixels (n, 2) of their octaves (n,)."""

    xy: NDArray[np.int16]
    octave: NDArray[np.uint8]

    @property
    def scale(self) -> NDArray[np.float64]:
        return STEP ** self.octave.astype(float)

    @property
    def uv(self) -> NDArray[np.float64]:
        """Pixels of the picture."""
        return finest_from_octave(self.xy, self.octave.astype(int), STEP)


class Pair(NamedTuple):
    """Two pictures by name, the motion between them, and H_b_a (3, 3)."""

    motion: str
    a: str
    b: str
    H_b_a: NDArray[np.float64]


def key_points(image: Bytes, count: int) -> KeyPoints:
    """The best ``count`` or a few less, shared out over the octaves, with the quadtree's spread."""
    settings = OrbSettings(features=count, octaves=OCTAVES)
    xy, octave = [], []
    for k, (part, wanted) in enumerate(
        zip(octave_images(image, OCTAVES, STEP), shares(settings), strict=True)
    ):
        inner = np.ascontiguousarray(part[MARGIN - 19 : 19 - MARGIN, MARGIN - 19 : 19 - MARGIN])
        found = located(inner, wanted, settings).xy + MARGIN - 19
        xy.append(found)
        octave.append(np.full(len(found), k))
    return KeyPoints(np.concatenate(xy).astype(np.int16), np.concatenate(octave).astype(np.uint8))


def pairs(pictures: dict[str, Bytes] | None = None) -> Iterator[Pair]:
    """All pairs; their pictures are put into ``pictures`` by name."""
    into: dict[str, Bytes] = {} if pictures is None else pictures
    for name in NAMES:
        made = scene(name, SEED)
        a = made.frame(2 * len(made.times) // 5)
        into[name] = a
        for motion, (how, blur) in MOTIONS.items():
            H = orb.about(a.shape, **how)
            seen = orb.seen(a, H) if how else a.astype(float)
            into[f"{name}, {motion}"] = orb.finished(gaussian_filter(seen, blur) if blur else seen)
            yield Pair(motion, name, f"{name}, {motion}", H)
    if catalogue.find("opencv_samples") is not None:
        warp = orb.graf()
        into["graf1"], into["graf3"] = warp.a, warp.b
        yield Pair(GRAF, "graf1", "graf3", warp.H_b_a)


def points_of(name: str, image: Bytes) -> KeyPoints:
    return key_points(image, GRAF_POINTS if name.startswith(GRAF) else POINTS)

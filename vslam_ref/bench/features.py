"""``vslam-ref bench features``: corners, patches and refinement on this machine, beside OpenCV.

===== =========================================================================================
goal  what is measured, on one thread, in CPU time of the thread, medians of paired ratios
===== =========================================================================================
FE-2  pyramid and FAST-10 on four levels, over OpenCV's area means and FAST-9; 2 x Numba, 5 x NumPy
FE-1  what features add to a frame with 1000 points, over one ``cv2.FAST``: part of a tracker's time
FE-3  distances of binary descriptors, over OpenCV's matcher; ORB's extraction beside it: ``bench.orb``
===== =========================================================================================

Two pictures of 640 x 480: a painted wall with noise, and the first two frames of ``7scenes_redkitchen`` where
that set is found.  Both libraries find all corners above a threshold of 10, without suppression.  The peer of
the patch search is ``cv2.matchTemplate`` in a window around each point, that of the refinement is
``cv2.calcOpticalFlowPyrLK`` on one level, 9 x 9 pixels: what a user would take, not the same algorithms.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.bench import freak, orb
from vslam_ref.bench.rows import Row, measured, on_each_backend, row
from vslam_ref.datasets import catalogue, pictures
from vslam_ref.features import (
    Corners,
    Templates,
    corner_score,
    detect,
    pyramid,
    refine,
    search,
    shi_tomasi,
    warp,
)
from vslam_ref.features.levels import Bytes
from vslam_ref.support.timing import paired
from vslam_ref.worlds.pictures import painted_wall, picture

THRESHOLD, POINTS, RADIUS = 10, 1000, 10.0
GOALS_FE_2 = {"numpy": 5.0, "numba": 2.0}
Thing = Callable[[], object]


class ImagePair(NamedTuple):
    """Two images, corners of both, and templates of the first at ``xy`` (N, 2)."""

    first: Bytes
    second: Bytes
    corners: Corners
    templates: Templates
    xy: Array


def run(quick: bool = False) -> dict[str, Any]:
    """Measure everything on one thread; ``rows`` is a list of flat records."""
    import cv2

    cv2.setNumThreads(1)
    pairs = images()

    def all_pairs(backend: str, quick: bool) -> list[Row]:
        return [r for name, pair in pairs.items() for r in measure(name, scene(*pair), backend, quick)]

    def orb_features(backend: str, quick: bool) -> list[Row]:
        return [
            r for name, pair in pairs.items() for r in orb.measure_extraction(name, pair[1], backend, quick)
        ]

    def freak_points(backend: str, quick: bool) -> list[Row]:
        found = [freak.measure_description(name, pair[1], backend, quick) for name, pair in pairs.items()]
        return [r for part in found for r in part]

    parts = (all_pairs, orb.measure_hamming, orb_features, freak_points)
    rows = measured("features", on_each_backend(quick, *parts))
    return {"rows": rows, "threads": 1, "peer": f"OpenCV {cv2.__version__}"}


def images() -> dict[str, tuple[Bytes, Bytes]]:
    """Pairs of images by name; those of data sets that are not found are left out."""
    rng = np.random.default_rng(0)
    wall = painted_wall(rng)
    H_b_a = np.array([[1.01, 0.01, 4.0], [-0.01, 1.0, 3.0], [1e-5, 0.0, 1.0]])
    first, second = (picture(wall, H, noise=3.0, rng=rng) for H in (np.eye(3), H_b_a))
    found = {"wall": (first, second)}
    folder = catalogue.find("7scenes_redkitchen")
    if folder is not None:
        files = sorted((folder / "images").iterdir())[:2]
        found["kitchen"] = (pictures.read_grey(files[0]), pictures.read_grey(files[1]))
    return found


def scene(first: Bytes, second: Bytes) -> ImagePair:
    """Choose 1000 corners of the first image that have room around them."""
    xy = detect(first, THRESHOLD).xy
    xy = xy[((xy >= 20) & (xy < np.array(first.shape[::-1]) - 20)).all(1)]
    chosen = np.random.default_rng(1).permutation(len(xy))[:POINTS]
    at = xy[chosen].astype(np.float64)
    templates = warp(first, at, np.broadcast_to(np.eye(2), (len(at), 2, 2)))
    return ImagePair(first, second, detect(second, THRESHOLD), templates, at)


def measure(name: str, given: ImagePair, backend: str, quick: bool) -> list[Row]:
    """All rows of one pair of images."""
    repeats = 3 if quick else 15
    counts = f"{len(given.corners.xy)} corners, {len(given.xy)} points"
    fast = paired({"OpenCV": opencv_levels(given.second), "ours": levels(given.second)}, repeats, clock=CLOCK)
    rows = [
        row("FE-2", f"{name}: four levels, ours", backend, 1e3 * fast.seconds["ours"], "ms"),
        row(
            "FE-2",
            f"{name}: four levels, ours / OpenCV",
            backend,
            fast.ratio["ours"],
            "x",
            GOALS_FE_2[backend],
        ),
    ]
    result = paired({"one cv2.FAST": opencv_fast(given.second)} | parts(given), repeats, clock=CLOCK)
    for part, ratio in result.ratio.items():
        if part != "one cv2.FAST":
            rows.append(row("FE-1", f"{name}: {part} ({counts})", backend, 1e3 * result.seconds[part], "ms"))
            rows.append(row("FE-1", f"{name}: {part} / one cv2.FAST", backend, ratio, "x"))
    for case, things in peers(given).items():
        ratio = paired(things, 3 if quick else 7, clock=CLOCK).ratio["ours"]
        rows.append(row("FE-1", f"{name}: {case}", backend, ratio, "x"))
    return rows


CLOCK = time.thread_time
"""Other programs on the machine do not count."""


def levels(image: Bytes) -> Thing:
    """Our pyramid and FAST-10 on four levels."""
    return lambda: [detect(level, THRESHOLD) for level in pyramid(image)]


def opencv_levels(image: Bytes) -> Thing:
    """OpenCV's area means and FAST-9 on four levels."""
    import cv2

    detector = cv2.FastFeatureDetector.create(THRESHOLD, False)

    def call() -> None:
        level: NDArray[Any] = image
        detector.detect(level)
        for _ in range(3):
            level = cv2.resize(level, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
            detector.detect(level)

    return call


def opencv_fast(image: Bytes) -> Thing:
    """One call of FAST: the unit of goal FE-1."""
    import cv2

    detector = cv2.FastFeatureDetector.create(THRESHOLD, False)
    return lambda: detector.detect(image)


def parts(given: ImagePair) -> dict[str, Thing]:
    """What features do for a tracker, one by one and together."""
    first, second, corners, templates, xy = given
    M = np.broadcast_to(np.eye(2) + 0.05, (len(xy), 2, 2))
    start = near(given)

    def all_of_it() -> None:
        found = [detect(level, THRESHOLD) for level in pyramid(second)]
        patch = warp(first, xy, M).patch
        best = search(second, found[0], patch, xy, RADIUS)
        ok = best.corner >= 0
        refine(second, patch[ok], found[0].xy[best.corner[ok]])

    return {
        "1000 warped templates": lambda: warp(first, xy, M),
        "search within 10 px": lambda: search(second, corners, templates.patch, xy, RADIUS),
        "search by ZNCC": lambda: search(second, corners, templates.patch, xy, RADIUS, measure="zncc"),
        "refinement": lambda: refine(second, templates.patch, start),
        "scores of all corners": lambda: corner_score(second, corners.xy),
        "Shi-Tomasi of 1000": lambda: shi_tomasi(first, xy),
        "levels, templates, search, refinement": all_of_it,
    }


def near(given: ImagePair) -> Array:
    """Where the search found the points; where it did not, where they were."""
    found = search(given.second, given.corners, given.templates.patch, given.xy, RADIUS)
    return np.where((found.corner >= 0)[:, None], given.corners.xy[found.corner], given.xy)


def peers(given: ImagePair) -> dict[str, dict[str, Thing]]:
    """OpenCV's way to the same ends, and ours."""
    import cv2

    first, second, corners, templates, xy = given
    start = near(given)
    low = np.rint(xy).astype(int) - int(RADIUS) - 4
    side = 2 * int(RADIUS) + 8

    def match() -> None:
        for patch, (x, y) in zip(templates.patch, low, strict=True):
            x, y = max(x, 0), max(y, 0)
            cv2.matchTemplate(second[y : y + side, x : x + side], patch, cv2.TM_CCOEFF_NORMED)

    at: NDArray[np.float32] = xy.astype(np.float32)[:, None]
    guess: NDArray[np.float32] = start.astype(np.float32)[:, None]
    flags: dict[str, Any] = {"winSize": (9, 9), "maxLevel": 0, "flags": cv2.OPTFLOW_USE_INITIAL_FLOW}
    return {
        "search, ours / matchTemplate at all places": {
            "OpenCV": match,
            "ours": lambda: search(second, corners, templates.patch, xy, RADIUS),
        },
        "refinement, ours / Lucas-Kanade": {
            "OpenCV": lambda: cv2.calcOpticalFlowPyrLK(first, second, at, guess.copy(), **flags),
            "ours": lambda: refine(second, templates.patch, start),
        },
    }

"""Part of ``vslam-ref bench features``: binary descriptors and ORB, beside OpenCV.

===== =========================================================================================
goal  what is measured, on one thread, in CPU time of the thread, medians of paired ratios
===== =========================================================================================
FE-3  distances of 1000 x 1000 descriptors and the nearest of each, over ``cv2.BFMatcher.match``;
      1 x NumPy, 0.2 x Numba
===== =========================================================================================

Ratios to ``knnMatch`` with two neighbours (our matches with ratio and both ways), and of the extraction of
1000 features to one ``cv2.FAST`` of the picture and to OpenCV's ORB, are shown and have no goal.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from vslam_ref.bench.rows import Row, row
from vslam_ref.features import hamming
from vslam_ref.features.levels import Bytes
from vslam_ref.features.orb import extract
from vslam_ref.support.timing import paired

COUNT, BYTES, FEATURES, THRESHOLD = 1000, 32, 1000, 10
GOALS_FE_3 = {"numpy": 1.0, "numba": 0.2}
CLOCK = time.thread_time


def descriptors(count: int = COUNT) -> tuple[Bytes, Bytes]:
    """Two sets of descriptors whose bits are all as likely as not."""
    rng = np.random.default_rng(3)
    a, b = (rng.integers(0, 256, (count, BYTES), dtype=np.uint8) for _ in range(2))
    return a, b


def measure_hamming(backend: str, quick: bool) -> list[Row]:
    """Rows of distances and matches."""
    import cv2

    a, b = descriptors()
    matcher = cv2.BFMatcher(cv2.NORM_HAMMING)
    repeats = 3 if quick else 15
    nearest = paired(
        {
            "OpenCV": lambda: matcher.match(a, b),
            "ours": lambda: hamming.match(a, b, ratio=None, mutual=False),
        },
        repeats,
        clock=CLOCK,
    )
    both = paired(
        {"OpenCV": lambda: matcher.knnMatch(a, b, 2), "ours": lambda: hamming.match(a, b)},
        repeats,
        clock=CLOCK,
    )
    case = f"{COUNT} x {COUNT} descriptors of {8 * BYTES} bits"
    return [
        row("FE-3", f"{case}, ours", backend, 1e3 * nearest.seconds["ours"], "ms"),
        row(
            "FE-3",
            f"{case}, ours / BFMatcher",
            backend,
            nearest.ratio["ours"],
            "x",
            GOALS_FE_3[backend],
        ),
        row("FE-3", f"{case}, ratio and both ways / knnMatch", backend, both.ratio["ours"], "x"),
    ]


def measure_extraction(name: str, image: Bytes, backend: str, quick: bool) -> list[Row]:
    """Rows of the extraction from a picture."""
    import cv2

    detector = cv2.FastFeatureDetector.create(THRESHOLD, False)
    orb = cv2.ORB.create(FEATURES)
    things: dict[str, Callable[[], object]] = {
        "one cv2.FAST": lambda: detector.detect(image),
        "OpenCV": lambda: orb.detectAndCompute(image, None),
        "ours": lambda: extract(image),
    }
    found = paired(things, 3 if quick else 15, clock=CLOCK)
    case = f"{name}: ORB, {FEATURES} features"
    return [
        row("ORB", f"{case}, ours", backend, 1e3 * found.seconds["ours"], "ms"),
        row("ORB", f"{case} / one cv2.FAST", backend, found.ratio["ours"], "x"),
        row("ORB", f"{case}, ours / OpenCV", backend, found.ratio["ours"] / found.ratio["OpenCV"], "x"),
    ]

"""Part of ``vslam-ref bench features``: FREAK's description of given key points, beside OpenCV's ORB.

Both describe the same corners of five octaves; ORB needs their octaves' pictures and smooths them, FREAK one
table of sums.  Times are of all of it, for each key point, on one thread; there is no goal.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from vslam_ref.bench.rows import Row, row
from vslam_ref.features.freak import describe
from vslam_ref.features.freak.learning import key_points
from vslam_ref.features.levels import Bytes
from vslam_ref.features.orb import OrbSettings
from vslam_ref.support.timing import paired

SETTINGS = OrbSettings(features=1000, octaves=5)


def measure_description(name: str, image: Bytes, backend: str, quick: bool) -> list[Row]:
    """Rows of the description of a picture's key points; those that either drops are left out."""
    import cv2

    uv, scale = key_points(image, SETTINGS)
    kept = describe(image, uv, scale).kept
    uv, scale = uv[kept], scale[kept]
    orb = cv2.ORB.create(len(uv), SETTINGS.scale, SETTINGS.octaves, edgeThreshold=0)
    given = [
        cv2.KeyPoint(float(u), float(v), 31 * float(s), 30.0, 0.0, round(math.log(s, SETTINGS.scale)))
        for (u, v), s in zip(uv, scale, strict=True)
    ]
    things: dict[str, Callable[[], object]] = {
        "OpenCV": lambda: orb.compute(image, given),
        "ours": lambda: describe(image, uv, scale),
    }
    found = paired(things, 3 if quick else 15, clock=time.thread_time)
    case = f"{name}: FREAK, {len(uv)} key points"
    return [
        row("FREAK", f"{case}, ours", backend, 1e6 * found.seconds["ours"] / len(uv), "us"),
        row("FREAK", f"{case}, ours / OpenCV's ORB", backend, found.ratio["ours"], "x"),
    ]

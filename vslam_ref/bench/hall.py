"""``vslam-ref bench hall``: pictures of the hall on this machine, beside OpenCV's warps.

===== =========================================================================================
goal  what is measured, on one thread, in CPU time of the thread
===== =========================================================================================
HALL  640 x 480 pictures a second of the rendered hall: at least 30 with Numba, 3 with NumPy
===== =========================================================================================

The ratio to one ``cv2.warpPerspective`` of a picture of that size has no goal, as the two do not do the same:
a picture of the hall finds what each pixel sees among some hundred quads, takes the mean over its footprint,
and softens borders; the warp looks up one plane, bilinearly, without any mean.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from vslam_ref.bench.rows import Row, measured, on_each_backend, row
from vslam_ref.support.timing import Paired, paired
from vslam_ref.worlds.rendered import RenderedScene, scene

GOALS = {"numpy": 3.0, "numba": 30.0}
PICTURES = 16
"""Along the lap, of each camera."""
H = np.array([[0.98, 0.05, 3.0], [-0.04, 0.97, 5.0], [1e-5, 2e-5, 1.0]])


def run(quick: bool = False) -> dict[str, Any]:
    """Measure everything on one thread; ``rows`` is a list of flat records."""
    import cv2

    cv2.setNumThreads(1)
    rows = measured("hall", on_each_backend(quick, pictures))
    return {"rows": rows, "threads": 1, "peer": f"OpenCV {cv2.__version__}"}


def pictures(backend: str, quick: bool) -> list[Row]:
    """Rows of both cameras: the mean over pictures along the lap, and its ratio to a warp."""
    rows = []
    for name in ("hall", "hall-ahead"):
        made = scene(name)
        chosen = np.linspace(0, len(made) - 1, 4 if quick else PICTURES).astype(int).tolist()
        found = [timed(made, k) for k in chosen]
        seconds = float(np.mean([f.seconds["ours"] for f in found]))
        ratio = float(np.median([f.ratio["ours"] for f in found]))
        rows += [
            row("HALL", f"{name}, pictures", backend, 1 / seconds, "1/s", GOALS[backend], below=False),
            row("HALL", f"{name}, a picture", backend, 1e3 * seconds, "ms"),
            row("HALL", f"{name}, a picture / warpPerspective", backend, ratio, "x"),
        ]
    return rows


def timed(made: RenderedScene, k: int) -> Paired:
    """Picture k, and a warp of it, in turn."""
    import cv2

    picture = made.frame(k)
    things = {
        "OpenCV": lambda: cv2.warpPerspective(picture, H, made.size),
        "ours": lambda: made.frame(k),
    }
    return paired(things, 3, clock=time.thread_time)

"""``vslam-ref bench ptam``: PTAM picture by picture, beside one ``cv2.FAST`` of the same picture.

===== =========================================================================================
goal  what is measured, on one thread, in CPU time of the thread, medians over runs
===== =========================================================================================
FE-1  a picture tracked, 20 x one ``cv2.FAST``, and with mapping in line, 45 x, with Numba;
      NumPy tracks 15 pictures a second at least, and 5 with mapping
FE-4  the pose from 1000 points, ten steps of Tukey's loss, over one refinement by ``cv2.solvePnP``,
      which has no loss; 1.5 x Numba, 3.5 x NumPy
===== =========================================================================================

The system is called as users call it, :meth:`~vslam_ref.systems.ptam.Ptam.step`, with its own settings.  The
first 300 pictures of ``7scenes_redkitchen`` count from the first that is tracked; where that set is not
found, a rendered desk takes its place, and the rows say so.  *Tracked* is the median over pictures of their
own ratio, without the stages of the mapper.  *With mapping* divides the sum over all pictures by that of
``cv2.FAST``: a tenth of the pictures are keyframes, which a median would not see.  Not all pictures show the
1000 points that may be tried: the rows tell the median number.
"""

from __future__ import annotations

import functools
import time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.bench.rows import Row, measured, on_each_backend, row
from vslam_ref.datasets import catalogue
from vslam_ref.datasets.sequences import open_sequence
from vslam_ref.estimation.pose_tracking import track_pose
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, Pinhole
from vslam_ref.support.timing import paired
from vslam_ref.systems.ptam import Ptam
from vslam_ref.worlds.rendered import scene

THRESHOLD, FRAMES, RUNS = 10, 300, 7
QUICK_FRAMES, QUICK_RUNS = 60, 1
MAPPER = ("look again", "new points", "neighbours", "local", "global")
TRACKED, MAPPED, PICTURES = 20.0, 45.0, (15.0, 5.0)
GOALS_FE_4 = {"numpy": 3.5, "numba": 1.5}
POINTS = 1000


class FilmedPlace(NamedTuple):
    """Pictures (K, H, W) of one camera, and where they are from."""

    name: str
    camera: Camera
    pictures: list[NDArray[np.uint8]]


class Times(NamedTuple):
    """Of each picture (K,) after the start: seconds of tracking, mapping, one FAST; points; keyframes."""

    tracking: Array
    mapping: Array
    fast: Array
    tried: Array
    keyframes: int


def run(quick: bool = False) -> dict[str, Any]:
    """Measure everything on one thread; ``rows`` is a list of flat records."""
    import cv2

    cv2.setNumThreads(1)
    rows = measured("ptam", on_each_backend(quick, ptam, pose))
    return {"rows": rows, "threads": 1, "peer": f"OpenCV {cv2.__version__}"}


@functools.cache
def film(frames: int) -> FilmedPlace:
    """The first pictures of the kitchen, or else of a rendered desk."""
    if catalogue.find("7scenes_redkitchen") is not None:
        sequence = open_sequence("7scenes_redkitchen").part(0, frames, 1)
        assert sequence.camera is not None
        return FilmedPlace("kitchen", sequence.camera, [i.grey for i in sequence if i.grey is not None])
    world = scene("desk", 0, size=(640, 480), frames=FRAMES)
    return FilmedPlace("rendered desk, no kitchen", world.camera, [world.frame(k) for k in range(frames)])


def ptam(backend: str, quick: bool) -> list[Row]:
    """Goal FE-1: both ratios, and pictures a second."""
    given = film(QUICK_FRAMES if quick else FRAMES)
    runs = [timed(given) for _ in range(QUICK_RUNS if quick else RUNS)]
    one = runs[0]
    if not len(one.fast):
        return [row("FE-1", f"{given.name}: PTAM did not start", backend, np.nan, "")]
    counts = f"{len(one.fast)} pictures, {np.median(one.tried):.0f} points tried, {one.keyframes} keyframes"
    each = {
        "tracked": [float(np.median(t.tracking / t.fast)) for t in runs],
        "with mapping": [float((t.tracking + t.mapping).sum() / t.fast.sum()) for t in runs],
    }
    seconds = {
        "tracked": [float(np.median(t.tracking)) for t in runs],
        "with mapping": [float((t.tracking + t.mapping).mean()) for t in runs],
    }
    found = []
    for (name, ratios), limit, least in zip(each.items(), (TRACKED, MAPPED), PICTURES, strict=True):
        case = f"{given.name}: {name} ({counts})"
        spread = f"{given.name}: {name} / one cv2.FAST ({min(ratios):.1f} to {max(ratios):.1f})"
        bounds = (limit, None) if backend == "numba" else (None, least)
        found.append(row("FE-1", spread, backend, float(np.median(ratios)), "x", bounds[0]))
        rate = 1.0 / float(np.median(seconds[name]))
        found.append(row("FE-1", case, backend, rate, "pictures/s", bounds[1], below=False))
    return found


def timed(given: FilmedPlace) -> Times:
    """One run over the film; before the system, FAST looks at a picture twice, and the second time counts."""
    import cv2

    detector, system = cv2.FastFeatureDetector.create(THRESHOLD, False), Ptam(given.camera)
    rows: list[list[float]] = []
    keyframes = 0
    for number, picture in enumerate(given.pictures):
        detector.detect(picture)
        began = time.thread_time()
        detector.detect(picture)
        fast = time.thread_time() - began
        outcome = system.step(number, picture)
        if outcome.tracked is None:
            continue
        mapping = sum(outcome.stages.get(stage, 0.0) for stage in MAPPER)
        tracking = sum(outcome.stages.values()) - mapping
        rows.append([tracking, mapping, fast, len(outcome.tracked.fine.seen.point)])
        keyframes += outcome.mapped is not None
    columns = np.array(rows, np.float64).reshape(-1, 4).T
    return Times(columns[0], columns[1], columns[2], columns[3], keyframes)


class Sighted(NamedTuple):
    """Points (N, 3) that a camera sees at pixels (N, 2), and a guess of its pose (4, 4), metres."""

    camera: Pinhole
    X_world: Array
    uv: Array
    T_guess: Array


def sighted() -> Sighted:
    """A thousand points, pixels with noise of half a pixel, and a guess that is off by centimetres."""
    rng, camera = np.random.default_rng(0), Pinhole(525.0, 525.0, 319.5, 239.5)
    X = camera.unproject(rng.uniform([0, 0], [640, 480], (POINTS, 2))).bearing * rng.uniform(
        1, 5, (POINTS, 1)
    )
    uv = camera.project(X).uv + rng.normal(0, 0.5, (POINTS, 2))
    return Sighted(camera, X, uv, se3.exp(rng.normal(0, 0.02, 6)))


def pose(backend: str, quick: bool) -> list[Row]:
    """Goal FE-4."""
    import cv2

    camera, X, uv, T = sighted()
    rotation, _ = cv2.Rodrigues(T[:3, :3])
    lens: NDArray[np.float64] = np.zeros(4)

    def opencv() -> object:
        r, t = rotation.copy(), T[:3, 3].copy()
        return cv2.solvePnP(X, uv, camera.matrix, lens, r, t, True, cv2.SOLVEPNP_ITERATIVE)

    def ours() -> object:
        return track_pose(camera, X, uv, T)

    ratio = paired({"OpenCV": opencv, "ours": ours}, 3 if quick else 15, clock=time.thread_time)
    name = f"pose from {POINTS} points, 10 steps of Tukey's loss"
    bound = GOALS_FE_4[backend]
    return [
        row("FE-4", f"{name}, ours", backend, 1e3 * ratio.seconds["ours"], "ms"),
        row("FE-4", f"{name}, ours / cv2.solvePnP refining", backend, ratio.ratio["ours"], "x", bound),
    ]

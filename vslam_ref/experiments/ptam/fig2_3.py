"""Figure 2.3: the start, the tracked points, and a house on the plane that was found.

Drawn from a run over the rendered desk, where the true plane and the true poses are known: so the figure's
third picture can be judged.  The plane's normal is compared with the desk's, and the house's feet must stay
where they stand while the camera moves: as drawn, they must be pictures of fixed points of the world by the
true poses.

Implements A fig 2.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.datasets.sequences import open_sequence
from vslam_ref.estimation.triangulation import triangulate
from vslam_ref.experiments.framework import Claim, Experiment, Study, judged
from vslam_ref.experiments.visual_slam import numbers, overlay, running, solids
from vslam_ref.geometry import se3
from vslam_ref.geometry.alignment import Alignment
from vslam_ref.geometry.multiview import Views
from vslam_ref.support.config import assume
from vslam_ref.systems.ptam.settings import Settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SOURCE = "A, fig 2.3"
TILT, HEIGHT, SLIP = 2.0, 0.022, 1.0
"""Degrees between the planes; metres between them: the thickness of the keyboard, one of the flat things that
lie on the desk; pixels that the house may slip."""
SEEDS = 10**9
"""A scene's name takes nine digits."""


@dataclass(frozen=True)
class Fig23Config:
    """The desks."""

    runs: int = assume(5, "desks", "each is another arrangement of things")
    seed: int = assume(23, "", "any; fixed for repeatability")
    pictures: int = assume(90, "pictures", "3 s: the start, and a walk around")

    def __post_init__(self) -> None:
        """Refuse runs that cannot start."""
        if self.runs < 1 or self.pictures < 20:
            raise ValueError(f"runs={self.runs}, pictures={self.pictures}: need at least 1 and 20")


class Fig23Run(NamedTuple):
    """One desk; NaN where there is no plane.

    Attributes
    ----------
    started : ndarray of bool
    tilt, height : ndarray
        Between the plane found and the desk's: degrees, and metres at the plane's origin.
    slip : ndarray
        Pixels that 95 % of the house's feet slip at most, against points that stand still.
    points : ndarray
        Tracked in a picture, median.
    """

    started: BoolArray
    tilt: Array
    height: Array
    slip: Array
    points: IntArray


class Pictures(NamedTuple):
    """The three pictures (H, W, 3), and their numbers."""

    images: tuple[NDArray[np.uint8], ...]
    numbers: tuple[int, ...]


def desk_seed(seed: np.random.SeedSequence) -> int:
    """Return the seed of a run's desk."""
    return int(seed.generate_state(1)[0]) % SEEDS


def follow(config: Fig23Config, seed: int) -> running.Run:
    """Run PTAM over one desk."""
    return running.run(open_sequence(f"desk:{seed}").part(0, config.pictures), Settings())


def simulate(config: Fig23Config, point: None, seed: np.random.SeedSequence) -> Fig23Run:
    """Judge plane and house on one desk."""
    done = follow(config, desk_seed(seed))
    stage = overlay.stage_on(done, overlay.find_plane(done))
    which, T = running.path(done)
    alignment = numbers.accuracy(done.sequence, which, T).alignment
    tracked = [frame.found for frame in done.frames if frame.state in (running.GOOD, running.POOR)]
    points = np.array(int(np.median(tracked)) if tracked else 0)
    if stage is None or alignment is None:
        nan = np.array(np.nan)
        return Fig23Run(np.array(done.system.map is not None), nan, nan, nan, points)
    tilt, height = plane_error(stage, alignment)
    slip = float(np.percentile(slips(done, stage), 95))
    return Fig23Run(np.array(True), np.array(tilt), np.array(height), np.array(slip), points)


def plane_error(stage: overlay.Stage, S_world_map: Alignment) -> tuple[float, float]:
    """Tilt (degrees) and height (metres) of the plane found over the desk's top, z = 0."""
    T_map_plane = se3.inverse(stage.T_plane_world)
    normal = S_world_map.R_target_source @ T_map_plane[:3, 2]
    origin = _to_world(S_world_map, T_map_plane[:3, 3])
    return float(np.degrees(np.arccos(np.clip(normal[2], -1, 1)))), float(abs(origin[2]))


def _to_world(S: Alignment, X_map: Array) -> Array:
    return np.asarray(S.scale * X_map @ S.R_target_source.T + S.t_target_source)


def slips(done: running.Run, stage: overlay.Stage) -> Array:
    """Pixels (4, pictures) between the house's feet as drawn and the points of the world that fit best.

    Each foot is triangulated from all its drawn pixels with the true poses.  So only motion against the scene
    counts, as a person sees it, and not where in the room the whole house stands.
    """
    truth, camera = done.sequence.truth, done.sequence.camera
    assert truth is not None
    assert camera is not None
    walls = solids.house(stage.cell)
    feet = np.concatenate([walls[0].corners[:2], walls[1].corners[:2]])
    X_map = se3.act(se3.inverse(stage.T_plane_world), feet)
    which, T_cam_map = running.path(done)
    T_cam_world = se3.inverse(se3.from_rt(truth.R_world_body[which], truth.t_world_body[which]))
    drawn = camera.pixel_from_world(T_cam_map[:, None], X_map)
    ok = drawn.valid.all(1)
    uv = np.swapaxes(drawn.uv[ok], 0, 1)
    points = triangulate(Views(camera, T_cam_world[ok]), uv, min_parallax=0.0)
    again = camera.pixel_from_world(T_cam_world[ok][:, None], points.X_world)
    return np.asarray(np.hypot(*np.moveaxis(np.swapaxes(again.uv, 0, 1) - uv, -1, 0)))


def pictures(config: Fig23Config) -> Pictures:
    """Draw the start, the tracked points, and the house, from the first desk."""
    done = follow(config, desk_seed(np.random.SeedSequence(config.seed).spawn(1)[0]))
    poses = dict(zip(*(values for values in running.path(done)), strict=True))
    stage = overlay.stage_on(done, overlay.find_plane(done))
    start = next((k for k, frame in enumerate(done.frames) if frame.state == running.START), 0)
    shown = (start, (start + len(done.frames)) // 2, len(done.frames) - 1)
    images = []
    for k, standing in zip(shown, (None, None, stage), strict=True):
        frame = done.frames[k]
        images.append(overlay.picture(done, frame, poses.get(frame.number), standing, 1.0))
    return Pictures(tuple(images), tuple(done.frames[k].number for k in shown))


# --- claims ---------------------------------------------------------------------------------------


def claims(study: Study[Fig23Run]) -> list[Claim]:
    """Judge the plane, and that the house stands still on it."""
    return [_plane(study.data), _stands(study.data)]


def _plane(data: Fig23Run) -> Claim:
    holds = (data.tilt <= TILT) & (data.height <= HEIGHT)
    return judged(
        "plane-is-the-desk",
        SOURCE,
        "The plane under the points is found: the desk's top",
        f"in every run at most {TILT:g} degrees and {1000 * HEIGHT:g} mm from the true one",
        bool(holds.all()),
        f"The plane found lies {_most(data.tilt):.2g} degrees and {1000 * _most(data.height):.2g} mm off the "
        "desk's top at most",
        {"tilt_deg": data.tilt.tolist(), "height_m": data.height.tolist()},
        share=float(holds.mean()),
    )


def _stands(data: Fig23Run) -> Claim:
    holds = data.slip <= SLIP
    return judged(
        "the-house-stands-still",
        SOURCE,
        "What is drawn on the plane stands still there while the camera moves",
        f"in every run 95 % of the feet within {SLIP:g} px of fixed points of the world, by the true poses",
        bool(holds.all()),
        f"The house's feet slip by {_most(data.slip):.2g} px at most in 95 % of the pictures; {SLIP:g} px "
        "are allowed",
        {"slip_px": data.slip.tolist()},
        share=float(holds.mean()),
    )


def _most(values: Array) -> float:
    return float(np.max(values)) if np.isfinite(values).all() else float("nan")


def series(study: Study[Fig23Run]) -> dict[str, object]:
    """Errors of the planes, and which pictures are shown."""
    return {"pictures": study.once.numbers} | {k: np.asarray(v) for k, v in study.data._asdict().items()}


COLOURS = (
    "green: from the first picture to this one",
    "vermilion, yellow, sky blue, blue: levels 0, 1, 2, 3",
    "white: a grid on the plane",
)
"""What the colours in the three pictures mean."""


def figure(study: Study[Fig23Run]) -> Figure:
    """The three pictures."""
    from vslam_ref.plot.visual_slam import pictures_figure

    words = ("start: corners and how they moved", "points tracked, by level", "a house on the plane found")
    titles = [f"picture {n}: {text}" for n, text in zip(study.once.numbers, words, strict=True)]
    return pictures_figure(study.once.images, titles, COLOURS)


EXPERIMENT = Experiment(
    id="ptam-fig2.3",
    title="The start, tracked points, and a house on the plane",
    source="A, figure 2.3",
    config_type=Fig23Config,
    simulate=simulate,
    once=pictures,
    series=series,
    claims=claims,
    figure=figure,
    about={
        "started": "whether there was a map; (runs,)",
        "tilt": "between the plane found and the desk's, degrees; (runs,)",
        "height": "between them at the plane's origin, m; (runs,)",
        "slip": "that 95 % of the house's feet move at most, px; (runs,)",
        "points": "points tracked in a picture, median; (runs,)",
    },
    quick={"runs": 1, "pictures": 40},
)

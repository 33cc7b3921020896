"""One pass over the points, or two: how large a motion between two pictures may be.

A map of the rendered desk is made; then the camera jumps: it turns by some pixels, in a random direction.
The prediction is the old pose.  Three ways to the new one::

    one narrow pass   all points, within 5 px of where they are expected
    one wide pass     all points, within 40 px
    two passes        60 large points within 40 px -> pose -> all points within 5 px

A pose is found if it puts the points within a pixel of where the true turn puts them.  The work is counted in
comparisons of a point's patch with a corner of the picture: those within its radius.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Study, judged
from vslam_ref.experiments.framework.claims import LEAST_FOR_EVERY_RUN
from vslam_ref.experiments.ptam.wrong_matches import moved
from vslam_ref.features import level_from_finest, level_sigma
from vslam_ref.geometry import se3
from vslam_ref.support.config import assume
from vslam_ref.systems.ptam.look import prepare
from vslam_ref.systems.ptam.ptam import Ptam
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.tracker.coarse_fine import Pass, coarse, fine
from vslam_ref.systems.visual_map import PreparedPicture, VisualMap, visible
from vslam_ref.worlds.rendered import Effects, RenderedScene, raster, scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WAYS = ("narrow", "wide", "two")
WORDS = {"narrow": "one narrow pass", "wide": "one wide pass", "two": "two passes"}
FOUND = 1.0
"""Pixels, root mean square, between where a pose and the true turn put the points."""
SURE = 0.9
"""Share of jumps that are tracked: a motion counts as trackable."""
SOURCE = "A§2.2.1"


@dataclass(frozen=True)
class PassesConfig:
    """The desk, the jumps, and the two radii."""

    runs: int = assume(8, "desks", "each with some jumps of every size")
    seed: int = assume(221, "", "any; fixed for repeatability")
    pictures: int = assume(60, "pictures", "that make the map: 2 s")
    jumps: int = assume(6, "directions", "of every size")
    pixels: tuple[float, ...] = assume(
        (0.0, 2.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0, 48.0, 64.0), "px", "in the middle of the picture"
    )
    narrow: float = assume(5.0, "px", "the system's radius of the fine pass")
    wide: float = assume(40.0, "px", "the system's widest radius of the coarse pass")
    noise: float = assume(2.0, "grey levels", "a usual camera indoors")

    def __post_init__(self) -> None:
        """Refuse jumps that mean nothing."""
        if self.runs < 1 or self.jumps < 1 or self.pictures < 20:
            raise ValueError("need at least one run, one jump, and 20 pictures")
        if not (0 < self.narrow < self.wide) or self.pixels != tuple(sorted(self.pixels)):
            raise ValueError("need 0 < narrow < wide, and jumps that grow")


class PassesRun(NamedTuple):
    """Of one desk.

    Attributes
    ----------
    error : ndarray, shape (ways, sizes, jumps)
        Pixels; infinite where no pose was found.
    compared : ndarray, shape (ways, sizes, jumps)
        Patches compared with corners.
    points : ndarray, shape ()
        That were visible before the jump.
    """

    error: Array
    compared: Array
    points: Array


def simulate(config: PassesConfig, point: None, seed: np.random.SeedSequence) -> PassesRun:
    """Make a map, then jump."""
    rng = np.random.default_rng(seed)
    made = scene(
        "desk", int(rng.integers(2**31)), frames=config.pictures, effects=Effects(noise=config.noise)
    )
    system = Ptam(made.camera, Settings())
    for k in range(config.pictures):
        system.step(k, made.frame(k))
    shape = len(WAYS), len(config.pixels), config.jumps
    if system.map is None:
        return PassesRun(np.full(shape, np.inf), np.zeros(shape), np.array(0))
    numbers, poses = system.trajectory()
    T_last = poses[-1] if numbers[-1] == config.pictures - 1 else se3.identity()
    error, compared = np.full(shape, np.inf), np.zeros(shape)
    for i, size in enumerate(config.pixels):
        for j in range(config.jumps):
            turn = _turn(made, size, rng)
            picture = prepare(-1, _seen(made, turn, rng), system.settings.features)
            for w, way in enumerate(WAYS):
                T, work = tracked(config, system.map, picture, T_last, way, system.settings, rng)
                error[w, i, j] = _error(system.map, T, turn @ T_last) if T is not None else np.inf
                compared[w, i, j] = work
    return PassesRun(error, compared, np.array(len(visible(system.map, T_last).point)))


def _turn(made: RenderedScene, size: float, rng: np.random.Generator) -> Array:
    """A turn (4, 4) of the camera that moves the middle of the picture by ``size`` pixels."""
    direction = rng.uniform(-np.pi, np.pi)
    angle = np.arctan(size / made.camera.fx)
    return se3.exp(np.array([0, 0, 0, angle * np.cos(direction), angle * np.sin(direction), 0.0]))


def _seen(made: RenderedScene, turn: Array, rng: np.random.Generator) -> Array:
    """The picture after the turn, with noise, grey (H, W)."""
    light = raster.render(made.quads, made.textures, made.rays, turn @ made.T_cam_world[-1])
    light = light + made.effects.noise * rng.standard_normal(light.shape)
    return np.floor(np.clip(light, 0, 255) + 0.5).astype(np.uint8)


def tracked(
    config: PassesConfig,
    visual_map: VisualMap,
    picture: PreparedPicture,
    T_guess: Array,
    way: str,
    settings: Settings,
    rng: np.random.Generator,
) -> tuple[Array | None, int]:
    """Pose (4, 4) from a guess in one of the three ways, or None; and how many patches were compared."""
    s, looks = settings.tracker, settings.features.looks
    work = 0
    if way == "two":
        first = coarse(visual_map, picture, T_guess, config.wide, s, looks, rng)
        work += comparisons(first, picture, config.wide)
        if first.pose.reason:
            return None, work
        T_guess = first.pose.T_cam_world
    radius = config.wide if way == "wide" else config.narrow
    last = fine(visual_map, picture, T_guess, radius, s, looks, rng)
    work += comparisons(last, picture, radius)
    return (None if last.pose.reason else last.pose.T_cam_world), work


def comparisons(done: Pass, picture: PreparedPicture, radius: float) -> int:
    """Corners within the radius of each point that was tried, on its own level, added up."""
    from scipy.spatial import cKDTree

    total = 0
    for level, corners in enumerate(picture.corners):
        at = level_from_finest(done.seen.uv[done.seen.level == level], level)
        if len(at) and len(corners.xy):
            reach = radius / float(level_sigma(level))
            total += int(cKDTree(corners.xy).query_ball_point(at, reach, return_length=True).sum())
    return total


def _error(visual_map: VisualMap, T: Array, T_true: Array) -> float:
    """Root mean square distance, pixels, between where two poses put the points that both see."""
    X = visual_map.X_world[visible(visual_map, T_true).point]
    return moved(visual_map.camera, T, T_true, X)


# --- claims ---------------------------------------------------------------------------------------


def shares(study: Study[PassesRun]) -> Array:
    """Share of jumps that were tracked, (ways, sizes)."""
    return np.asarray((study.data.error < FOUND).mean((0, 3)), np.float64)


def reach(pixels: tuple[float, ...], share: Array) -> float:
    """Largest size up to which every share (sizes,) is at least SURE; 0 if there is none."""
    below = np.flatnonzero(share < SURE)
    last = below[0] - 1 if len(below) else len(share) - 1
    return float(pixels[last]) if last >= 0 else 0.0


def claims(study: Study[PassesRun]) -> list[Claim]:
    """Judge what the two passes are for, and what they save."""
    return [_steadier(study), _cheaper(study)]


def _steadier(study: Study[PassesRun]) -> Claim:
    share = shares(study)
    narrow, two = (reach(study.config.pixels, share[WAYS.index(way)]) for way in ("narrow", "two"))
    return judged(
        "two-passes-are-steadier",
        SOURCE,
        "Tracking is done twice, with few points and then with many, to make it steady",
        f"largest jump of which {SURE:.0%} are tracked: two passes at least twice the narrow pass alone",
        two >= 2 * narrow and two > 0,
        f"Two passes follow jumps of up to {two:g} px, the narrow pass alone up to {narrow:g} px",
        {
            "two_px": two,
            "narrow_px": narrow,
            "wide_px": reach(study.config.pixels, share[WAYS.index("wide")]),
        },
        runs=study.runs,
        least_runs=LEAST_FOR_EVERY_RUN,
    )


def _cheaper(study: Study[PassesRun]) -> Claim:
    work = {way: study.data.compared[:, i].mean((1, 2)) for i, way in enumerate(WAYS)}
    ratio = work["wide"] / np.maximum(work["two"], 1.0)
    share = shares(study)
    wide, two = (reach(study.config.pixels, share[WAYS.index(way)]) for way in ("wide", "two"))
    return judged(
        "and-cheaper-than-one-wide-pass",
        SOURCE,
        "One pass with the wide radius follows as far at best, and compares several times as many patches",
        "in every run at least 3 times the comparisons of the two passes; its largest jump not above theirs",
        bool((ratio >= 3).all()) and wide <= two,
        f"One wide pass compares {ratio.min():.3g} to {ratio.max():.3g} times as many patches as two passes, "
        f"and follows jumps of up to {wide:g} px, two passes up to {two:g} px",
        {"ratio": ratio.tolist(), "wide_px": wide, "two_px": two},
        share=float(np.mean(ratio >= 3)),
    )


def series(study: Study[PassesRun]) -> dict[str, object]:
    """Shares that were tracked, and comparisons, by size of the jump."""
    return {
        "pixels": study.config.pixels,
        "tracked": dict(zip(WAYS, shares(study), strict=True)),
        "compared": dict(zip(WAYS, study.data.compared.mean((0, 3)), strict=True)),
    }


def figure(study: Study[PassesRun]) -> Figure:
    """Shares that were tracked, and comparisons, over the size of the jump."""
    from vslam_ref.plot.tracking_studies import passes_figure

    compared = study.data.compared.mean((0, 3))
    return passes_figure(np.asarray(study.config.pixels), shares(study), compared, list(WORDS.values()), SURE)


EXPERIMENT = Experiment(
    id="ptam-coarse-to-fine",
    title="One pass over the points, or two",
    source="A, section 2.2.1",
    config_type=PassesConfig,
    simulate=simulate,
    series=series,
    claims=claims,
    figure=figure,
    about={
        "error": "where the pose puts the points against the truth, px; (runs, ways, sizes, jumps)",
        "compared": "patches compared with corners; (runs, ways, sizes, jumps)",
        "points": "visible points before the jump; (runs,)",
    },
    quick={"runs": 1, "jumps": 2, "pictures": 40, "pixels": (0.0, 4.0, 8.0, 16.0, 32.0)},
)

"""Near-pure rotation: a map is made by moving sideways, then the camera turns to what it has never seen.

The camera turns about a point ``arm`` metres behind its lens, as on a tripod (0), a wrist, or an outstretched
arm.  The base line that new points can be triangulated from is the arm's; their rays need a parallax.  So an
arm of 0 gives no new points, and when the old ones have left the picture, the camera is lost::

    start: sideways -> map -> turn, arm 0      -> old points leave -> lost before one field of view
                           -> turn, arm 0.4 m  -> new points, new keyframes -> goes on

And a camera that only turns must not start at all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.experiments.framework import Claim, Experiment, Study, judged
from vslam_ref.experiments.framework.claims import LEAST_FOR_EVERY_RUN
from vslam_ref.support.config import assume
from vslam_ref.systems.ptam.ptam import Ptam
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.tracker.quality import Quality
from vslam_ref.worlds.rendered import Effects, RenderedScene, motion, scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GIVEN_UP = 5
"""Pictures lost in a row, after which the run ends: it looks at what it has never seen."""
SOURCE = "A§1.3.3"


@dataclass(frozen=True)
class TurningConfig:
    """The room and the motion."""

    runs: int = assume(6, "rooms", "each takes some 15 seconds an arm; the effect is large")
    seed: int = assume(133, "", "any; fixed for repeatability")
    arms: tuple[float, ...] = assume(
        (0.0, 0.05, 0.1, 0.2, 0.4), "m", "a tripod, a wrist, a hand, a forearm, an outstretched arm"
    )
    aside: float = assume(0.4, "m", "the way that makes the map; walls are 2.5 m away")
    moving: int = assume(60, "pictures", "of that way: 2 s")
    turn: float = assume(120.0, "degrees", "twice the field of view: at the end nothing of the start is seen")
    turning: int = assume(120, "pictures", "of the turn: 1 degree each")
    noise: float = assume(2.0, "grey levels", "a usual camera indoors")

    def __post_init__(self) -> None:
        """Refuse motions that mean nothing."""
        if self.runs < 1 or min(self.moving, self.turning) < 10 or self.turn <= 0 or self.aside <= 0:
            raise ValueError("need at least one run, 10 pictures of each part, turn and aside above 0")
        if 0.0 not in self.arms or max(self.arms) < 0.2:
            raise ValueError(f"arms={self.arms}: must hold 0, and one of at least 0.2 m")


class TurningRun(NamedTuple):
    """What became of one turn.

    Attributes
    ----------
    lost_at : ndarray
        Degrees turned at the last picture with a pose; NaN if there was one at the end.
    points, keyframes : ndarray
        That the turn added to the map.
    share : ndarray
        Of the pictures of the turn, with a pose.
    started : ndarray of bool
        Whether there was a map before the turn.
    alone : ndarray of bool
        Whether the turn alone, without a map before it, made a map.
    reason : ndarray of str
        Why it did not.
    """

    lost_at: Array
    points: IntArray
    keyframes: IntArray
    share: Array
    started: BoolArray
    alone: BoolArray
    reason: Array


def path(config: TurningConfig, arm: float, shake: Callable[[Array], Array]) -> motion.Path:
    """Sideways before a corner of the room, then a turn to the right about a point behind the lens."""
    moving, turning = config.moving / 30.0, config.turning / 30.0
    ahead, across = np.array([-0.7, 0.7, -0.1]), np.array([0.7, 0.7, 0.0])  # into a corner: it has depth
    last = np.array([0.0, 0.0, 1.5])
    first = last - config.aside * across

    def swing(t: Array) -> Array:
        angle = -np.radians(config.turn) * np.clip((t - moving) / turning, 0.0, 1.0)
        return np.stack([np.zeros_like(angle), angle, np.zeros_like(angle)], -1)

    turned = motion.turning(motion.looking(last, last + ahead), swing, arm)

    def both(t: Array) -> Array:
        t = np.asarray(t, np.float64)
        place = first + np.clip(t / moving, 0.0, 1.0)[..., None] * (last - first)
        sideways = motion.looking(place, place + ahead)
        return np.where((t <= moving)[..., None, None], sideways, turned(t))

    return motion.held(both, shake)


def room(config: TurningConfig, arm: float, seed: np.random.SeedSequence) -> RenderedScene:
    """The pictures: the room of the scene ``rotation``, and a path of its own."""
    things, shaking = (int(s.generate_state(1)[0]) for s in seed.spawn(2))
    made = scene("rotation", things, effects=Effects(noise=config.noise))
    rng = np.random.default_rng(shaking)
    shake = motion.tremor(rng, [0.0, 0.0, 0.0, 0.004, 0.004, 0.004])  # turns only: an arm of 0 stays one
    times = np.arange(config.moving + config.turning) / 30.0
    return replace(made, path=path(config, arm, shake), times=times)


def simulate(config: TurningConfig, arm: float, seed: np.random.SeedSequence) -> TurningRun:
    """Run PTAM over one room with one arm, and over the turn alone."""
    made = room(config, arm, seed)
    system = Ptam(made.camera, Settings())
    for k in range(config.moving):
        system.step(k, made.frame(k))
    alone, reason = _turn_alone(config, made)
    if system.map is None:
        nothing = np.array(np.nan), np.array(0), np.array(0), np.array(0.0)
        return TurningRun(*nothing, np.array(False), np.array(alone), reason)
    before = int(system.map.alive.sum()), len(system.map.keyframes)
    last, kept = _turn(config, made, system)
    through = last == config.turning - 1
    turned = config.turn * (last + 1) / config.turning
    return TurningRun(
        np.array(np.nan if through else turned),
        np.array(int(system.map.alive.sum()) - before[0]),
        np.array(len(system.map.keyframes) - before[1]),
        np.array(kept / config.turning),
        np.array(True),
        np.array(alone),
        reason,
    )


def _turn(config: TurningConfig, made: RenderedScene, system: Ptam) -> tuple[int, int]:
    """Last picture of the turn with a pose (-1: none), and how many have one."""
    last, kept = -1, 0
    for k in range(config.turning):
        outcome = system.step(config.moving + k, made.frame(config.moving + k))
        if outcome.tracked is not None and outcome.tracked.quality is not Quality.LOST:
            last, kept = k, kept + 1
        elif k - last > GIVEN_UP:
            break
    return last, kept


def _turn_alone(config: TurningConfig, made: RenderedScene) -> tuple[bool, Array]:
    """Whether the turn makes a map by itself, and why not."""
    system, reason = Ptam(made.camera, Settings()), ""
    for k in range(config.moving, config.moving + config.turning // 2):
        outcome = system.step(k, made.frame(k))
        if isinstance(outcome.attempt, str):
            reason = outcome.attempt
        elif outcome.attempt is not None:
            reason = outcome.attempt.reason or reason
    return system.map is not None, np.array(reason, "<U200")


# --- claims ---------------------------------------------------------------------------------------


def field_of_view() -> float:
    """Of the scene's camera, degrees across."""
    made = scene("rotation", frames=1)
    ends = made.camera.unproject(np.array([[-0.5, 239.5], [639.5, 239.5]])).bearing
    return float(np.degrees(np.arccos(ends[0] @ ends[1])))


def claims(study: Study[TurningRun]) -> list[Claim]:
    """Judge what A says of keyframe methods, and where it stops to be true."""
    return [
        _lost(study), _starved(study), _no_keyframes(study), _goes_on(study), _no_start(study),
    ]  # fmt: skip


def _of(study: Study[TurningRun], arm: float) -> TurningRun:
    at = study.config.arms.index(arm)
    return TurningRun(*(np.asarray(field)[at] for field in study.data))


def _lost(study: Study[TurningRun]) -> Claim:
    runs, view = _of(study, 0.0), field_of_view()
    holds = runs.started & (runs.lost_at < view)
    return judged(
        "pure-rotation-is-lost",
        SOURCE,
        "A keyframe method that turns on the spot to new things is lost when the old ones leave the picture",
        f"arm 0: in every run the last pose lies before one field of view, {view:.0f} degrees",
        bool(holds.all()),
        f"Turning on the spot, the camera was lost after {_list(np.sort(runs.lost_at))} degrees; the field "
        f"of view has {view:.0f}",
        {"lost_at_deg": runs.lost_at.tolist(), "field_of_view_deg": view},
        share=float(holds.mean()),
    )


def _starved(study: Study[TurningRun]) -> Claim:
    runs, longest = _of(study, 0.0), _of(study, max(study.config.arms))
    holds = runs.started & (runs.points <= 0.05 * longest.points)
    return judged(
        "no-parallax-no-points",
        SOURCE,
        "Turning on the spot, no new points can be triangulated: there is no parallax",
        "arm 0: in every run at most a twentieth of the points that the longest arm adds",
        bool(holds.all()),
        f"Turning on the spot added {_list(runs.points)} points, the longest arm {_list(longest.points)}",
        {"points": runs.points.tolist(), "with_the_longest_arm": longest.points.tolist()},
        share=float(holds.mean()),
    )


def _no_keyframes(study: Study[TurningRun]) -> Claim:
    runs = _of(study, 0.0)
    holds = runs.started & (runs.keyframes == 0)
    return judged(
        "no-points-no-keyframes",
        SOURCE,
        "And so no new keyframes can be made",
        "arm 0: in every run no keyframe in the turn",
        bool(holds.all()),
        f"Turning on the spot made {_list(runs.keyframes)} keyframes: this system makes one when few of the "
        "known points are left in view, with new points or without",
        {"keyframes": runs.keyframes.tolist()},
        share=float(holds.mean()),
    )


def _list(values: Array | IntArray) -> str:
    return ", ".join(f"{v:.0f}" if np.isfinite(v) else "none" for v in values)


def _goes_on(study: Study[TurningRun]) -> Claim:
    longest = max(study.config.arms)
    runs = _of(study, longest)
    holds = runs.started & np.isnan(runs.lost_at) & (runs.share > 0.9)
    return judged(
        "an-arm-is-enough",
        SOURCE,
        f"With an arm of {longest:g} m the same turn gives new points, and the camera is not lost",
        "in at least 5 of 6 of the runs a pose at the end, and for more than 90 % of the turn",
        float(holds.mean()) >= 5 / 6 - 1e-9,
        f"With an arm of {longest:g} m, {int(holds.sum())} of {len(holds)} runs came through; the shares "
        f"with a pose are {', '.join(f'{s:.0%}' for s in runs.share)}",
        {"share": runs.share.tolist()},
        share=float(holds.mean()),
        least_runs=LEAST_FOR_EVERY_RUN,
    )


def _no_start(study: Study[TurningRun]) -> Claim:
    runs = _of(study, 0.0)
    holds = ~np.asarray(runs.alone, bool) & (np.asarray(runs.reason) != "")
    return judged(
        "pure-rotation-does-not-start",
        SOURCE,
        "Without a map before it, a turn on the spot makes none: two pictures have no parallax",
        "arm 0: in every run no map, and a reason",
        bool(holds.all()),
        f"{int(np.sum(runs.alone))} of {len(holds)} turns on the spot made a map; the first one's reason: "
        f'"{runs.reason[0]}"',
        {"started": int(np.sum(runs.alone))},
        share=float(holds.mean()),
    )


def series(study: Study[TurningRun]) -> dict[str, object]:
    """Angles, points and shares by arm."""
    return {"arms": study.config.arms, "field_of_view": field_of_view()} | {
        name: np.asarray(getattr(study.data, name)) for name in ("lost_at", "points", "keyframes", "share")
    }


def figure(study: Study[TurningRun]) -> Figure:
    """Angle of the last pose, and points added, over the arm."""
    from vslam_ref.plot.tracking_studies import turning_figure

    reached = np.where(np.isnan(study.data.lost_at), study.config.turn, study.data.lost_at)
    reached = np.where(study.data.started, reached, np.nan)
    return turning_figure(
        np.asarray(study.config.arms),
        reached,
        np.asarray(study.data.points),
        field_of_view(),
        study.config.turn,
    )


EXPERIMENT = Experiment(
    id="ptam-rotation",
    title="A camera that turns on the spot, and one that turns on an arm",
    source="A, section 1.3.3",
    config_type=TurningConfig,
    simulate=simulate,
    points=lambda config: config.arms,
    series=series,
    claims=claims,
    figure=figure,
    about={
        "lost_at": "degrees turned at the last pose, NaN if it came through; (arms, runs)",
        "points": "points that the turn added to the map; (arms, runs)",
        "keyframes": "keyframes that the turn added; (arms, runs)",
        "share": "of the turn's pictures, with a pose; (arms, runs)",
        "started": "whether there was a map before the turn; (arms, runs)",
        "alone": "whether the turn alone made a map; (arms, runs)",
        "reason": "why the turn alone made none; (arms, runs)",
    },
    quick={"runs": 1, "arms": (0.0, 0.4), "turning": 60, "turn": 80.0, "moving": 40},
)

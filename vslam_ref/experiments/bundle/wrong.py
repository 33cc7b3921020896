"""Wrong observations in a bundle, and the same scene adjusted with every loss."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation.bundle import Options, Robust, Scene, bundle_adjust
from vslam_ref.estimation.robust import MAD_1D, MAD_NORM_2D, TUNED_95, Tukey, tuned
from vslam_ref.worlds.bundles import Bundle, make_bundle, moved_start, scene_error

METHODS = ("l2", "huber", "tukey", "adaptive", "ptam")
WIDER = MAD_1D / MAD_NORM_2D
"""How much too wide sigma comes out with the factor for scalars on norms of plane errors: 1.7457."""
DETERMINED = 3
"""Honest observations from which a point is judged: two of them agree on a point with any third, wrong, one
only by chance."""
FAR_SHARE = 0.2
"""Share of wrong observations with which the far start is tried."""


@dataclass(frozen=True)
class WrongConfig:
    """The scenes, the wrong observations and the starts."""

    runs: int = field(default=60, metadata={"reason": "shares are then known to about 6 %"})
    seed: int = field(default=29, metadata={"reason": "any; fixed for repeatability"})
    views: int = field(default=10, metadata={"reason": "keyframes of a small map"})
    points: int = field(default=60, metadata={"reason": "600 observations for 240 unknowns"})
    spread: float = field(
        default=0.6, metadata={"reason": "half the arc: 69 degrees of parallax", "unit": "rad"}
    )
    sigma: float = field(
        default=1.0, metadata={"reason": "of one coordinate; clear of the scale's floor of 0.4", "unit": "px"}
    )
    shares: tuple[float, ...] = field(
        default=(0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6),
        metadata={"reason": "0 to 40 % are judged; beyond one half a median breaks"},
    )
    wrong_least: float = field(
        default=6.0,
        metadata={"reason": "outside Tukey's cut, 5.1; some inside PTAM's, 8.2", "unit": "sigma"},
    )
    wrong_most: float = field(default=40.0, metadata={"reason": "a search radius", "unit": "sigma"})
    near_turn: float = field(default=0.002, metadata={"reason": "the start: some 4 px off", "unit": "rad"})
    near_move: float = field(default=0.02, metadata={"reason": "the start: some 4 px off", "unit": "m"})
    far: float = field(default=8.0, metadata={"reason": "times as far: some 35 px, beyond every cut"})

    def __post_init__(self) -> None:
        """Refuse scenes that mean nothing."""
        if self.runs < 2 or self.views < 3 or self.points < 10:
            raise ValueError("need runs >= 2, views >= 3 and points >= 10")
        if not (self.sigma > 0 and 0 < self.wrong_least <= self.wrong_most and 0 < self.spread < 1.5):
            raise ValueError("need sigma > 0, 0 < wrong_least <= wrong_most and 0 < spread < 1.5")
        if not all(0 <= s < 1 for s in self.shares) or not {0.0, 0.05, 0.2, 0.4} <= set(self.shares):
            raise ValueError(f"shares={self.shares}: need numbers in [0, 1), among them 0, 0.05, 0.2 and 0.4")


class WrongRun(NamedTuple):
    """What one scene gave; centres and points in metres, turns in radians, scales in sigma.

    Attributes
    ----------
    centre, turn, point, scale : ndarray, shape (methods, shares)
        From the near start.
    converged : ndarray of bool, shape (methods, shares)
    far_centre : ndarray, shape (methods,)
        From the far start.
    """

    centre: Array
    turn: Array
    point: Array
    scale: Array
    converged: BoolArray
    far_centre: Array


def robusts(sigma: float) -> dict[str, Robust]:
    """Every method; the scale is known, or taken from the residuals at every step."""
    ptam = Tukey(TUNED_95["tukey", 1] * WIDER)
    return {
        "l2": Robust(),
        "huber": Robust(tuned("huber", 2), sigma),
        "tukey": Robust(tuned("tukey", 2), sigma),
        "adaptive": Robust(tuned("tukey", 2), "adaptive"),
        # its floor of 0.4 px is on its own, wider sigma
        "ptam": Robust(ptam, "adaptive", least_scale=0.4 / WIDER),
    }


class Measured(NamedTuple):
    """Pixels (n, 2) with a share of wrong ones, and which are honest (n,)."""

    uv: Array
    honest: BoolArray


def measure(bundle: Bundle, config: WrongConfig, rng: np.random.Generator) -> list[Measured]:
    """Pixels for every share: the same noise, and what is wrong at one share is wrong at a larger one."""
    n = len(bundle.uv)
    noise = config.sigma * rng.standard_normal((n, 2))
    size = config.sigma * rng.uniform(config.wrong_least, config.wrong_most, n)
    angle = rng.uniform(-np.pi, np.pi, n)
    push = size[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rank = rng.permutation(n)
    measured = []
    for share in config.shares:
        honest = rank >= round(share * n)
        measured.append(Measured(bundle.uv + noise + np.where(honest[:, None], 0.0, push), honest))
    return measured


def simulate(config: WrongConfig, at: None, seed: np.random.SeedSequence) -> WrongRun:
    """All methods, all shares, in one scene."""
    rng = np.random.default_rng(seed)
    bundle = make_bundle(np.linspace(-config.spread, config.spread, config.views), config.points, rng)
    near = moved_start(bundle.truth, config.near_turn, config.near_move, rng)
    far = moved_start(bundle.truth, config.far * config.near_turn, config.far * config.near_move, rng)
    measured = measure(bundle, config, rng)
    rows = [[_one(bundle, near, m, robust) for m in measured] for robust in robusts(config.sigma).values()]
    columns = [np.array([[r[k] for r in row] for row in rows]) for k in range(5)]
    judged = measured[config.shares.index(FAR_SHARE)]
    far_centre = np.array([_one(bundle, far, judged, robust)[0] for robust in robusts(config.sigma).values()])
    centre, turn, point, scale, converged = columns
    return WrongRun(centre, turn, point, scale / config.sigma, converged.astype(np.bool_), far_centre)


def _one(
    bundle: Bundle, start: Scene, measured: Measured, robust: Robust
) -> tuple[float, float, float, float, bool]:
    """Errors, scale, and whether a minimum was reached."""
    result = bundle_adjust(bundle.problem(measured.uv, start), robust, Options(max_iterations=200))
    judged = np.bincount(bundle.point[measured.honest], minlength=len(start.X_world)) >= DETERMINED
    error = scene_error(result.problem.scene, bundle.truth, judged)
    return *error, result.sigma, result.converged

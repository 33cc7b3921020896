"""What the misprints of seed B do when they are run as printed.

The world is that of figures 2-4, turned by ``turn``: on a course along the axes sin(theta) cos(theta) is
small, and with it the error of B26, 2 y_new sin(theta) cos(theta); that is shown too.  Filters:

* ``B18 as printed``: last row z_i6 u3 + z_i5 u2;
* ``B26 as printed``: row 5 with - y_new z11; ``B26, along the axes``: the same in the unturned world;
* ``both as printed``: the paper's filter to the letter;
* ``no cross noise``: only the diagonal blocks that B17 and B19 print.

The last, ``product of means``, is no misprint but the trap beside them: exact Gaussian moments of U whose
*products* are put into the quadratic rows.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Result, RunContext, verdict
from vslam_ref.experiments.iekf.study import StudyConfig, drive, run_noise, study_field
from vslam_ref.filters.carleman_ekf import LiftedCarlemanEkf, Variant
from vslam_ref.geometry import se2, so2
from vslam_ref.metrics.consistency import bootstrap_interval
from vslam_ref.worlds.vehicle_field import VehicleField

if TYPE_CHECKING:
    from matplotlib.figure import Figure


VARIANTS = {
    "corrected": Variant(),
    "B18 as printed": Variant(b18_as_printed=True),
    "B26 as printed": Variant(b26_as_printed=True),
    "B26, along the axes": Variant(b26_as_printed=True),
    "both as printed": Variant(b18_as_printed=True, b26_as_printed=True),
    "no cross noise": Variant(cross_noise=False),
    "product of means": Variant(product_of_means=True),
}
PRINTED = ("B18 as printed", "B26 as printed", "B26, along the axes", "both as printed")
BROKEN = 1000.0
"""Mean NEES, of 3 degrees of freedom, past which a filter is broken beyond argument."""


@dataclass(frozen=True)
class ErrataConfig:
    """Which runs; the world is that of figures 2-4."""

    study: StudyConfig = dataclasses.field(default_factory=StudyConfig)
    runs: int = dataclasses.field(
        default=20, metadata={"reason": "the effects are large; twenty runs show them"}
    )
    turn: float = dataclasses.field(
        default=0.6, metadata={"reason": "any that is no multiple of a right angle", "unit": "rad"}
    )
    laps: float = dataclasses.field(
        default=1.0, metadata={"reason": "the seed map says: within the first lap", "unit": "laps"}
    )

    def __post_init__(self) -> None:
        """Refuse studies that mean nothing."""
        if self.runs < 2:
            raise ValueError(f"runs={self.runs}: must be >= 2")
        if not 0 < self.laps <= self.study.field.laps:
            raise ValueError(f"laps={self.laps}: must be in (0, {self.study.field.laps}]")


class Task(NamedTuple):
    """One variant at one P0."""

    config: ErrataConfig
    variant: str
    p0: str


def simulate(task: Task) -> tuple[Array, Array]:
    """NEES (M, T + 1) and the lifted sum z5 + z6 (M,) at the end, for one variant."""
    config = task.config
    world = study_field(config.study)
    steps = round(config.laps * world.config.steps / world.config.laps)
    world = turned(world, 0.0 if task.variant.endswith("along the axes") else config.turn)
    noise = run_noise(config.study, False, 0, config.runs)
    sightings = tuple(s for s in world.sightings if s.step <= steps)
    world = world._replace(
        controls=world.controls[:steps],
        T_world_vehicle=world.T_world_vehicle[: steps + 1],
        times=world.times[: steps + 1],
        sightings=sightings,
    )
    noise = noise._replace(controls=noise.controls[:, :steps], sightings=noise.sightings[: len(sightings)])
    p0 = config.study.p0(task.p0)
    slam = LiftedCarlemanEkf(
        world.T_world_vehicle[0] + noise.start * np.sqrt(p0),
        np.diag(p0),
        len(world.landmarks),
        control="gaussian" if task.variant == "product of means" else "first_order",
        variant=VARIANTS[task.variant],
    )
    with np.errstate(all="ignore"):
        nees = drive(slam, world, noise).nees
    z = slam.state()[0]
    return nees, z[:, 4] + z[:, 5]


def turned(world: VehicleField, angle: float) -> VehicleField:
    """The same world in axes turned by ``angle`` radians: all relative places stay."""
    poses = se2.compose(np.array([0.0, 0.0, angle]), world.T_world_vehicle)
    return world._replace(T_world_vehicle=poses, landmarks=so2.rotate(angle, world.landmarks))


def run(config: ErrataConfig, context: RunContext) -> Result:
    """Run every variant at both P0."""
    tasks = [Task(config, name, p0) for name in VARIANTS for p0 in ("low", "high")]
    done = context.map(simulate, tasks, "errata")
    nees = {f"{t.variant}/{t.p0}": d[0] for t, d in zip(tasks, done, strict=True)}
    time = study_field(config.study).times[: next(iter(nees.values())).shape[1]]
    w = {f"{t.variant}/{t.p0}": d[1] for t, d in zip(tasks, done, strict=True)}
    return Result(
        series={"time": time, "nees": {key: values.mean(0) for key, values in nees.items()}},
        seed=config.study.seed,
        runs=config.runs,
        arrays={f"nees/{key}": values for key, values in nees.items()}
        | {f"z5+z6/{key}": v for key, v in w.items()},
        payload=(config, nees, w),
    )


def claims(result: Result) -> list[Claim]:
    """Judge what the errata are said to do."""
    config, nees, w = result.payload
    rng = np.random.default_rng(config.study.seed)
    judged = [_breaks(name, nees) for name in PRINTED]
    judged.append(_inconsistent("no cross noise", nees, rng))
    judged.append(_corrected(nees))
    lost = 1.0 - np.mean([v.mean() for key, v in w.items() if key.startswith("product")])
    expected = expected_loss(config)
    judged.append(
        Claim(
            "product-of-means-loses-w",
            "not in B; the moments B leaves open",
            "Products of E[u] in the quadratic rows shrink z5 + z6, which must stay 1",
            "the loss of z5 + z6 is within 10 % of 1 - prod(exp(-var dalpha))",
            {"lost": float(lost), "expected": expected},
            None,
            None,
            None,
            verdict(bool(abs(lost - expected) <= 0.1 * expected)),
        )
    )
    return judged


def expected_loss(config: ErrataConfig) -> float:
    """Predicted loss of z5 + z6: each step multiplies it by E[u2]^2 + E[u3]^2 = exp(-var(dalpha)).

    The variance is taken along the true controls, an independent path from the filter's.
    """
    field = config.study.field
    world = study_field(config.study)
    steps = round(config.laps * field.steps / field.laps)
    v, phi = world.controls[:steps].T
    slope_v = field.dt * np.tan(phi) / field.wheelbase
    slope_phi = v * field.dt / (field.wheelbase * np.cos(phi) ** 2)
    var = (slope_v * field.sigma_v) ** 2 + (slope_phi * field.sigma_phi) ** 2
    return float(-np.expm1(-var.sum()))


def _breaks(name: str, nees: dict[str, Array]) -> Claim:
    """As printed the filter is broken: the smallest over P0 of the largest mean NEES passes 1000."""
    peak = {p0: float(_worst(nees[f"{name}/{p0}"].mean(0))) for p0 in ("low", "high")}
    least = min(peak.values())
    return Claim(
        name.lower().replace(",", "").replace(" ", "-"),
        "B, eqs. 18 and 26" if name.startswith("both") else f"B, eq. {name[1:3]}",
        f"{name}: the mean NEES passes {BROKEN:g} within the first lap, at low and at high P0",
        f"largest mean NEES over the lap, smaller of the two P0, > {BROKEN:g} (or no longer finite)",
        {"peak": peak},
        None,
        None,
        None,
        verdict(least > BROKEN),
    )


def _worst(curve: Array) -> float:
    """Largest value of a mean NEES curve; a value that is no longer finite counts as infinite."""
    return float(np.max(np.where(np.isfinite(curve), curve, np.inf)))


def _inconsistent(name: str, nees: dict[str, Array], rng: np.random.Generator) -> Claim:
    """Another wrong filter: its NEES at the end of the lap is above the corrected one's, in the same runs."""
    ratio, intervals = {}, {}
    for p0 in ("low", "high"):
        wrong, right = nees[f"{name}/{p0}"][:, -100:].mean(1), nees[f"corrected/{p0}"][:, -100:].mean(1)
        ratio[p0] = float(wrong.mean() / right.mean())
        intervals[p0] = bootstrap_interval(np.stack([wrong, right], 1), lambda c: c[:, 0] / c[:, 1], rng)
    low = min(intervals.values())
    return Claim(
        "no-cross-noise",
        "B, eqs. 17 and 19",
        "B17 and B19 to the letter, without cross covariances of the common noise, are another wrong filter",
        "NEES of the last 100 steps over the corrected filter's, 95 % whole-run interval > 1 at both P0",
        {"ratio": ratio},
        [float(x) for x in low],
        None,
        None,
        verdict(all(i[0] > 1.0 for i in intervals.values())),
    )


def _corrected(nees: dict[str, Array]) -> Claim:
    """The corrected filter does none of this."""
    peak = {p0: float(_worst(nees[f"corrected/{p0}"].mean(0))) for p0 in ("low", "high")}
    return Claim(
        "corrected-stays",
        "not in B",
        "With both rows corrected the filter stays on scale in the same runs",
        "largest mean NEES over the lap < 10 at both P0",
        {"peak": peak},
        None,
        None,
        None,
        verdict(max(peak.values()) < 10.0),
    )


def figure(result: Result) -> Figure:
    """Mean NEES of all variants on a logarithmic axis."""
    from vslam_ref.plot.variants import variants_figure

    config, nees, _ = result.payload
    return variants_figure(
        np.asarray(result.series["time"]),
        {key: values.mean(0) for key, values in nees.items()},
        list(VARIANTS),
        runs=config.runs,
        broken=BROKEN,
    )


def quick(config: ErrataConfig) -> ErrataConfig:
    """Fewer runs; the effect is so large that the verdicts stay the same."""
    return dataclasses.replace(config, runs=3)


EXPERIMENT = Experiment(
    id="iekf-errata",
    title="B's printed formulas, run as printed",
    source="B, equations 17-19 and 26",
    config_type=ErrataConfig,
    run=run,
    claims=claims,
    figure=figure,
    quick=quick,
    defaults={"study.seed": 2017},
)

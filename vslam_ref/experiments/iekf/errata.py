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
from vslam_ref.experiments.framework import Claim, Experiment, Study, between, judged
from vslam_ref.experiments.iekf.study import StudyConfig, errors_of, noises, run_seeds, study_field
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


class ErrataRun(NamedTuple):
    """NEES (M, T + 1), and the lifted sum z5 + z6 (M,) at the end."""

    nees: Array
    w: Array


def simulate(
    config: ErrataConfig, point: tuple[str, str], seeds: tuple[np.random.SeedSequence, ...]
) -> ErrataRun:
    """Run one variant from one P0 over all runs."""
    variant, start = point
    world = part_of(config, 0.0 if variant.endswith("along the axes") else config.turn)
    noise = noises(study_field(config.study), seeds)
    noise = noise._replace(
        controls=noise.controls[:, : len(world.controls)], sightings=noise.sightings[: len(world.sightings)]
    )
    p0 = config.study.p0(start)
    slam = LiftedCarlemanEkf(
        world.T_world_vehicle[0] + noise.start * np.sqrt(p0),
        np.diag(p0),
        len(world.landmarks),
        control="gaussian" if variant == "product of means" else "first_order",
        variant=VARIANTS[variant],
    )
    with np.errstate(all="ignore"):
        nees = errors_of(slam, world, noise).nees
    z = slam.state()[0]
    return ErrataRun(nees, z[:, 4] + z[:, 5])


def part_of(config: ErrataConfig, angle: float) -> VehicleField:
    """The first laps of the world, in axes turned by ``angle`` radians: all relative places stay."""
    world = study_field(config.study)
    steps = round(config.laps * world.config.steps / world.config.laps)
    return world._replace(
        controls=world.controls[:steps],
        T_world_vehicle=se2.compose(np.array([0.0, 0.0, angle]), world.T_world_vehicle)[: steps + 1],
        landmarks=so2.rotate(angle, world.landmarks),
        times=world.times[: steps + 1],
        sightings=tuple(s for s in world.sightings if s.step <= steps),
    )


Runs = Study[dict[str, ErrataRun]]


def series(study: Runs) -> dict[str, object]:
    """Mean NEES of every variant."""
    nees = {key: part.nees.mean(0) for key, part in study.data.items()}
    return {"time": part_of(study.config, 0.0).times, "nees": nees}


def claims(study: Runs) -> list[Claim]:
    """Judge what the errata are said to do."""
    nees = {key: part.nees for key, part in study.data.items()}
    return [
        *(_breaks(name, nees) for name in PRINTED),
        _inconsistent("no cross noise", nees, np.random.default_rng(study.seed)),
        _corrected(nees),
        _loses(study),
    ]


def _loses(study: Runs) -> Claim:
    """Products of means shrink what must stay 1."""
    lost = float(1.0 - np.mean([p.w.mean() for key, p in study.data.items() if key.startswith("product")]))
    expected = expected_loss(study.config)
    return judged(
        "product-of-means-loses-w",
        "not in B; the moments B leaves open",
        "Products of E[u] in the quadratic rows shrink z5 + z6, which must stay 1",
        "the loss of z5 + z6 is within 10 % of 1 - prod(exp(-var dalpha))",
        abs(lost - expected) <= 0.1 * expected,
        f"z5 + z6 loses {lost:.3g} of 1 over the course; {expected:.3g} is predicted from the steering noise",
        {"lost": lost, "expected": expected},
        least_runs=2,
    )


def expected_loss(config: ErrataConfig) -> float:
    """Predicted loss of z5 + z6: each step multiplies it by E[u2]^2 + E[u3]^2 = exp(-var(dalpha)).

    The variance is taken along the true controls, an independent path from the filter's.
    """
    field = config.study.field
    v, phi = part_of(config, 0.0).controls.T
    slope_v = field.dt * np.tan(phi) / field.wheelbase
    slope_phi = v * field.dt / (field.wheelbase * np.cos(phi) ** 2)
    var = (slope_v * field.sigma_v) ** 2 + (slope_phi * field.sigma_phi) ** 2
    return float(-np.expm1(-var.sum()))


def _peaks(name: str, nees: dict[str, Array]) -> dict[str, float]:
    """Largest mean NEES over the course, by P0."""
    return {p0: worst(nees[f"{name}/{p0}"].mean(0)) for p0 in ("low", "high")}


def _breaks(name: str, nees: dict[str, Array]) -> Claim:
    """As printed the filter is broken: the smallest over P0 of the largest mean NEES passes 1000."""
    peak = _peaks(name, nees)
    return judged(
        name.lower().replace(",", "").replace(" ", "-"),
        "B, eqs. 18 and 26" if name.startswith("both") else f"B, eq. {name[1:3]}",
        f"{name}: the mean NEES passes {BROKEN:g} within the first lap, at low and at high P0",
        f"largest mean NEES over the lap, smaller of the two P0, > {BROKEN:g} (or no longer finite)",
        min(peak.values()) > BROKEN,
        f"The mean NEES, 3 for a consistent filter, reaches {peak['low']:.3g} from the low and "
        f"{peak['high']:.3g} "
        "from the high P0",
        {"peak": peak},
        least_runs=2,
    )


def worst(curve: Array) -> float:
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
    return judged(
        "no-cross-noise",
        "B, eqs. 17 and 19",
        "B17 and B19 to the letter, without cross covariances of the common noise, are another wrong filter",
        "NEES of the last 100 steps over the corrected filter's, 95 % whole-run interval > 1 at both P0",
        all(i[0] > 1.0 for i in intervals.values()),
        f"Without cross covariances the NEES at the end is {ratio['low']:.3g} times (low P0) and "
        f"{ratio['high']:.3g} "
        f"times (high P0) the corrected filter's; the lower 95 % interval lies {between(low)}",
        {"ratio": ratio},
        ci=low,
    )


def _corrected(nees: dict[str, Array]) -> Claim:
    """The corrected filter does none of this."""
    peak = _peaks("corrected", nees)
    return judged(
        "corrected-stays",
        "not in B",
        "With both rows corrected the filter stays on scale in the same runs",
        "largest mean NEES over the lap < 10 at both P0",
        max(peak.values()) < 10.0,
        f"The corrected filter's mean NEES reaches {peak['low']:.3g} from the low and {peak['high']:.3g} "
        "from the "
        "high P0; 10 is allowed",
        {"peak": peak},
        least_runs=2,
    )


def figure(study: Runs) -> Figure:
    """Mean NEES of all variants on a logarithmic axis."""
    from vslam_ref.plot.variants import variants_figure

    nees = {key: part.nees.mean(0) for key, part in study.data.items()}
    times = part_of(study.config, 0.0).times
    return variants_figure(times, nees, list(VARIANTS), runs=study.config.runs, broken=BROKEN)


EXPERIMENT = Experiment(
    id="iekf-errata",
    title="B's printed formulas, run as printed",
    source="B, equations 17-19 and 26",
    config_type=ErrataConfig,
    simulate=simulate,
    points=lambda config: [(name, p0) for name in VARIANTS for p0 in ("low", "high")],
    name="/".join,
    seeds=lambda config, point: [tuple(run_seeds(config.study, False, config.runs))],
    series=series,
    arrays=lambda study: (
        {f"nees/{k}": p.nees for k, p in study.data.items()}
        | {f"z5+z6/{k}": p.w for k, p in study.data.items()}
    ),
    claims=claims,
    figure=figure,
    about={
        "nees": "NEES of the pose, by variant and initial uncertainty; (runs, times)",
        "z5+z6": "sum of the lifted heading's squares at the end, which should be 1; (runs,)",
    },
    quick={"runs": 3},  # the effect is so large that the verdicts stay the same
    defaults={"study.seed": 2017},
)

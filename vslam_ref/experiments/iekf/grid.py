"""The grid of the sensitivity study: one setting changed at a time, everything else as in figures 2-4."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from vslam_ref.experiments.iekf.study import QUICK as STUDY_QUICK
from vslam_ref.experiments.iekf.study import StudyConfig
from vslam_ref.experiments.iekf.verdicts import CONTROL_STUDIES, POPULATION_STUDIES

BASELINE = "baseline"

AXES: dict[str, str] = {
    BASELINE: "baseline",
    "sigma_v": "speed noise [m/s]",
    "sigma_phi": "steering noise [deg]",
    "sigma_z": "sensor noise [m]",
    "small_noises": "all noises",
    "max_range": "range [m]",
    "landmarks": "landmarks",
    "heading_variance": "high P0, heading [rad2]",
    "layout": "landmark layout",
    "draw": "noise draw",
}
"""The axes in the order of the map's columns, and what they are called."""

NUMERIC = ("sigma_v", "sigma_phi", "sigma_z", "max_range", "landmarks", "heading_variance")
"""Axes on which the baseline has a place among the values."""


def _values(values: tuple[float, ...], unit: str, reason: str) -> Any:
    return dataclasses.field(default=values, metadata={"unit": unit, "reason": reason})


def _study() -> StudyConfig:
    """Return the study of figures 2-4 with half its population: a setting takes seconds, not minutes."""
    return StudyConfig(population=200, control_runs=400, filters=("ekf", "iekf", "ekf-anchored"))


@dataclass(frozen=True)
class SensitivityConfig:
    """Which settings; ``study`` is the baseline."""

    study: StudyConfig = dataclasses.field(default_factory=_study)
    sigma_v: tuple[float, ...] = _values(
        (0.05, 0.1, 0.4), "m/s", "a quarter, half and twice the baseline; 5 % to 40 % of the speed"
    )
    sigma_phi: tuple[float, ...] = _values(
        tuple(np.deg2rad([1.0, 2.0, 6.0]).tolist()), "rad", "1, 2 and 6 degrees; 3 is the baseline"
    )
    sigma_z: tuple[float, ...] = _values(
        (0.03, 0.2, 0.5), "m", "a laser, a poor camera, and worse than the path's own error"
    )
    small_noises: tuple[float, ...] = _values(
        (0.05, float(np.deg2rad(1.0)), 0.1),
        "m/s, rad, m",
        "one setting off the axes, all noises small together: does the gap need large ones?",
    )
    max_range: tuple[float, ...] = _values(
        (4.0, 9.0, 15.0), "m", "from hardly a landmark in view to landmarks seen on two sides of the square"
    )
    landmarks: tuple[int, ...] = dataclasses.field(
        default=(15, 60), metadata={"unit": "", "reason": "half and twice the baseline"}
    )
    heading_variance: tuple[float, ...] = _values(
        (0.003, 0.01, 0.1), "rad2", "sigma of 3, 6 and 18 degrees; B's low is 1.8, its high 10"
    )
    layouts: tuple[int, ...] = dataclasses.field(
        default=(1, 2, 3, 4),
        metadata={"reason": "seeds of other landmarks, the noises of the runs unchanged; any four"},
    )
    draws: tuple[int, ...] = dataclasses.field(
        default=(1, 2),
        metadata={
            "reason": "seeds of other noises, the landmarks unchanged: what chance alone does to a verdict"
        },
    )

    def __post_init__(self) -> None:
        """Refuse grids that mean nothing."""
        if len(self.small_noises) not in (0, 3):
            raise ValueError(
                f"small_noises={self.small_noises}: need sigma_v, sigma_phi, sigma_z, or nothing"
            )
        needed = {"ekf", "iekf", "ekf-anchored"}
        if not needed <= set(self.study.filters):
            raise ValueError(f"study.filters={self.study.filters}: need {', '.join(sorted(needed))}")


class StudySetting(NamedTuple):
    """One column of the map: its axis, its value in words, its place on a numeric axis, its study."""

    axis: str
    label: str
    value: float
    study: StudyConfig

    @property
    def name(self) -> str:
        """Axis and value in words."""
        return self.axis if self.axis == BASELINE else f"{self.axis} {self.label}"


def settings_of(config: SensitivityConfig) -> list[StudySetting]:
    """All settings of a grid, the baseline first, in the order of :data:`AXES`."""
    base = config.study
    field = base.field

    def world(axis: str, label: str, value: float, **changes: Any) -> StudySetting:
        return StudySetting(axis, label, value, replace(base, field=replace(field, **changes)))

    found = [StudySetting(BASELINE, "-", 0.0, base)]
    found += [world("sigma_v", f"{v:g}", v, sigma_v=v) for v in config.sigma_v]
    found += [world("sigma_phi", f"{np.rad2deg(v):.3g}", v, sigma_phi=v) for v in config.sigma_phi]
    found += [world("sigma_z", f"{v:g}", v, sigma_z=v) for v in config.sigma_z]
    if config.small_noises:
        names = ("sigma_v", "sigma_phi", "sigma_z")
        found.append(
            world("small_noises", "small", 0.0, **dict(zip(names, config.small_noises, strict=True)))
        )
    found += [world("max_range", f"{v:g}", v, max_range=v) for v in config.max_range]
    found += [world("landmarks", f"{v}", v, landmarks=v) for v in config.landmarks]
    found += [
        StudySetting("heading_variance", f"{v:g}", v, replace(base, p0_high=(*base.p0_high[:2], v)))
        for v in config.heading_variance
    ]
    found += [StudySetting("layout", f"#{s}", s, replace(base, layout=s)) for s in config.layouts]
    same_map = base.seed if base.layout is None else base.layout
    found += [StudySetting("draw", f"#{s}", s, replace(base, seed=s, layout=same_map)) for s in config.draws]
    return found


def baseline_value(config: SensitivityConfig, axis: str) -> float:
    """Place of the baseline on a numeric axis."""
    if axis == "heading_variance":
        return config.study.p0_high[2]
    return float(getattr(config.study.field, axis))


QUICK: dict[str, Any] = {f"study.{key}": value for key, value in STUDY_QUICK.items()} | {
    "study.population": 20, "study.control_runs": 40, "sigma_v": (), "sigma_phi": (float(np.deg2rad(1.0)),),
    "sigma_z": (), "small_noises": (), "max_range": (), "landmarks": (), "heading_variance": (0.1,),
    "layouts": (1,), "draws": (1,),
}  # fmt: skip
"""Five settings of a few runs each, too few for any verdict: the statements become "not testable"."""


def grid_with_runs(config: SensitivityConfig, runs: int) -> SensitivityConfig:
    """Set the size of a study, and the least population and control that the verdicts need."""
    study = replace(
        config.study,
        runs=runs,
        population=POPULATION_STUDIES * runs,
        control_runs=CONTROL_STUDIES * runs,
    )
    return replace(config, study=study)

"""Made-up studies in which it is known what is true.

A run's NEES is the square of three Gaussians that keep, as in real runs, most of their value from the start:
NEES at 0 s and at 160 s correlate 0.75, the rest fades within 10 s.  All series of a run share nine tenths
of their noise, since the filters see the same measurements.  A profile multiplies the NEES over time; profile
1 is a consistent filter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pytest

from vslam_ref.experiments.iekf import SENTENCES, StudyArrays, judge

TIME = np.arange(161.0)
KEYS = ("ekf/low", "ekf/high", "iekf/low", "iekf/high")
Profile = Sequence[tuple[float, float]]

PAPER_NEES: dict[str, Profile] = {
    "ekf/low": [(0, 1), (79, 1), (80, 1.5), (160, 1.75)],
    "ekf/high": [(0, 1), (20, 1.6), (78, 3.5), (82, 6), (160, 9)],
    "iekf/low": [(0, 0.97), (160, 0.97)],
    "iekf/high": [(0, 0.95), (31, 0.95), (38, 1.7), (45, 0.95), (80, 0.97), (160, 1.9)],
}
"""All that B says but for "little influence", which a consistent low and an inconsistent high contradict."""

PAPER_EXTRA: dict[str, Profile] = {
    "ekf/low": [(0, 0.1), (75, 0.1), (85, 0.9), (160, 0.9)],
    "ekf/high": [(0, 1.1), (160, 1.3)],
}
"""Additional position error, in the size of the error both filters share."""


def gaussians(rng: np.random.Generator, runs: int, dims: int = 3) -> np.ndarray:
    """Unit normals (runs, dims, T), each constant by sqrt(0.75) of its variance, else fading in 10 s."""
    keep = np.sqrt(0.75)
    fade = np.exp(-(TIME[1] - TIME[0]) / 10.0)
    noise = rng.standard_normal((runs, dims, TIME.size))
    x = noise.copy()
    for k in range(1, TIME.size):
        x[..., k] = fade * x[..., k - 1] + np.sqrt(1 - fade**2) * noise[..., k]
    return np.sqrt(keep) * rng.standard_normal((runs, dims, 1)) + np.sqrt(1 - keep) * x


def control(rng: np.random.Generator, runs: int) -> np.ndarray:
    """NEES of a consistent filter, (runs, T), exactly chi-squared with 3 freedoms at every time."""
    return (gaussians(rng, runs) ** 2).sum(axis=1)


def study(
    seed: int,
    nees: Mapping[str, Profile],
    extra: Mapping[str, Profile],
    population: int = 400,
    control_runs: int = 1000,
) -> StudyArrays:
    """A study in which the mean NEES follows the profiles, and so does the extra error."""
    rng = np.random.default_rng(seed)
    base, place = gaussians(rng, population), gaussians(rng, population, 2)
    arrays, errors = {}, {}
    for key in KEYS:
        own = np.sqrt(0.9) * base + np.sqrt(0.1) * gaussians(rng, population)
        arrays[key] = (own**2).sum(axis=1) * np.interp(TIME, *np.transpose(nees[key]))
        size = np.interp(TIME, *np.transpose(extra.get(key, [(0, 0.1), (160, 0.1)])))
        errors[key] = np.linalg.norm(place + size * gaussians(rng, population, 2), axis=1)
    arrays |= {f"control/{p0}": control(rng, control_runs) for p0 in ("low", "high")}
    return {
        "time": TIME, "lap_seconds": 80.0, "runs": 50, "nees": arrays, "position_error": errors,
    }  # fmt: skip


def renamed(source: StudyArrays, change: Mapping[str, str]) -> StudyArrays:
    """The same study with parts of its labels exchanged, such as ekf for iekf."""

    def label(key: str) -> str:
        return (
            key if key.startswith("control") else "/".join(change.get(part, part) for part in key.split("/"))
        )

    nees = {label(k): v for k, v in source["nees"].items()}
    error = {label(k): v for k, v in source["position_error"].items()}
    return {**source, "nees": nees, "position_error": error}


@pytest.fixture(scope="session")
def studies() -> dict[str, StudyArrays]:
    """The worlds by name."""
    paper = study(1, PAPER_NEES, PAPER_EXTRA)
    return {
        "paper": paper,
        "calm": study(2, {key: [(0, 1), (160, 1)] for key in KEYS}, {}),
        "filters swapped": renamed(paper, {"ekf": "iekf", "iekf": "ekf"}),
        "P0 swapped": renamed(paper, {"low": "high", "high": "low"}),
    }


@pytest.fixture(scope="session")
def judged(studies):
    """World -> claim id -> Claim."""
    return {
        world: {c.id: c for c in judge(arrays, list(SENTENCES), np.random.default_rng(5))}
        for world, arrays in studies.items()
    }


@pytest.fixture(scope="session")
def fresh_control():
    """A function that makes independent control runs."""
    return control

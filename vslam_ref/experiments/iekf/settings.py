"""One setting of the grid, run and judged; and all of them together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Study, Verdict
from vslam_ref.experiments.iekf.figures import study_arrays
from vslam_ref.experiments.iekf.grid import BASELINE, SensitivityConfig, StudySetting, settings_of
from vslam_ref.experiments.iekf.measures import StudyClock
from vslam_ref.experiments.iekf.sentences import SENTENCES, claim_ids
from vslam_ref.experiments.iekf.study import StudyConfig, run_study
from vslam_ref.experiments.iekf.verdicts import judge


class Judged(NamedTuple):
    """A setting with its verdicts: claims by id; NEES of each run, averaged over 150-160 s, by filter/p0."""

    setting: StudySetting
    claims: dict[str, Claim]
    end: dict[str, Array]


class Grid(NamedTuple):
    """All settings, the baseline first."""

    judged: tuple[Judged, ...]

    @property
    def baseline(self) -> Judged:
        """The setting of figures 2-4."""
        return self.judged[0]

    def axis(self, name: str) -> list[Judged]:
        """Settings of an axis, by value, without the baseline."""
        return sorted((j for j in self.judged if j.setting.axis == name), key=lambda j: j.setting.value)

    def axes(self) -> list[str]:
        """Axes that have settings, in order, without the baseline."""
        return [a for a in dict.fromkeys(j.setting.axis for j in self.judged) if a != BASELINE]

    def verdicts(self, claim: str) -> Iterator[tuple[Judged, Verdict]]:
        """Verdict on one claim at every setting."""
        return ((j, j.claims[claim].verdict) for j in self.judged)


class Verdicts(NamedTuple):
    """What is kept of a setting: by statement, verdict, share and null rate (NaN: none), each (claims,).

    ``end`` (keys, runs) is the NEES of each run, averaged over 150-160 s, by :func:`keys`.
    """

    verdict: NDArray[np.str_]
    share: Array
    null_rate: Array
    end: Array


def keys(study: StudyConfig) -> list[str]:
    """Rows of ``end``."""
    return [f"{name}/{p0}" for name in study.filters for p0 in ("low", "high")]


def simulate(config: SensitivityConfig, setting: StudySetting, unit: None) -> Verdicts:
    """Run a setting's study and its own consistent control, and judge all statements of B 4.1.

    The per-run curves of a setting, some 80 MB, stay in the process that made them.  Each figure draws
    from the generator that ``iekf-fig2`` to ``iekf-fig4`` use.
    """
    study = run_study(setting.study)
    arrays = study_arrays(study)
    claims: dict[str, Claim] = {}
    for figure in (2, 3, 4):
        rng = np.random.default_rng([setting.study.seed, figure])
        claims |= {c.id: c for c in judge(arrays, claim_ids(figure), rng)}
    clock = StudyClock(study.time, setting.study.field.lap_seconds, setting.study.runs)
    rows = [claims[i] for i in SENTENCES]
    return Verdicts(
        np.array([c.verdict for c in rows]),
        np.array([np.nan if c.share is None else c.share for c in rows]),
        np.array([np.nan if c.null_rate is None else c.null_rate for c in rows]),
        np.array([clock.average(study.nees[key], "end") for key in keys(setting.study)]),
    )


def grid_of(study: Study[dict[str, Verdicts]]) -> Grid:
    """Put the verdicts of all settings on the grid."""
    return Grid(tuple(_judged(s, study.data[s.name]) for s in settings_of(study.config)))


def _judged(setting: StudySetting, found: Verdicts) -> Judged:
    claims = {}
    for s, v, share, null in zip(SENTENCES.values(), *(c[0].tolist() for c in found[:3]), strict=True):
        null, share = (None if np.isnan(x) else float(x) for x in (null, share))
        outcome: Verdict = v
        claims[s.id] = Claim(s.id, s.source, s.text, s.rule.text(), {}, None, null, share, outcome)
    return Judged(setting, claims, dict(zip(keys(setting.study), found.end[0], strict=True)))


def map_series(grid: Sequence[Judged]) -> dict[str, object]:
    """Collect what is drawn: per setting (columns) and claim, share and verdict; mean NEES at the end."""
    first = grid[0]
    return {
        "axis": [j.setting.axis for j in grid],
        "value": [j.setting.label for j in grid],
        "verdict": {i: [j.claims[i].verdict for j in grid] for i in first.claims},
        "share": {i: [j.claims[i].share for j in grid] for i in first.claims},
        "nees_end": {key: [float(j.end[key].mean()) for j in grid] for key in first.end},
    }

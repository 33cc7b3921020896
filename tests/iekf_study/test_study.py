"""The Monte Carlo study: same bytes however it is run, paired noises, and the shape of B's picture."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.experiments.framework import RunContext, load, summaries
from vslam_ref.experiments.iekf import study
from vslam_ref.experiments.iekf.study import StudyConfig, StudyResult, run_study
from vslam_ref.metrics.consistency import mean_band
from vslam_ref.support.config import without_reason
from vslam_ref.support.json_text import to_json
from vslam_ref.worlds.vehicle_field import VehicleFieldConfig

SHORT = VehicleFieldConfig(laps=1, lap_seconds=20.0, landmarks=10)
SMALL = StudyConfig(runs=4, population=8, control_runs=8, batch=2, field=SHORT)


def bytes_of(config: StudyConfig, context: RunContext) -> str:
    experiment = load("iekf-fig2")
    return to_json(experiment.series(experiment.run(config, context)))


def test_series_are_the_same_bytes_for_one_and_two_workers() -> None:
    alone = bytes_of(SMALL, RunContext(jobs=1))
    assert bytes_of(SMALL, RunContext(jobs=1)) == alone
    assert bytes_of(SMALL, RunContext(jobs=2)) == alone
    assert bytes_of(dataclasses.replace(SMALL, seed=SMALL.seed + 1), RunContext(jobs=1)) != alone


def test_series_are_the_same_bytes_on_a_dask_cluster() -> None:
    distributed = pytest.importorskip("distributed", reason="needs the extra 'cluster'")
    alone = bytes_of(SMALL, RunContext(jobs=1))
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        context = RunContext(jobs=2, scheduler="dask", dask_address=cluster.scheduler_address)
        assert bytes_of(SMALL, context) == alone


def test_a_run_draws_the_same_noise_in_any_population() -> None:
    few, many = study.run_noise(SMALL, False, 0, 2), study.run_noise(SMALL, False, 0, 6)
    assert np.array_equal(few.start, many.start[:2])
    assert np.array_equal(few.controls, many.controls[:2])
    later = study.run_noise(SMALL, False, 4, 2)
    assert np.array_equal(later.controls, many.controls[4:6])
    assert not np.array_equal(study.run_noise(SMALL, True, 0, 2).start, few.start)


@pytest.fixture(scope="module")
def standard() -> StudyResult:
    """B's study itself, 50 runs, without a population behind it."""
    return run_study(StudyConfig(population=50, control_runs=50))


def test_all_filters_start_from_the_same_errors(standard: StudyResult) -> None:
    for p0 in ("low", "high"):
        starts = [standard.nees[f"{name}/{p0}"][:, 0] for name in ("ekf", "iekf", "ekf-anchored")]
        # same error, same P0; the lifted heading and its Jacobian only round differently
        assert np.allclose(starts[0], starts[1], rtol=1e-9)
        assert np.allclose(starts[0], starts[2], rtol=1e-9)


def test_the_control_is_exactly_chi_squared(standard: StudyResult) -> None:
    """Two-sided band of the mean of 50 runs; four times far apart, false-alarm rate 4 x 0.1 % in all."""
    band = mean_band(50, 3, 0.999)
    for p0 in ("low", "high"):
        curve = standard.nees[f"control/{p0}"].mean(0)[[0, 500, 1000, 1600]]
        assert np.all((band.lower < curve) & (curve < band.upper))


def test_the_gap_of_b_is_there_and_the_anchored_ekf_closes_it(standard: StudyResult) -> None:
    """High P0, lap 2: far outside what chance does to 50 runs; the anchored EKF inside it."""
    lap2 = standard.time >= 80.0
    line = mean_band(50, 3, 0.99999).upper
    assert standard.nees["ekf/high"][:, lap2].mean() > 2 * line
    assert standard.nees["iekf/high"][:, lap2].mean() < line
    assert standard.nees["ekf-anchored/high"][:, lap2].mean() < line


def test_innovations_are_no_worse_for_the_inconsistent_filter(standard: StudyResult) -> None:
    """NIS stays near 1 while the pose NEES runs to tens: innovations do not see what P0 hides."""
    runs = len(standard.nis["ekf/high"])
    total = standard.nis["ekf/high"].mean()
    assert standard.nees["ekf/high"][:, -1].mean() > 10.0
    # mean over 50 runs x some 160 updates of about 8 numbers: standard deviation below 0.01; the bound is 0.1
    assert runs == 50
    assert abs(total - 1.0) < 0.1


@pytest.mark.parametrize(
    "change",
    [
        {"runs": 1},
        {"runs": 9, "population": 8},
        {"batch": 0},
        {"control_scale": 0.0},
        {"filters": ("ekf", "ukf")},
        {"p0_low": (1.0, -1.0, 0.1)},
    ],
)
def test_meaningless_studies_are_refused(change: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"must|unknown"):
        dataclasses.replace(SMALL, **change)  # type: ignore[arg-type]


@pytest.mark.parametrize("id", [s.id for s in summaries()])
def test_every_setting_of_every_experiment_gives_its_reason(id: str) -> None:
    experiment = load(id)
    assert without_reason(experiment.default()) == []
    assert experiment.configure(quick=True) != experiment.default()

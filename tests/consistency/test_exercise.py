"""Exercise 17.1: a judge that turns honest filters down as rarely as it says, and finds the others.

Honest studies are made up exactly: d standard Gaussian errors per run, correlated in time (an
autoregression with unit variance), so that the NEES is chi-squared at every time.  The bounds on counts
are binomial quantiles: a judge that is as good as demanded fails a test here with probability 1e-4 or less.
"""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
from scipy.stats import binom

EXERCISE = "17_judge"

STUDIES = 400
UNLUCKY = 1e-4


def studies(runs: int, times: int, dof: int, memory: float, seed: int, count: int = STUDIES) -> np.ndarray:
    """NEES (count, runs, times) of honest filters; ``memory`` is the correlation from time to time."""
    rng = np.random.default_rng(seed)
    e = np.empty((count, runs, times, dof))
    e[:, :, 0] = rng.standard_normal((count, runs, dof))
    for k in range(1, times):
        e[:, :, k] = memory * e[:, :, k - 1]
        e[:, :, k] += np.sqrt(1 - memory**2) * rng.standard_normal((count, runs, dof))
    return np.sum(e**2, axis=-1)


def alarms(answer: ModuleType, data: np.ndarray, dof: int, false_alarm: float = 0.05) -> int:
    verdicts = [answer.consistent(one.copy(), dof, false_alarm) for one in data]
    wrong = next((v for v in verdicts if not isinstance(v, bool | np.bool_)), None)
    assert wrong is None, f"the judge must say True or False, not {wrong!r}"
    return sum(not v for v in verdicts)


@pytest.mark.parametrize(
    ("memory", "kind"), [(0.0, "white"), (0.9, "fast"), (0.995, "slow"), (1.0, "frozen: all times the same")]
)
@pytest.mark.parametrize(("runs", "dof"), [(50, 3), (10, 2)])
def test_honest_filters_are_turned_down_as_rarely_as_promised(
    answer: ModuleType, runs: int, dof: int, memory: float, kind: str
) -> None:
    found = alarms(answer, studies(runs, 60, dof, memory, seed=1), dof)
    allowed = int(binom.ppf(1 - UNLUCKY, STUDIES, 0.05))
    assert found <= allowed, (
        f"{found} of {STUDIES} honest filters were turned down ({runs} runs, {dof} dof, errors {kind}); "
        f"5 % is promised, {allowed} is bad luck. Did you look at every time, or count times as samples?"
    )


def test_the_false_alarm_rate_is_an_argument(answer: ModuleType) -> None:
    data = studies(30, 40, 3, 0.9, seed=2)
    found = alarms(answer, data, 3, false_alarm=0.001)
    told = f"{found} of {STUDIES} honest filters turned down with false_alarm=0.001: is the argument used?"
    assert found <= int(binom.ppf(1 - UNLUCKY, STUDIES, 0.001)), told


def assert_found(answer: ModuleType, data: np.ndarray, dof: int, what: str) -> None:
    found, needed = alarms(answer, data, dof), int(binom.ppf(UNLUCKY, STUDIES, 0.8))
    assert found >= needed, f"only {found} of {STUDIES} {what} were found; a good judge finds at least 80 %"


@pytest.mark.parametrize("memory", [0.9, 0.995])
def test_filters_that_are_too_sure_are_found(answer: ModuleType, memory: float) -> None:
    """50 runs at one time find a factor of 1.7 in 97 % of studies with the two-sided band."""
    assert_found(
        answer, 1.7 * studies(50, 60, 3, memory, seed=3), 3, "filters whose NEES is 1.7 times too large"
    )


def test_filters_that_are_too_careful_are_found(answer: ModuleType) -> None:
    data = 0.55 * studies(50, 60, 3, 0.95, seed=4)
    assert_found(answer, data, 3, "filters whose covariance is too large (is your band two-sided?)")


def test_filters_that_go_wrong_late_are_found(answer: ModuleType) -> None:
    """Honest in the first half; then NEES grows to three times what it should be, as after a loop closure."""
    data = studies(50, 60, 3, 0.95, seed=5) * np.concatenate([np.ones(30), np.linspace(1.0, 3.0, 30)])
    assert_found(answer, data, 3, "filters that begin well and go wrong in the second half")


def test_the_number_of_runs_and_the_dimension_count(answer: ModuleType) -> None:
    data = studies(400, 20, 2, 0.9, seed=6)
    told = "400 honest runs in 2 dimensions were turned down: the line 3.592 is for 50 runs of 3 dimensions"
    assert alarms(answer, data[:40], 2) <= int(binom.ppf(1 - UNLUCKY, 40, 0.05)), told
    assert alarms(answer, 1.4 * data[:40], 2) >= 36, "with 400 runs a factor of 1.4 must be found"


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_run_without_a_value_is_no_honest_run(answer: ModuleType, value: float) -> None:
    data = studies(50, 20, 3, 0.9, seed=7, count=1)[0]
    data[3, 12] = value
    assert not answer.consistent(data, 3), f"a run has the NEES {value}: the filter lost its covariance there"


def test_it_judges_real_filters(answer: ModuleType) -> None:
    """One lap at high initial uncertainty: EKF-SLAM is inconsistent, its linear control is not."""
    from vslam_ref.experiments.iekf import study
    from vslam_ref.worlds.vehicle_field import VehicleFieldConfig

    config = study.StudyConfig(
        field=VehicleFieldConfig(laps=1), runs=30, population=30, control_runs=300, filters=("ekf",)
    )
    result = study.run_study(config)
    assert not answer.consistent(result.nees["ekf/high"], 3), "EKF-SLAM at high P0 has a mean NEES above 10"
    control = result.nees["control/low"].reshape(10, 30, -1)
    found, allowed = alarms(answer, control, 3), int(binom.ppf(1 - UNLUCKY, 10, 0.05))
    assert found <= allowed, f"{found} of 10 studies of an exactly consistent filter were turned down"

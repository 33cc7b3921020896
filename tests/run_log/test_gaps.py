"""Gaps of a log: told, and the doubt that a gap of the odometry adds is neither too small nor too large."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from vslam_ref.datasets import mrclam
from vslam_ref.systems.slam_log import LoggedSighting, RobotCalibration, SlamLog, gap_notes, run_log
from vslam_ref.systems.slam_log.gaps import ODOMETRY_GAP, gap_variances
from vslam_ref.systems.slam_log.timeline import build_timeline, control_increments

STEP = 0.1
QUIET = RobotCalibration(sigma_distance=1e-3, sigma_turn=1e-3, sigma_drift=1e-3)


def wandering(seconds: float, rng: np.random.Generator, settle: float = 3.0) -> np.ndarray:
    """Speed and turn rate (T, 2) every STEP: stationary, Gaussian, forgotten after some settling time."""
    keep = np.exp(-STEP / settle)
    new = np.sqrt(1 - keep**2) * rng.normal(size=(round(seconds / STEP), 2))
    new[0] /= np.sqrt(1 - keep**2)
    return np.asarray(lfilter([1.0], [1.0, -keep], new, axis=0) * [0.15, 0.3] + [0.2, 0.0])


def log_of(
    controls: np.ndarray, gaps: Sequence[tuple[int, int]] = (), sightings: tuple[LoggedSighting, ...] = ()
) -> SlamLog:
    """A log of a differential drive without the stamps (first, last) exclusive of each gap."""
    keep = np.ones(len(controls), dtype=bool)
    for first, last in gaps:
        keep[first + 1 : last] = False
    times = STEP * np.arange(len(controls))
    return SlamLog("made", "differential", np.nan, 0.0, times[keep], controls[keep], sightings, {})


@pytest.mark.parametrize("seconds", [4.0, 12.0, 30.0])
def test_the_normalised_error_of_a_gap_has_the_mean_one(seconds: float) -> None:
    """Over 400 logs of 600 s: (true - held)^2 / variance, chi-square with one degree for Gaussian speeds.

    Its mean has the deviation sqrt(2 / 400) = 0.071.  The variance is itself measured on 600 s, which are
    some 25 independent windows of 12 s and as much to forget: 1 / estimate is 2 / 25 too large in the mean.
    """
    rng = np.random.default_rng(int(seconds))
    length, errors = round(seconds / STEP), []
    for _ in range(400):
        controls = wandering(600.0, rng)
        first = int(rng.integers(50, len(controls) - length - 50))
        log = log_of(controls, [(first, first + length)])
        inc = control_increments(log, QUIET)
        k = int(np.argmax(np.diff(log.times)))
        true = STEP * controls[first : first + length].sum(axis=0)
        added = gap_variances(log.times, inc)
        assert np.count_nonzero(added) == 2
        errors.append((true - inc[k]) ** 2 / added[k])
    mean = np.mean(errors, axis=0)
    windows = 600 / max(2 * seconds, 6)
    assert (np.abs(mean - 1) < 5 * 0.071 + 3 / windows).all(), mean


def test_without_the_doubt_the_normalised_error_is_far_off() -> None:
    """A world where the claim is false: rolling noise alone says a thousand times too little of a gap."""
    rng = np.random.default_rng(0)
    errors = []
    for _ in range(50):
        controls = wandering(300.0, rng)
        log = log_of(controls, [(1000, 1120)])
        line = build_timeline(log, QUIET, np.zeros(0))
        k = int(np.searchsorted(line.times, 100.05)) - 1
        true = STEP * controls[1000:1120].sum(axis=0)
        alone = QUIET.sigma_distance**2 * abs(line.increments[k, 0])
        errors.append([(true[0] - line.increments[k, 0]) ** 2 / v for v in (line.cov[k, 0, 0], alone)])
    with_doubt, without = np.mean(errors, axis=0)
    assert with_doubt < 2
    assert without > 1000


def test_a_log_without_gaps_is_as_it_was() -> None:
    rng = np.random.default_rng(1)
    log = log_of(wandering(60.0, rng), [(100, 119)])  # 1.9 s
    assert np.diff(log.times).max() < ODOMETRY_GAP
    assert not gap_variances(log.times, control_increments(log, QUIET)).any()
    assert gap_notes(log) == ()


def test_a_steady_vehicle_is_not_doubted_and_one_at_rest_neither() -> None:
    for control in ([0.3, 0.1], [0.0, 0.0]):
        log = log_of(np.tile(control, (600, 1)), [(200, 320)])
        assert gap_variances(log.times, control_increments(log, QUIET)).max() < 1e-24


def test_the_doubt_is_measured_with_known_numbers() -> None:
    """Speed 1 for 10 s and 0 for 10 s, in turns: holding it for 10 s is off by up to 10 m.

    From a stamp s seconds into a phase, the way of the next 10 s is 10 - s at 1 m/s and s at rest; held, it
    is 10 and 0.  The difference is s both times, so the mean square is that of s, 100 / 3.
    """
    speed = np.tile(np.repeat([1.0, 0.0], 100), 20)
    controls = np.column_stack([speed, -2.0 * speed])
    log = log_of(controls, [(2050, 2150)])
    added = gap_variances(log.times, control_increments(log, QUIET))
    k = int(np.argmax(np.diff(log.times)))
    np.testing.assert_allclose(
        added[k], [100 / 3, 4 * 100 / 3], rtol=0.03
    )  # sums for integrals, 1 / 100 a step


def test_gaps_longer_than_the_log_knows_grow_with_the_time() -> None:
    rng = np.random.default_rng(2)
    controls = wandering(130.0, rng)
    found = []
    for seconds in (60, 100):
        log = log_of(controls, [(150, 150 + 10 * seconds)])
        k = int(np.argmax(np.diff(log.times)))
        found.append(np.sqrt(gap_variances(log.times, control_increments(log, QUIET))[k, 0]))
    assert found[0] > 0
    assert found[1] > found[0]
    everywhere = np.arange(0, 90, 3.0)  # a log of nothing but gaps doubts its whole way
    assert (gap_variances(everywhere, np.full((29, 2), 3.0)) == 9.0).all()


def test_stamps_that_stand_twice_do_no_harm() -> None:
    rng = np.random.default_rng(3)
    log = log_of(wandering(200.0, rng), [(700, 800)])
    twice = np.sort(np.concatenate([log.times, log.times[::7]]))
    controls = log.controls[np.searchsorted(log.times, twice)]
    double = log._replace(times=twice, controls=controls)
    one, two = (gap_variances(x.times, control_increments(x, QUIET)).max(axis=0) for x in (log, double))
    np.testing.assert_allclose(two, one, rtol=1e-9)


def test_the_filter_comes_back_from_a_gap(make_world, calibration) -> None:  # type: ignore[no-untyped-def]
    """The pose's standard deviation grows through a gap, and sightings after it are let in by the gate.

    Six seconds: beyond ten, with turns to either side, the heading is in doubt by too much to linearise.
    """
    again = 46.0
    world = make_world("gap", calibration, seconds=120.0)
    whole = mrclam.read_log(world.folder, 1)
    keep = (whole.times < 40) | (whole.times > again)
    seen = tuple(s for s in whole.sightings if not 40 <= s.time <= again)
    log = whole._replace(times=whole.times[keep], controls=whole.controls[keep], sightings=seen)
    run = run_log(log, calibration, "ekf")
    sd = np.sqrt(run.covs[:, 0, 0] + run.covs[:, 1, 1])
    at = [int(np.searchsorted(run.times, t)) for t in (39.9, again - 0.1, 119.0)]
    assert sd[at[1]] > 5 * sd[at[0]]
    assert sd[at[2]] < sd[at[1]] / 3
    assert np.mean(run.seen.accepted[run.seen.times > again]) > 0.9


def sighting(time: float) -> LoggedSighting:
    return LoggedSighting(time, np.array([6]), np.array([[2.0, 0.1]]))


def test_gaps_are_counted_and_the_longest_is_told() -> None:
    controls = np.tile([0.1, 0.0], (1500, 1))
    seen = tuple(sighting(t) for t in (1.0, 20.0, 49.0, 80.0, 120.5, 140.0))
    notes = gap_notes(log_of(controls, [(100, 130), (700, 821)], seen))
    assert len(notes) == 2
    assert notes[0].startswith("odometry: 2 gap(s) of more than 2 s, the longest 12.1 s, from 70.0 s on")
    assert notes[1].startswith(
        "sightings of landmarks: 2 gap(s) of more than 30 s, the longest 40.5 s, from 80.0 s on"
    )
    assert gap_notes(log_of(controls, (), seen[:3])) == ()
    assert gap_notes(log_of(controls)) == ()


def test_the_command_tells_what_is_odd(
    make_world,
    calibration,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],  # type: ignore[no-untyped-def]
) -> None:
    from vslam_ref.cli import main

    folder = make_world("odd", calibration).folder
    command = ["run", "ekf-slam", str(folder), "--no-batch", "--json", str(tmp_path / "a.json")]
    assert main(command) == 0
    assert "note:" not in capsys.readouterr().out
    assert json.loads((tmp_path / "a.json").read_text())["notes"] == []
    path = folder / "Robot1_Odometry.dat"
    lines = path.read_text().splitlines()
    del lines[300:360]  # 3 s
    lines[100], lines[101] = lines[101], lines[100]
    path.write_text("\n".join(lines) + "\n")
    assert main(command) == 0
    said = [line for line in capsys.readouterr().out.splitlines() if line.startswith("note: ")]
    assert [line.removeprefix("note: ") for line in said] == json.loads((tmp_path / "a.json").read_text())[
        "notes"
    ]
    assert "Robot1_Odometry.dat: 1 line(s) with an earlier time than a line before; put in order" in said[0]
    assert "odometry: 1 gap(s) of more than 2 s, the longest 3.1 s" in said[1]

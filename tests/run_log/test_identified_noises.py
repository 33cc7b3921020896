"""The committed gains and noises: whole, made without truth, and the likeliest of their neighbours."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy.sparse", reason="identification")

from vslam_ref.commands.identify import read_logs
from vslam_ref.datasets import catalogue, mrclam, noise
from vslam_ref.systems.slam_log import RobotCalibration, identify, run_log

NAMES = ("mrclam", "victoria_park")


@pytest.mark.parametrize("name", NAMES)
def test_a_document_says_what_why_and_how(name: str) -> None:
    document = noise.document(name)
    assert noise.calibration(name) == RobotCalibration.from_mapping(document["values"])
    assert document["command"] == f"vslam-ref identify {name}"
    assert document["evidence"]["truth_used"] is False
    assert len(document["method"]) > 200
    assert set(document["evidence"]["standard_errors"]) == set(identify.FREE[name])


def test_an_unknown_set_is_told_with_the_known_ones() -> None:
    with pytest.raises(
        ValueError, match=r"no identified noises of 'x'; there are some of mrclam, victoria_park"
    ):
        noise.document("x")


def test_identification_opens_no_truth(
    make_world: Callable[..., object], calibration: RobotCalibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The truth files are gone, and opening them would be told by the reader's own function too."""
    folder: Path = make_world("w", calibration, 2, seconds=30.0).folder  # type: ignore[attr-defined]
    for name in ("Robot1_Groundtruth.dat", "Landmark_Groundtruth.dat"):
        (folder / name).unlink()
    monkeypatch.setattr(mrclam, "read_truth", lambda *_: pytest.fail("the truth was opened"))
    monkeypatch.setattr(identify, "STRIDES", (1.0,))
    found = identify.identify([mrclam.read_log(folder, 1)], calibration, ("turn_gain", "bearing_offset"))
    values = RobotCalibration.from_mapping(found["values"])
    assert values.sigma_range == pytest.approx(0.05, rel=0.3)
    assert values.turn_gain == pytest.approx(1.0, abs=0.05)


def test_sightings_repeated_at_rest_show_the_sensor_noise(
    make_world: Callable[..., object], calibration: RobotCalibration
) -> None:
    """Differences at rest over sqrt(2) spread like the noise; within 4 standard errors of about 5 %."""
    log = mrclam.read_log(make_world("w", calibration, 5).folder, 1)  # type: ignore[attr-defined]
    rng = np.random.default_rng(0)
    still = tuple(
        s._replace(polar=np.array([3.0, 0.2]) + rng.normal(size=(len(s.ids), 2)) * [0.05, 0.02])
        for s in log.sightings
    )
    spread = identify.repeated_sightings(log._replace(sightings=still), within=0.6)
    assert spread["range_m"] == pytest.approx(0.05, rel=0.2)
    assert spread["bearing_rad"] == pytest.approx(0.02, rel=0.2)


@pytest.mark.slow
@pytest.mark.skipif(catalogue.find("utias_mrclam") is None, reason="utias_mrclam is not in VSLAM_REF_DATA")
def test_the_committed_noises_are_likelier_than_their_neighbours() -> None:
    logs = read_logs("mrclam", catalogue.require("utias_mrclam"))
    values = noise.calibration("mrclam")

    def likelihood(calibration: RobotCalibration) -> float:
        runs = [
            (run_log(log, calibration, name, identify.SETTINGS), log)
            for name in identify.JUDGES
            for log in logs
        ]
        return sum(identify.log_likelihood(run, identify.field_area(log)) for run, log in runs)

    best = likelihood(values)
    assert best == pytest.approx(noise.document("mrclam")["evidence"]["log_likelihood"], rel=1e-3)
    for name in identify.NOISES:
        for step in (-1.5, 1.5):  # a factor of 1.65
            assert likelihood(identify.moved(values, name, step, {})) < best, (name, step)

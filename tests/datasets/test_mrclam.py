"""MRCLAM sets: one convention inside, and a line for every damaged file."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from vslam_ref.datasets import catalogue, mrclam
from vslam_ref.datasets.text import FormatError


def test_barcodes_become_subjects_and_robots_are_dropped_and_counted(mrclam_folder: Path) -> None:
    log = mrclam.read_log(mrclam_folder, 1)
    assert (log.drive, log.clock_start) == ("differential", 100.0)
    np.testing.assert_allclose(log.times, [0, 0.5, 1.0, 1.5])
    assert [(round(s.time, 6), s.ids.tolist()) for s in log.sightings] == [(0.2, [6]), (0.9, [6, 7])]
    assert log.sightings[1].polar.tolist() == [[1.9, 0.1], [3.0, -0.2]]
    assert log.dropped == {"other robots": 1, "misread barcodes": 0, "impossible sightings": 0}
    assert log.notes == ()


def test_the_truth_is_read_apart_on_the_time_of_the_log(mrclam_folder: Path) -> None:
    log = mrclam.read_log(mrclam_folder, 1)
    truth = mrclam.read_truth(mrclam_folder, 1, log)
    np.testing.assert_allclose(truth.times, [-1.0, -0.9, 1.6])
    np.testing.assert_allclose(truth.T_world_vehicle[:, 2], [3.1, 3.2 - 2 * np.pi, 3.3 - 2 * np.pi])
    assert truth.ids.tolist() == [6, 7, 8]
    assert truth.exact


def test_a_log_needs_no_truth_files(mrclam_folder: Path) -> None:
    (mrclam_folder / "Robot1_Groundtruth.dat").unlink()
    (mrclam_folder / "Landmark_Groundtruth.dat").unlink()
    assert len(mrclam.read_log(mrclam_folder, 1).sightings) == 2


def test_gzipped_files_read_the_same(mrclam_folder: Path) -> None:
    plain = mrclam.read_log(mrclam_folder, 1)
    path = mrclam_folder / "Robot1_Odometry.dat"
    (mrclam_folder / "Robot1_Odometry.dat.gz").write_bytes(gzip.compress(path.read_bytes()))
    path.unlink()
    np.testing.assert_array_equal(mrclam.read_log(mrclam_folder, 1).controls, plain.controls)


@pytest.mark.parametrize(
    ("name", "old", "new", "where", "words"),
    [
        (
            "Robot1_Odometry.dat",
            "0.1 0.2\n101.0",
            "0.1\n101.0",
            ":3",
            "2 columns; expected 3: time, v, omega",
        ),
        ("Robot1_Odometry.dat", "101.0 0.1", "101.0 nan", ":4", "v is 'nan'; expected a finite number"),
        (
            "Robot1_Measurement.dat",
            "100.9 81",
            "100.9 99",
            ":5",
            "unknown landmark: barcode 99 is in no line",
        ),
        ("Robot1_Measurement.dat", "63 2.0", "63 -2.0", ":2", "range is -2; expected more than 0 m"),
        ("Robot1_Measurement.dat", "3.0 -0.2", "3.0 -20", ":5", "bearing is -20; expected radians"),
        ("Robot1_Measurement.dat", "100.2 5", "100.2 5.5", ":3", "barcode is 5.5; expected an integer"),
        (
            "Robot1_Odometry.dat",
            "101.0 0.1",
            "1.0 0.1",
            ":4",
            "time 1.000 s, out of order and more than 60 s",
        ),
        ("Barcodes.dat", "7 81", "7 63", ":5", "barcode 63 again; line 4 has it already"),
    ],
)
def test_a_damaged_log_is_refused_with_file_and_line(
    mrclam_folder: Path, name: str, old: str, new: str, where: str, words: str
) -> None:
    path = mrclam_folder / name
    content = path.read_text()
    assert content.count(old) == 1
    path.write_text(content.replace(old, new))
    with pytest.raises(FormatError) as caught:
        mrclam.read_log(mrclam_folder, 1)
    assert str(caught.value).startswith(f"{path}{where}: ")
    assert words in str(caught.value)


@pytest.mark.parametrize("name", ["Robot1_Odometry.dat", "Robot1_Measurement.dat", "Barcodes.dat"])
def test_an_empty_file_is_refused(mrclam_folder: Path, name: str) -> None:
    (mrclam_folder / name).write_text("# nothing\n")
    with pytest.raises(FormatError, match=f"{name}: no data"):
        mrclam.read_log(mrclam_folder, 1)


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("Landmark_Groundtruth.dat", "8 0 0", "9 0 0", r":4: landmark 9 has no barcode"),
        ("Landmark_Groundtruth.dat", "8 0 0", "7 0 0", r":4: subject 7 again; line 3 has it"),
    ],
)
def test_damaged_truth_is_refused(mrclam_folder: Path, name: str, old: str, new: str, words: str) -> None:
    log = mrclam.read_log(mrclam_folder, 1)
    path = mrclam_folder / name
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(FormatError, match=words):
        mrclam.read_truth(mrclam_folder, 1, log)


def test_a_robot_that_is_not_there_is_named_with_those_that_are(mrclam_folder: Path) -> None:
    with pytest.raises(FormatError, match="no odometry of robot 2; robots here: 1"):
        mrclam.read_log(mrclam_folder, 2)


@pytest.mark.parametrize(
    ("kind", "bad", "words"),
    [
        ("misread barcodes", "43 2.0 0.1", r"unknown landmark: barcode 43 is in no line of Barcodes.dat"),
        ("impossible sightings", "63 0 0.1", "range is 0; expected more than 0 m"),
        ("impossible sightings", "63 2.0 -1.6", "bearing is -1.6; expected radians"),
    ],
)
def test_misreadings_up_to_one_in_twenty_are_dropped_counted_and_told(
    mrclam_folder: Path, kind: str, bad: str, words: str
) -> None:
    path = mrclam_folder / "Robot1_Measurement.dat"
    rows = [f"{100 + k / 1000:.3f} 63 2.0 0.1" for k in range(200)]
    for k in range(10):
        rows[17 * k + 3] = rows[17 * k + 3].replace("63 2.0 0.1", bad)
    path.write_text("\n".join(rows))
    log = mrclam.read_log(mrclam_folder, 1)
    assert log.dropped == {"other robots": 0, "misread barcodes": 0, "impossible sightings": 0} | {kind: 10}
    assert sum(len(s.ids) for s in log.sightings) == 190
    assert len(log.notes) == 1
    assert log.notes[0].startswith("Robot1_Measurement.dat: 10 of 200 sightings dropped")
    rows[199] = rows[199].replace("63 2.0 0.1", bad)
    path.write_text("\n".join(rows))
    with pytest.raises(FormatError, match=rf":4: {words}.*; 11 of 200 lines are so, expected at most 5%$"):
        mrclam.read_log(mrclam_folder, 1)


def test_lines_out_of_order_are_put_in_order_and_told(mrclam_folder: Path) -> None:
    plain = mrclam.read_log(mrclam_folder, 1)
    truth = mrclam.read_truth(mrclam_folder, 1, plain)
    for name in ("Odometry", "Measurement", "Groundtruth"):
        path = mrclam_folder / f"Robot1_{name}.dat"
        head, *rows = path.read_text().splitlines()
        rows = rows[:1] + rows[2:3] + rows[1:2] + rows[3:]
        path.write_text("\n".join([head, *rows]))
    log = mrclam.read_log(mrclam_folder, 1)
    assert log.notes == tuple(
        f"Robot1_{name}.dat: 1 line(s) with an earlier time than a line before; put in order"
        for name in ("Odometry", "Measurement")
    )
    np.testing.assert_array_equal(log.times, plain.times)
    np.testing.assert_array_equal(log.controls, plain.controls)
    assert [s.time for s in log.sightings] == [s.time for s in plain.sightings]
    path = mrclam_folder / "Robot1_Measurement.dat"  # the line that is named is the file's
    path.write_text(path.read_text().replace("100.9 63", "100.9 63.5"))
    with pytest.raises(FormatError, match=r"Measurement.dat:3: barcode is 63.5"):
        mrclam.read_log(mrclam_folder, 1)
    again = mrclam.read_truth(mrclam_folder, 1, log)
    np.testing.assert_array_equal(again.T_world_vehicle, truth.T_world_vehicle)
    assert len(again.notes) == 1


def test_lines_that_stand_there_twice_are_used_once_and_told(mrclam_folder: Path) -> None:
    plain = mrclam.read_log(mrclam_folder, 1)
    for name in ("Measurement", "Groundtruth"):
        path = mrclam_folder / f"Robot1_{name}.dat"
        lines = path.read_text().splitlines()
        path.write_text("\n".join([*lines, lines[-1]]))
    log = mrclam.read_log(mrclam_folder, 1)
    assert [s.ids.tolist() for s in log.sightings] == [s.ids.tolist() for s in plain.sightings]
    assert log.notes == ("Robot1_Measurement.dat: 1 line(s) that stand there twice; used once",)
    truth = mrclam.read_truth(mrclam_folder, 1, log)
    assert len(truth.times) == 3
    assert truth.notes == ("Robot1_Groundtruth.dat: 1 line(s) of a time again; the first counts",)


def test_a_landmark_twice_at_one_time_makes_two_sightings() -> None:
    got = mrclam.group_sightings(np.array([1.0, 1.0, 1.0]), np.array([6, 7, 6]), np.ones((3, 2)))
    assert [s.ids.tolist() for s in got] == [[6, 7], [6]]


@pytest.mark.skipif(catalogue.find("utias_mrclam") is None, reason="utias_mrclam is not in VSLAM_REF_DATA")
@pytest.mark.parametrize(
    ("robot", "controls", "landmark_sightings", "other", "misread"),
    [(1, 61785, 1534, 407, 1), (3, 61158, 4348, 1277, 2)],
)
def test_the_real_set_has_the_counts_its_description_states(
    robot: int, controls: int, landmark_sightings: int, other: int, misread: int
) -> None:
    folder = mrclam.set_folder(catalogue.require("utias_mrclam"))
    assert mrclam.robots(folder) == [1, 3]
    log = mrclam.read_log(folder, robot)
    assert len(log.times) == controls
    assert sum(len(s.ids) for s in log.sightings) == landmark_sightings
    assert log.dropped == {"other robots": other, "misread barcodes": misread, "impossible sightings": 0}
    assert sorted({int(i) for s in log.sightings for i in s.ids}) == list(range(6, 21))
    truth = mrclam.read_truth(folder, robot, log)
    assert len(truth.times) == {1: 49241, 3: 56977}[robot]

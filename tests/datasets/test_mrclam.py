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
    assert log.dropped == {"other robots": 1, "misread barcodes": 0}


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
        ("Robot1_Odometry.dat", "101.0", "100.4", ":4", "times must not go back"),
        ("Robot1_Measurement.dat", "100.9 63", "100.1 63", ":4", "times must not go back"),
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
        ("Robot1_Groundtruth.dat", "99.1 1 2", "99.0 1 2", r":3: time 99.000 s after 99.000 s"),
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


def test_one_misread_barcode_in_many_lines_is_dropped_and_counted(mrclam_folder: Path) -> None:
    path = mrclam_folder / "Robot1_Measurement.dat"
    rows = [f"{100 + k / 1000:.3f} 63 2.0 0.1" for k in range(2000)]
    rows[700] = rows[700].replace(" 63 ", " 43 ")
    path.write_text("\n".join(rows))
    assert mrclam.read_log(mrclam_folder, 1).dropped["misread barcodes"] == 1
    rows[701:704] = [row.replace(" 63 ", " 43 ") for row in rows[701:704]]
    path.write_text("\n".join(rows))
    with pytest.raises(FormatError, match=r":701: unknown landmark: barcode 43 .*\(4 such lines\)"):
        mrclam.read_log(mrclam_folder, 1)


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
    assert log.dropped == {"other robots": other, "misread barcodes": misread}
    assert sorted({int(i) for s in log.sightings for i in s.ids}) == list(range(6, 21))
    truth = mrclam.read_truth(folder, robot, log)
    assert len(truth.times) == {1: 49241, 3: 56977}[robot]

"""CARMEN logs: the messages of a laser, where its beams look, and readings that are no metres."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from vslam_ref.datasets import carmen
from vslam_ref.datasets.carmen.units import unit_note
from vslam_ref.datasets.carmen.view import LaserView, by_count, chosen, from_parameters
from vslam_ref.datasets.text import FormatError

STAMP = "10.5 host 0.5"
POSES = "1 2 0.25 1.1 2.1 0.2 0.3 0.05 0.5 0.4 1e6"


def head(start: object, field: object, step: object, beams: int, limit: object = 30.0) -> str:
    return f"0 {start} {field} {step} {limit} 0.01 0 {beams}"


def readings(beams: int) -> str:
    return " ".join(f"{1 + k / 100:.2f}" for k in range(beams))


def robot(beams: int, start: object, field: object, step: object, remissions: str = "0") -> str:
    return f"ROBOTLASER1 {head(start, field, step, beams)} {readings(beams)} {remissions} {POSES} {STAMP}"


def front(beams: int, time: float = 10.5) -> str:
    return f"FLASER {beams} {readings(beams)} 1.5 -2 0.25 1.4 -2.1 0.2 {time} host 0.5"


def read(tmp_path: Path, *lines: str, fov: float | None = None) -> carmen.CarmenLog:
    path = tmp_path / "a.log"
    path.write_text("\n".join(lines) + "\n")
    return carmen.read(path, field_of_view=fov)


def ends(log: carmen.CarmenLog) -> list[float]:
    return [float(x) for x in np.degrees(log.scanner.angles[[0, -1]])]


@pytest.mark.parametrize(
    ("beams", "start", "field", "step", "first", "last"),
    [
        (181, -1.570796, 3.141593, 0.017453, -90, 90),
        (180, -1.570796, 3.141593, 0.017453, -90, 89),
        (361, -1.570796, 3.141593, 0.008727, -90, 90),
        (271, -2.356194, 4.712389, 0.017453, -135, 135),
        (1081, -2.356194, 4.712389, 0.004363, -135, 135),
        (
            682,
            -2.094395,
            4.18879,
            0.006142,
            -120,
            119.97,
        ),  # what the message says: 682 steps of 0.352 degrees
        (360, -3.141593, 6.283185, 0.017453, -180, 179),
        (181, -90, 180, 1, -90, 90),  # in degrees, as some loggers write it
        (181, -1.570796, 3.141593, 0.0, -90, 90),
        (101, -0.872665, 1.745329, 0.017453, -50, 50),
    ],
)
def test_the_message_says_where_the_beams_look(
    tmp_path: Path, beams: int, start: float, field: float, step: float, first: float, last: float
) -> None:
    log = read(tmp_path, robot(beams, start, field, step, "3 11 12 13"))
    np.testing.assert_allclose(ends(log), [first, last], atol=0.4 if beams == 682 else 1e-9)
    assert log.notes == ()
    np.testing.assert_array_equal(log.poses, [[1, 2, 0.25]])  # the laser's, not the robot's
    assert (log.scanner.max_range, log.times.tolist()) == (30.0, [10.5])
    np.testing.assert_allclose(log.ranges[0, [0, -1]], [1.0, 1 + (beams - 1) / 100])
    # the same geometry counts for FLASER lines of as many beams in the same file, and these are then read
    log = read(tmp_path, robot(beams, start, field, step), front(beams))
    np.testing.assert_allclose(ends(log), [first, last], atol=0.4 if beams == 682 else 1e-9)
    np.testing.assert_array_equal(log.poses, [[1.5, -2, 0.25]])
    assert log.others == {"ROBOTLASER1": 1}


def test_a_message_without_poses_has_those_of_the_odometry(tmp_path: Path) -> None:
    raw = f"RAWLASER1 {head(-1.570796, 3.141593, 0.017453, 181)} {readings(181)} 0 {STAMP}"
    odometry = [f"ODOM {x} 0 {a} 0 0 0 {t} host 0" for x, a, t in ((1, 3.0, 10), (3, -3.2831853, 12))]
    log = read(tmp_path, odometry[1], raw, odometry[0])
    np.testing.assert_allclose(log.poses, [[1.5, 0, 3.0]], atol=1e-6)  # the short way round, a quarter of it
    assert len(log.notes) == 1
    assert log.notes[0].startswith("RAWLASER1 tells no pose: ODOM's is taken")
    with pytest.raises(FormatError, match="RAWLASER1 tells no pose, and there is no ODOM line"):
        read(tmp_path, raw)
    assert "1 scan(s) before its first" in read(tmp_path, odometry[1], raw).notes[0]


@pytest.mark.parametrize(
    ("parameters", "beams", "first", "last"),
    [
        (["laser_front_laser_fov 270", "laser_front_laser_resolution 1.0"], 271, -135, 135),
        (["laser_front_laser_fov 4.712389"], 541, -135, 135),
        (["robot_frontlaser_fov 180"], 721, -90, 90),
        (["laser_frontlaser_fov 240"], 682, -120, 120),
        (["laser_laser1_fov 180", "laser_laser1_resolution 0.5"], 360, -90, 89.5),
        (["laser_front_laser_fov 360"], 360, -180, 179),
        (["laser_front_laser_fov 3.14159", "laser_front_laser_resolution 0.5"], 361, -90, 90),
        (["laser_front_laser_fov 100", "laser_front_laser_start_angle -40"], 101, -40, 60),
    ],
)
def test_parameters_say_it(
    tmp_path: Path, parameters: list[str], beams: int, first: float, last: float
) -> None:
    log = read(tmp_path, *(f"PARAM {p} nohost 0" for p in parameters), front(beams))
    np.testing.assert_allclose(ends(log), [first, last], atol=1e-9)
    assert log.notes == ()


def test_parameters_of_others_say_nothing() -> None:
    for name, value in (
        ("laser_rear_laser_fov", "270"),
        ("simulator_front_laser_fov", "270"),
        ("laser_front_laser_fov", "x"),
        ("laser_front_laser_fov", "0"),
        ("laser_front_laser_fov", "720"),
        ("laser_front_laser_resolution", "1"),
    ):
        assert from_parameters({name: value}) is None, name


def test_a_view_that_does_not_fit_its_beams_is_told() -> None:
    found = chosen(541, LaserView(None, 180.0, 0.5), 50.0, "the file's PARAM lines")
    assert found.notes == (
        "the file's PARAM lines: 180 degrees in steps of 0.5 are not 541 beams; the field of view is used "
        "(--fov tells another)",
    )
    np.testing.assert_allclose(np.degrees(found.scanner.angles[[0, -1]]), [-90, 90])


@pytest.mark.parametrize("beams", [180, 181, 360, 361])
def test_known_numbers_of_beams_raise_no_note(tmp_path: Path, beams: int) -> None:
    assert read(tmp_path, front(beams)).notes == ()


@pytest.mark.parametrize(
    ("beams", "field", "may"),
    [(541, 270, "180"), (1081, 270, "180"), (682, 240, ""), (721, 180, "360"), (99, 180, "")],
)
def test_other_numbers_are_noted_with_the_option(tmp_path: Path, beams: int, field: int, may: str) -> None:
    (note,) = read(tmp_path, front(beams)).notes
    assert f"field of view of its {beams} beams: {field} degrees are taken" in note
    assert note.endswith("--fov DEGREES tells it")
    assert may in note
    np.testing.assert_allclose(np.degrees(by_count(beams, 50.0).scanner.first_angle), -field / 2)


def test_the_user_decides(tmp_path: Path) -> None:
    log = read(tmp_path, front(682), fov=np.radians(240))
    np.testing.assert_allclose(ends(log), [-120, 120], atol=1e-9)
    assert log.notes == ()
    log = read(tmp_path, robot(181, -1.570796, 3.141593, 0.017453), fov=np.radians(90))
    np.testing.assert_allclose(ends(log), [-45, 45], atol=1e-9)
    assert log.notes == ("a field of view of 90 degrees is taken as told; the messages of the laser say 180",)
    for bad in (0.0, -1.0, 7.0, np.nan):
        with pytest.raises(ValueError, match="field_of_view"):
            read(tmp_path, front(181), fov=bad)


GOOD = robot(3, -1.570796, 3.141593, 1.570796, "2 5 6")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (GOOD.replace(" 3 1.00", " 4 1.00"), "number of remissions is '5'|words; expected"),
        (GOOD.replace("2 5 6", "x 5 6"), "number of remissions is 'x'"),
        (GOOD.replace("2 5 6", "-1 5 6"), "words; expected"),
        (GOOD.replace("2 5 6", "7 5 6"), "words; expected 34: ROBOTLASER1, type, start angle"),
        (GOOD.replace(" host 0.5", ""), "words; expected"),
        (GOOD.replace("1.01", "wall"), "reading 2 is 'wall'; expected a number"),
        (GOOD.replace("3.141593", "-1"), "field of view is '-1'; expected radians"),
        (GOOD.replace("3.141593", "nan"), "field of view is 'nan'"),
        (GOOD.replace("1 2 0.25", "1 inf 0.25"), "laser_y is 'inf'"),
        ("ROBOTLASER1 0 1", "number of beams is ''"),
        (GOOD.replace(" 3 1.00", " 99999 1.00"), "99999 beams; expected between"),
    ],
)
def test_a_damaged_message_is_answered_with_its_line(tmp_path: Path, line: str, words: str) -> None:
    with pytest.raises(FormatError, match=rf"a\.log:2: .*({words})") as error:
        read(tmp_path, GOOD, line)
    assert "\n" not in str(error.value)


def test_another_view_in_one_log_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"a\.log:2: ROBOTLASER1 with another start angle, field of view"):
        read(tmp_path, GOOD, GOOD.replace("-1.570796", "-1.0"))


@pytest.mark.parametrize("beams", [180, 541, 720, 40])
def test_what_is_written_is_read(tmp_path: Path, beams: int) -> None:
    path = tmp_path / "b.log"
    carmen.write(path, np.zeros((1, 3)), np.zeros((1, 3)), np.full((1, beams), 2.0), np.zeros(1))
    log = carmen.read(path)
    np.testing.assert_allclose(log.scanner.angles, carmen.scanner(beams).angles, atol=1e-12)
    assert log.notes == ()


def room(size: float, rng: np.random.Generator) -> np.ndarray:
    """Scans (20, 181) in a square room, metres, a few beams through a door."""
    at = rng.uniform(-0.3, 0.3, (20, 1, 2)) * size
    angle = np.linspace(-np.pi / 2, np.pi / 2, 181)
    u = np.stack([np.cos(angle), np.sin(angle)], -1)
    with np.errstate(divide="ignore"):
        ranges = np.min(np.where(u > 0, (size / 2 - at) / u, (-size / 2 - at) / u), axis=-1)
    return np.where(rng.uniform(size=ranges.shape) < 0.03, 81.91, ranges + rng.normal(0, 0.01, ranges.shape))


@pytest.mark.parametrize("size", [4.0, 8.0, 15.0])
@pytest.mark.parametrize(("factor", "unit"), [(1e3, "millimetres"), (1e2, "centimetres")])
def test_readings_that_are_no_metres_are_named(size: float, factor: float, unit: str) -> None:
    """The oracle is the room that was made; metres raise no note."""
    ranges = room(size, np.random.default_rng(int(size)))
    assert unit_note(ranges, 50.0) is None
    note = unit_note(np.round(factor * ranges), 50.0)
    assert note is not None
    assert re.search(rf"are likely {unit} \(", note), note
    assert note.startswith("nothing came back of 100% of the beams")


def test_between_the_units_both_are_named() -> None:
    ranges = np.random.default_rng(0).uniform(500, 1950, (10, 181))
    note = unit_note(ranges, 50.0)
    assert note is not None
    assert "millimetres" in note
    assert "centimetres" in note


@pytest.mark.parametrize(
    "ranges",
    [
        np.full((5, 181), 81.91),
        np.full((5, 181), np.inf),
        np.where(np.arange(905).reshape(5, 181) % 90, 81.91, 60.0),
    ],
)
def test_a_scanner_that_saw_nothing_has_no_unit(ranges: np.ndarray) -> None:
    note = unit_note(ranges, 50.0)
    assert note is not None
    assert note.endswith("the map shows no walls")


def test_logs_in_which_walls_are_seen_raise_no_note() -> None:
    ranges = np.full((5, 100), 81.91)
    ranges[:, :6] = 3.0
    assert unit_note(ranges, 50.0) is None
    assert unit_note(np.full((2, 3), np.nan), 50.0) is None
    assert unit_note(np.zeros((2, 3)), 50.0) is None

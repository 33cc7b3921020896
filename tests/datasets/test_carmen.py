"""CARMEN logs: what is read is what is written there, and every damage has a line."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import numpy as np
import pytest

from vslam_ref.datasets import carmen, catalogue
from vslam_ref.datasets.text import FormatError
from vslam_ref.grids import LaserScanner, MapConfig, PlainMap, Scan
from vslam_ref.grids.log_odds import entropy_bits

FOLDER = catalogue.find("carmen_2d")
needs_logs = pytest.mark.skipif(FOLDER is None, reason="carmen_2d is not in VSLAM_REF_DATA")
TAIL = "1.5 -2 0.25 1.4 -2.1 0.2"
GOOD = f"""# message formats defined: PARAM SYNC ODOM FLASER
PARAM robot_frontlaser_offset 0.0 nohost 0
ODOM 0 0 0 0 0 0 0.1 host 0.1
FLASER 4 1 2.5 81.91 nan {TAIL} 10.5 host 10.6
NEFF 12.5
FLASER 4 1 -2 0 inf {TAIL} 10.7 host 10.8
FLASER 4 1 2 3 4 {TAIL} 10.7 host 10.9
FLASER 4 1 2 3 4 {TAIL} 10.6 host 11.0
FLASER 4 1 2 3 4 {TAIL} 10.65 host 11.1
"""


def put(tmp_path: Path, text: str, name: str = "a.log") -> Path:
    path = tmp_path / name
    path.write_text(text)
    return path


@pytest.mark.parametrize("packed", [False, True])
def test_scans_are_read_as_they_stand_there(tmp_path: Path, packed: bool) -> None:
    path = put(tmp_path, GOOD)
    if packed:
        path = tmp_path / "a.log.gz"
        path.write_bytes(gzip.compress(GOOD.encode()))
    log = carmen.read(path)
    np.testing.assert_array_equal(log.ranges[:2], [[1, 2.5, 81.91, np.nan], [1, -2, 0, np.inf]])
    np.testing.assert_array_equal(log.poses, np.tile([1.5, -2.0, 0.25], (5, 1)))  # not the odometry's
    assert log.times.tolist() == [10.5, 10.7, 10.7, 10.6, 10.65]
    assert log.lines.tolist() == [4, 6, 7, 8, 9]
    assert log.others == {"PARAM": 1, "ODOM": 1, "NEFF": 1}
    assert log.backward_stamps == 3  # one stands still, one runs back, one is not later than the latest
    pose, scan = next(log.scans())
    assert pose.tolist() == [1.5, -2.0, 0.25]
    assert (scan.time, scan.max_range) == (10.5, 50.0)


@pytest.mark.parametrize(("beams", "last"), [(180, 89.0), (181, 90.0), (360, 89.5), (361, 90.0), (1, -90.0)])
def test_beams_look_where_a_sick_laser_looks(beams: int, last: float) -> None:
    angles = np.degrees(carmen.scanner(beams).angles)
    assert len(angles) == beams
    np.testing.assert_allclose(angles[[0, -1]], [-90.0, last], atol=1e-12)


DAMAGE = {
    "no scan": (lambda t: t.replace("FLASER", "RLASER"), None, "no FLASER line (NEFF, ODOM, PARAM, RLASER"),
    "empty": (lambda t: "", None, "no FLASER line (nothing found)"),
    "beams no number": (lambda t: t.replace("FLASER 4 1 2.5", "FLASER four 1 2.5"), 4, "'four'"),
    "no beams": (lambda t: t.replace("FLASER 4 1 2.5", "FLASER 0 1 2.5"), 4, "0 beams; expected between 1"),
    "too many beams": (lambda t: t.replace("FLASER 4 1 2.5", "FLASER 99999 1 2.5"), 4, "99999 beams"),
    "cut off": (lambda t: t.replace(f"nan {TAIL} 10.5 host 10.6", "nan 1.5"), 4, "7 words; expected 15"),
    "a beam more": (lambda t: t.replace("4 1 2.5", "4 7 1 2.5"), 4, "16 words; expected 15"),
    "nothing but the name": (lambda t: t + "FLASER\n", 10, "number of beams is ''"),
    "other beams": (
        lambda t: t + f"FLASER 3 1 2 3 {TAIL} 11 host 11\n", 10, "3 beams; the scan in line 4 has 4",
    ),
    "reading": (lambda t: t.replace("81.91", "x"), 4, "reading 3 is 'x'; expected a number"),
    "pose": (lambda t: t.replace("nan 1.5 -2 0.25", "nan 1.5 nan 0.25"), 4, "y is 'nan'; expected a finite"),
    "theta": (lambda t: t.replace("nan 1.5 -2 0.25", "nan 1.5 -2 pi"), 4, "theta is 'pi'; expected a number"),
    "time": (lambda t: t.replace("10.5 host", "inf host"), 4, "ipc_time is 'inf'; expected a finite"),
}  # fmt: skip


@pytest.mark.parametrize("name", DAMAGE)
def test_a_damaged_log_is_answered_with_its_line(tmp_path: Path, name: str) -> None:
    change, line, what = DAMAGE[name]
    path = put(tmp_path, change(GOOD))
    where = f"{path}: " if line is None else f"{path}:{line}: "
    with pytest.raises(FormatError, match=re.escape(where) + ".*" + re.escape(what)) as error:
        carmen.read(path)
    assert "\n" not in str(error.value)


def test_a_damaged_archive_and_a_bomb_are_refused(tmp_path: Path) -> None:
    data = gzip.compress(GOOD.encode())
    for content, what in ((data[:-9], "damaged gzip"), (b"no gzip at all", "damaged gzip")):
        path = tmp_path / "b.log.gz"
        path.write_bytes(content)
        with pytest.raises(FormatError, match=what):
            carmen.read(path)
    path.write_bytes(gzip.compress(b"#" * 10_000))
    with pytest.raises(FormatError, match="more than 1000 bytes"):
        carmen.read(path, max_bytes=1000)
    (tmp_path / "c.log").write_bytes(b"FLASER \xff\xfe\n")
    with pytest.raises(FormatError, match=r"c.log:1: not a text file"):
        carmen.read(tmp_path / "c.log")


PUBLISHED = {
    "intel": (910, 180, 4),
    "csail": (406, 361, 404),
    "aces": (440, 180, 0),
    "edmonton": (340, 180, 0),
    "fhw": (488, 180, 0),
}


@needs_logs
@pytest.mark.parametrize("name", PUBLISHED)
def test_real_logs_have_the_scans_that_their_list_says(name: str) -> None:
    """Scans and beams as in the set's own list; stamps counted by another program."""
    assert FOLDER is not None
    log = carmen.read(FOLDER / f"{name}-corrected.log.gz")
    assert (*log.ranges.shape, log.backward_stamps) == PUBLISHED[name]
    # path length of the set's list, to the 0.1 m printed there
    length = np.linalg.norm(np.diff(log.poses[:, :2], axis=0), axis=1).sum()
    assert length == pytest.approx({"intel": 499.5, "csail": 379.6, "aces": 323.2, "edmonton": 323.7,
                                    "fhw": 405.5}[name], abs=0.06)  # fmt: skip


@needs_logs
@pytest.mark.parametrize("name", ["intel", "aces", "fhw"])
def test_other_directions_of_the_beams_blur_real_maps(name: str) -> None:
    """Where the beams look, told by the data: the sum of entropies is least for the convention taken."""
    assert FOLDER is not None
    log = carmen.read(FOLDER / f"{name}-corrected.log.gz")
    n, blur = log.scanner.beams, {}
    ways = {
        "taken": (0.0, np.pi / n),
        "closed": (0.0, np.pi / (n - 1)),
        "centred": (np.pi / n / 2, np.pi / n),
    }
    for way, (shift, step) in ways.items():
        angles = LaserScanner(n, -np.pi / 2 + shift, step, 50.0).angles
        grid = PlainMap(MapConfig(resolution=0.05, usable_range=20.0))
        for pose, scan in log.scans():
            grid.update(pose, Scan(angles, scan.ranges, 50.0, scan.time))
        L = grid.occupied().log_odds
        blur[way] = float(entropy_bits(L[L != 0]).sum())
    assert blur["taken"] < 0.97 * min(blur["closed"], blur["centred"])


def test_what_is_written_is_read(tmp_path: Path) -> None:
    """To the last bit; nothing came back where a range is not finite."""
    rng = np.random.default_rng(0)
    poses, wheels, times = rng.normal(size=(3, 3)), rng.normal(size=(3, 3)), np.array([0.1, 0.2, 0.35])
    ranges = rng.uniform(0.1, 9.0, (3, 181))
    ranges[0, 5], ranges[2, 7] = np.inf, np.nan
    carmen.write(tmp_path / "a.log", poses, wheels, ranges, times)
    log = carmen.read(tmp_path / "a.log")
    wanted = np.where(np.isfinite(ranges), ranges, 81.91)
    np.testing.assert_array_equal(log.ranges, wanted)
    assert (log.ranges >= log.scanner.max_range).sum() == 2
    np.testing.assert_array_equal(log.poses, poses)
    np.testing.assert_array_equal(log.times, times)
    words = (tmp_path / "a.log").read_text().splitlines()[1].split()
    assert [float(word) for word in words[-6:-3]] == wheels[0].tolist()

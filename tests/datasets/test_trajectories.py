"""Trajectory files: every bit comes back, columns are in the format's order, every damage has a line."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vslam_ref.datasets import catalogue, trajectories
from vslam_ref.datasets.text import FormatError
from vslam_ref.metrics.trajectory import Trajectory

EPS = float(np.finfo(float).eps)
pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")
FOLDER = catalogue.find("trajectories")
needs_tables = pytest.mark.skipif(FOLDER is None, reason="trajectories is not in VSLAM_REF_DATA")

# a quarter turn about x: y goes to z
ROOT = "0.7071067811865476"
GOOD = {
    "tum": f"# t x y z qx qy qz qw\n0.5 1 2 3 {ROOT} 0 0 {ROOT}\n1.5 1 2 4 0 0 0 1\n2.5 1 2 5 0 0 0 -1\n",
    "kitti": "1 0 0 1 0 0 -1 2 0 1 0 3\n1 0 0 1 0 1 0 2 0 0 1 4\n1 0 0 1 0 1 0 2 0 0 1 5\n",
    "euroc": (
        "#timestamp [ns],p_x [m],p_y,p_z,q_w,q_x,q_y,q_z\n"
        f"500000000,1,2,3,{ROOT},{ROOT},0,0\n1500000000, 1,2,4, 1,0,0,0\n2500000000,1,2,5,-1,0,0,0\n"
    ),
}


def random_trajectory(seed: int, n: int = 50, start: float = 1.4e9) -> Trajectory:
    rng = np.random.default_rng(seed)
    times = start + np.cumsum(rng.uniform(0.01, 0.1, n))
    t = 10.0 ** rng.uniform(-30, 9, (n, 3)) * rng.choice([-1.0, 1.0], (n, 3))
    return Trajectory(times, t, Rotation.random(n, random_state=rng).as_matrix())


def put(tmp_path: Path, text: str, name: str = "path.txt") -> Path:
    path = tmp_path / name
    path.write_text(text)
    return path


def bits(a: np.ndarray | None) -> bytes:
    assert a is not None
    return np.ascontiguousarray(a).tobytes()


@pytest.mark.parametrize("format", trajectories.FORMATS)
def test_the_columns_are_in_the_order_of_the_format(tmp_path: Path, format: str) -> None:
    """One pose in all three, turned by a quarter about x: w last, w first, and as a matrix."""
    path = put(tmp_path, GOOD[format])
    assert trajectories.detect(path) == format
    file = trajectories.read(path)
    assert file.format == format
    R = file.trajectory.R_world_body
    np.testing.assert_allclose(R[0] @ [0, 1, 0], [0, 0, 1], atol=2 * EPS)
    np.testing.assert_allclose(R[1:], np.tile(np.eye(3), (2, 1, 1)), atol=0)
    np.testing.assert_array_equal(file.trajectory.t_world_body, [[1, 2, 3], [1, 2, 4], [1, 2, 5]])
    if format == "kitti":
        assert file.trajectory.times is None
    else:
        np.testing.assert_array_equal(file.trajectory.times, [0.5, 1.5, 2.5])


def test_quaternions_are_those_of_scipy(tmp_path: Path) -> None:
    path = random_trajectory(1)
    trajectories.write(tmp_path / "p.tum", path, "tum")
    rows = np.loadtxt(tmp_path / "p.tum")
    # matrix to quaternion to matrix: some roundings of numbers up to 1
    np.testing.assert_allclose(Rotation.from_quat(rows[:, 4:]).as_matrix(), path.R_world_body, atol=8 * EPS)
    back = trajectories.read(tmp_path / "p.tum").trajectory
    np.testing.assert_allclose(back.R_world_body, Rotation.from_quat(rows[:, 4:]).as_matrix(), atol=8 * EPS)


@pytest.mark.parametrize("format", trajectories.FORMATS)
@pytest.mark.parametrize("name", ["path.txt", "path.txt.gz"])
def test_what_was_read_is_written_back_to_the_last_bit(tmp_path: Path, format: str, name: str) -> None:
    source, again = tmp_path / f"source_{name}", tmp_path / f"again_{name}"
    trajectories.write(source, random_trajectory(2), format)
    first = trajectories.read(source)
    trajectories.write(again, first.trajectory, format, first.as_read)
    assert again.read_bytes() == source.read_bytes()
    second = trajectories.read(again)
    assert bits(first.trajectory.t_world_body) == bits(second.trajectory.t_world_body)
    assert bits(first.trajectory.R_world_body) == bits(second.trajectory.R_world_body)
    if format != "kitti":
        assert bits(first.trajectory.times) == bits(second.trajectory.times)


def test_doubles_survive_the_way_through_a_file(tmp_path: Path) -> None:
    """Times and positions of TUM, matrices of KITTI: the very doubles; 64-bit nanoseconds of EuRoC, too."""
    path = random_trajectory(3)
    trajectories.write(tmp_path / "p.tum", path, "tum")
    tum = trajectories.read(tmp_path / "p.tum").trajectory
    assert bits(tum.times) == bits(path.times)
    assert bits(tum.t_world_body) == bits(path.t_world_body)
    trajectories.write(tmp_path / "p.kitti", path, "kitti")
    kitti = trajectories.read(tmp_path / "p.kitti").trajectory
    assert bits(kitti.R_world_body) == bits(path.R_world_body)
    stamps = [1403636580838555648, 1403636580838555649, 1403636580838555650]  # one double for all three
    euroc = put(tmp_path, "".join(f"{ns},0,0,0,1,0,0,0\n" for ns in stamps), "p.csv")
    file = trajectories.read(euroc)
    assert file.repeated == 0
    assert file.as_read.nanoseconds is not None
    assert file.as_read.nanoseconds.tolist() == stamps
    assert [line.split(",")[0] for line in trajectories.to_text(*file[:3]).splitlines()[1:]] == list(
        map(str, stamps)
    )


def test_seconds_since_1970_become_the_nearest_nanoseconds_and_come_back(tmp_path: Path) -> None:
    path = random_trajectory(4)
    trajectories.write(tmp_path / "p.csv", path, "euroc")
    back = trajectories.read(tmp_path / "p.csv")
    assert bits(back.trajectory.times) == bits(path.times)  # a double has steps of 238 ns there


def test_rounded_quaternions_are_normalised_and_kept(tmp_path: Path) -> None:
    text = "0.0 1.0 2.0 3.0 0.0354 0.0 0.0 0.9994\n"
    file = trajectories.read(put(tmp_path, text))
    length = np.hypot(0.0354, 0.9994)
    assert file.unit_error == pytest.approx(abs(length - 1), rel=1e-9)
    assert 1e-6 < file.unit_error < 1e-3
    R = file.trajectory.R_world_body[0]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=4 * EPS)
    assert trajectories.to_text(*file[:3]).splitlines()[1] + "\n" == text
    without = trajectories.to_text(file.trajectory, "tum").splitlines()[1].split()
    assert np.linalg.norm(np.array(without[4:], float)) == pytest.approx(1.0, abs=2 * EPS)


def test_digits_of_another_trajectory_are_not_written(tmp_path: Path) -> None:
    """A path that was turned after it was read must not be saved with the old quaternions or times."""
    file = trajectories.read(put(tmp_path, GOOD["euroc"]))
    path = file.trajectory
    assert path.times is not None
    turned = Trajectory(path.times, path.t_world_body, np.diag([1.0, -1, -1]) @ path.R_world_body)
    with pytest.raises(ValueError, match="as_read is of another trajectory: its quaternions differ"):
        trajectories.to_text(turned, "euroc", file.as_read)
    late = Trajectory(path.times + 1, path.t_world_body, path.R_world_body)
    with pytest.raises(ValueError, match="its times differ"):
        trajectories.to_text(late, "euroc", file.as_read)
    with pytest.raises(ValueError, match="its quaternions differ"):
        trajectories.to_text(path.take(np.array([0, 1])), "euroc", file.as_read)


def test_euroc_may_have_velocity_and_biases(tmp_path: Path) -> None:
    lines = GOOD["euroc"].splitlines()
    wide = "\n".join([lines[0], *(line + ",0.1" * 9 for line in lines[1:])])
    a, b = trajectories.read(put(tmp_path, wide)), trajectories.read(put(tmp_path, GOOD["euroc"], "b.csv"))
    assert bits(a.trajectory.t_world_body) == bits(b.trajectory.t_world_body)


def test_a_format_without_times_cannot_become_one_with(tmp_path: Path) -> None:
    path = trajectories.read(put(tmp_path, GOOD["kitti"])).trajectory
    for format in ("tum", "euroc"):
        with pytest.raises(ValueError, match=f"without times cannot be written as {format}"):
            trajectories.to_text(path, format)
    with pytest.raises(ValueError, match="format 'csv': need one of tum, kitti, euroc"):
        trajectories.to_text(path, "csv")
    with pytest.raises(ValueError, match="format 'csv': need one of tum, kitti, euroc"):
        trajectories.read(tmp_path / "path.txt", "csv")


@pytest.mark.parametrize(
    ("format", "line", "old", "new", "words"),
    [
        ("tum", 3, "4 0 0 0 1", "4 0 0 0", "7 columns; expected 8, as in the other lines"),
        ("tum", 3, "4 0 0 0 1", "4 0 0 0 1 9", "9 columns; expected 8"),
        ("tum", 3, "1.5 1", "nan 1", "time is 'nan'; expected a finite number"),
        ("tum", 3, "4 0 0 0 1", "1e999 0 0 0 1", "tz is '1e999'; expected a finite number"),
        ("tum", 3, "4 0 0 0 1", "x 0 0 0 1", "tz is 'x'; expected a number"),
        ("tum", 3, "4 0 0 0 1", "4e30 0 0 0 1", "tz is 4e+30 m; expected less than 1e+12"),
        ("tum", 3, "4 0 0 0 1", "4 0 0 0 1e-9", "quaternion of length 1e-09; expected 1 within 0.001"),
        ("tum", 3, "4 0 0 0 1", "4 0 0 0 1.01", "quaternion of length 1.01; expected 1 within 0.001"),
        ("tum", 3, "4 0 0 0 1", "4 1e300 0 0 1", "quaternion of length inf; expected 1"),
        ("kitti", 2, "4", "4 5", "13 columns; expected 12, as in the other lines"),
        ("kitti", 2, "4", "1e999", "tz is '1e999'; expected a finite number"),
        ("kitti", 2, "0 1 4", "0 2 4", "not a rotation matrix (R^T R is 3 off the identity, or det R < 0)"),
        ("kitti", 2, "0 1 4", "0 -1 4", "not a rotation matrix (R^T R is 2 off"),
        ("kitti", 2, "1 0 0 1 0", "1 0 1e300 1 0", "not a rotation matrix"),
        ("euroc", 3, "4, 1,0,0,0", "4, 1,0,0", "7 columns; expected 8, as in the other lines"),
        ("euroc", 3, "4, 1,0,0,0", "4, 0,0,0,0.5", "quaternion of length 0.5"),
        ("euroc", 3, "1500000000", "1.5", "time [ns] is '1.5'; expected whole nanoseconds below 9e18"),
        ("euroc", 3, "1500000000", "9" * 19, "expected whole nanoseconds below 9e18"),
        ("euroc", 1, "q_w,q_x", "roll,pitch", "expected names of time, position and quaternion"),
    ],
)
def test_a_damaged_file_is_refused_with_its_line(
    tmp_path: Path, format: str, line: int, old: str, new: str, words: str
) -> None:
    lines = GOOD[format].splitlines()
    assert old in lines[line - 1]
    lines[line - 1] = lines[line - 1].replace(old, new, 1).removeprefix("#" if line == 1 else "")
    path = put(tmp_path, "\n".join(lines))
    with pytest.raises(FormatError) as caught:
        trajectories.read(path, format)
    message = str(caught.value)
    assert message.startswith(f"{path}:{line}: "), message
    assert words in message
    assert "\n" not in message


@pytest.mark.parametrize("format", [None, *trajectories.FORMATS])
@pytest.mark.parametrize("text", ["", "# nothing\n\n"])
def test_an_empty_file_is_refused(tmp_path: Path, format: str | None, text: str) -> None:
    with pytest.raises(FormatError, match=r"path\.txt: no data; expected"):
        trajectories.read(put(tmp_path, text), format)


def test_a_file_of_no_known_format_is_told_what_would_be_one(tmp_path: Path) -> None:
    with pytest.raises(
        FormatError, match=r":2: 3 columns; expected 8 \(TUM\), 12 \(KITTI\), or 8 with commas"
    ):
        trajectories.read(put(tmp_path, "# a\n1 2 3\n"))


def test_repeated_times_are_counted_and_kept(tmp_path: Path) -> None:
    rows = [f"{k / 8} {k} 0 0 0 0 0 1" for k in range(200)]
    for k in (70, 80, 81):
        rows[k] = " ".join([rows[k - 1].split()[0], *rows[k].split()[1:]])
    file = trajectories.read(put(tmp_path, "\n".join(rows)))
    assert file.repeated == 3
    np.testing.assert_array_equal(file.trajectory.t_world_body[:, 0], np.arange(200))


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = put(tmp_path, "old")
    with pytest.raises(ValueError, match="without times"):
        trajectories.write(path, Trajectory(None, np.zeros((1, 3)), np.eye(3)[None]), "tum")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
    trajectories.write(path, random_trajectory(5), "tum")
    assert list(tmp_path.iterdir()) == [path]


def test_packed_files_are_the_same_bytes_every_time(tmp_path: Path) -> None:
    for name in ("a.gz", "b.gz"):
        trajectories.write(tmp_path / name, random_trajectory(6), "tum")
    assert (tmp_path / "a.gz").read_bytes() == (tmp_path / "b.gz").read_bytes()
    assert gzip.decompress((tmp_path / "a.gz").read_bytes()).startswith(b"# time tx ty")


@pytest.mark.parametrize("format", trajectories.FORMATS)
def test_seeded_damage_is_refused_in_one_line_or_harmless(tmp_path: Path, format: str) -> None:
    rng = np.random.default_rng(7)
    good = trajectories.to_text(random_trajectory(8, 6), format).encode()
    path = tmp_path / "path.txt"
    told: list[str] = []
    for _ in range(400):
        data = bytearray(good)
        for _ in range(rng.integers(1, 4)):
            at = int(rng.integers(len(data)))
            kind = rng.integers(3)
            if kind == 0:
                data[at] = int(rng.integers(256))
            elif kind == 1:
                del data[at : at + int(rng.integers(1, 40))]
            else:
                data[at:at] = bytes(rng.choice(list(b"0 1-.,e\n#nai+"), int(rng.integers(1, 8))).tolist())
        path.write_bytes(data)
        try:
            assert np.isfinite(trajectories.read(path).trajectory.R_world_body).all()
        except FormatError as error:
            told.append(str(error))
    assert len(told) > 100
    assert [m for m in told if not re.fullmatch(rf"{re.escape(str(path))}(:\d+)?: .+", m)] == []


@needs_tables
@pytest.mark.parametrize(
    ("name", "format", "poses", "repeated", "unit_error"),
    [
        ("fr2_desk_groundtruth", "tum", 20957, 1, 8.7e-5),
        ("freiburg1_xyz-rgbdslam", "tum", 788, 0, 1e-6),
        ("KITTI_00_gt", "kitti", 4541, 0, 3e-7),
        ("KITTI_00_SPTAM", "kitti", 4541, 0, 1e-14),
    ],
)
def test_recorded_files_come_back_with_every_number(
    tmp_path: Path, name: str, format: str, poses: int, repeated: int, unit_error: float
) -> None:
    assert FOLDER is not None
    source = FOLDER / f"{name}.txt"
    file = trajectories.read(source)
    assert (file.format, len(file.trajectory), file.repeated) == (format, poses, repeated)
    assert unit_error / 3 < file.unit_error < unit_error or file.unit_error < 1e-14
    trajectories.write(tmp_path / "again.txt", file.trajectory, file.format, file.as_read)
    assert bits(np.loadtxt(tmp_path / "again.txt")) == bits(np.loadtxt(source))

"""Trajectories as programs write them: one path in many forms is read as the same; oddities are told."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vslam_ref.datasets import trajectories
from vslam_ref.datasets.text import FormatError
from vslam_ref.datasets.trajectories.names import layout, split_header

N = 12
EPOCH = 1_403_636_580
MICROSECONDS = [EPOCH * 10**6 + 50_000 * k for k in range(N)]
Words = list[str]


def poses() -> list[Words]:
    """Lines of TUM: time tx ty tz qx qy qz qw."""
    rng = np.random.default_rng(0)
    t, q = rng.normal(size=(N, 3)), Rotation.random(N, random_state=rng).as_quat()
    return [
        [f"{us // 10**6}.{us % 10**6:06d}", *(f"{v:.7f}" for v in (*t[k], *q[k]))]
        for k, us in enumerate(MICROSECONDS)
    ]


LINES = poses()
TUM = "time tx ty tz qx qy qz qw"


def first(w: Words) -> Words:
    """The same pose with w first."""
    return [*w[:4], w[7], *w[4:7]]


def ns(w: Words) -> Words:
    return [w[0].replace(".", "") + "000", *w[1:]]


def table(change: Callable[[Words], Words] = list, sep: str = " ", end: str = "", head: str = "") -> str:
    return (f"{head}\n" if head else "") + "".join(sep.join(change(w)) + end + "\n" for w in LINES)


def put(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "path.txt"
    path.write_bytes(text.encode())
    return path


def same(file: trajectories.TrajectoryFile, which: list[int] | None = None) -> None:
    """The poses of the file are those of ``LINES``, to the digits that are written."""
    values = np.array(LINES, dtype=float)[list(range(N)) if which is None else which]
    path = file.trajectory
    np.testing.assert_allclose(path.times, values[:, 0], rtol=0, atol=3e-7)  # half a step of a double there
    np.testing.assert_allclose(path.t_world_body, values[:, 1:4], atol=0)
    # seven decimals: 2e-7 of rotation matrices is more than they move
    R = Rotation.from_quat(values[:, 4:]).as_matrix()
    np.testing.assert_allclose(path.R_world_body, R, atol=5e-7)


EUROC = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []"
ROS = "field.pose.{}.x,field.pose.{}.y,field.pose.{}.z"
TOPIC = ",".join(
    ["%time", "field.header.seq", "field.header.stamp", "field.header.frame_id",
     ROS.replace("{}", "position"), ROS.replace("{}", "orientation"), "field.pose.orientation.w"]
)  # fmt: skip
OKVIS = "timestamp, p_WS_W_x, p_WS_W_y, p_WS_W_z, q_WS_x, q_WS_y, q_WS_z, q_WS_w, v_WS_W_x, b_g_x"
MAPLAB = (
    "vertex index, timestamp [ns], position x [m], position y [m], position z [m], "
    "quaternion x, quaternion y, quaternion z, quaternion w"
)
NAMED = TUM.replace(" ", ",")
RIGHT = {
    "blanks": table(),
    "tabs": table(sep="\t"),
    "a blank at the end": table(end=" "),
    "commas": table(sep=","),
    "a comma at the end": table(sep=",", end=","),
    "commas and blanks": table(sep=", "),
    "semicolons": table(sep=";", end=";"),
    "decimal commas": table(lambda w: [x.replace(".", ",") for x in w], ";", head=TUM.replace(" ", ";")),
    "decimal commas and tabs": table(lambda w: [x.replace(".", ",") for x in w], "\t"),
    "carriage returns and a byte order mark": "\ufeff" + table(head="# " + TUM).replace("\n", "\r\n"),
    "a mark within": table().replace("\n", "\n\ufeff", 1),
    "savetxt": table(lambda w: [f"{float(x):.18e}" for x in w]),
    "VINS": table(lambda w: [*first(ns(w)), "0.1", "0.2", "nan"], ",", ","),
    "VINS, loop closed": table(lambda w: first(ns(w)), ",", ","),
    "EuRoC": table(lambda w: first(ns(w)), ",", head=EUROC),
    "EuRoC with biases": table(lambda w: [*first(ns(w)), *["0.1"] * 9], ","),
    "OKVIS": table(lambda w: [*ns(w), "1", "2"], ", ", head=OKVIS),
    "maplab": table(lambda w: ["7", *ns(w)], ", ", head=MAPLAB),
    "OpenVINS": table(lambda w: [*w, "1e-4", "2e-4"], head="# timestamp(s) tx ty tz qx qy qz qw Pr11 Pr12"),
    "RTAB-Map": table(lambda w: [*w, "3"], head="#timestamp x y z qx qy qz qw id"),
    "rostopic": table(lambda w: [ns(w)[0], "5", ns(w)[0], "base link", *w[1:]], ",", head=TOPIC),
    "two columns of time": table(lambda w: [w[0][:10], w[0][11:] + "000", *w[1:]], ",",
                                 head="stamp.secs,stamp.nsecs,x,y,z,qx,qy,qz,qw"),
    "pandas": table(lambda w: ["0", *w], ",", head=",timestamp,tx,ty,tz,qx,qy,qz,qw"),
    "milliseconds by name": table(lambda w: [w[0].replace(".", "")[:13], *w[1:]], ",",
                                  head="timestamp_ms,tx,ty,tz,qx,qy,qz,qw"),
    "R": table(lambda w: ['"1"', *w], head='"time" "tx" "ty" "tz" "qx" "qy" "qz" "qw"'),
    "w first by name": table(first, head="# time tx ty tz qw qx qy qz"),
    "quaternion before position": table(lambda w: [w[0], *w[4:], *w[1:4]], head="t qx qy qz qw x y z"),
    "MATLAB's comments": "% made by a script\n" + table(),
    "a header again": table(sep=",", head=NAMED).replace("\n", f"\n{NAMED}\n", 4),
}  # fmt: skip


@pytest.mark.parametrize("name", RIGHT)
def test_one_path_in_many_forms_is_read_as_the_same_without_a_note(tmp_path: Path, name: str) -> None:
    file = trajectories.read(put(tmp_path, RIGHT[name]))
    same(file)
    assert file.notes == ()


def test_utf_16_as_a_windows_shell_writes_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "path.txt"
    path.write_bytes(table().encode("utf-16"))
    same(trajectories.read(path))
    path.write_bytes(table().encode("utf-16")[:-1])
    with pytest.raises(FormatError, match="not a text file; UTF-8 expected"):
        trajectories.read(path)


@pytest.mark.parametrize(
    ("change", "unit"),
    [
        (lambda w: [ns(w)[0] + ".000000", *w[1:]], "nanoseconds"),
        (ns, "nanoseconds"),
        (lambda w: [w[0].replace(".", ""), *w[1:]], "microseconds"),
        (lambda w: [w[0].replace(".", "")[:13] + ".000", *w[1:]], "milliseconds"),
    ],
)
def test_times_since_1970_in_a_finer_unit_are_read_so_and_told(
    tmp_path: Path, change: Callable[[Words], Words], unit: str
) -> None:
    file = trajectories.read(put(tmp_path, table(change)))
    same(file)
    assert file.notes == (f"the times are {unit} since 1970, not seconds, by their size: read as such",)
    assert file.as_read.nanoseconds is not None
    assert file.as_read.nanoseconds.tolist() == [us * 1000 for us in MICROSECONDS]


def test_times_that_begin_at_zero_keep_the_unit_of_the_format(tmp_path: Path) -> None:
    text = "".join(f"{50_000_000 * k} {k} 0 0 0 0 0 1\n" for k in range(5))
    file = trajectories.read(put(tmp_path, text))
    assert file.trajectory.times is not None
    assert file.trajectory.times.tolist() == [5e7 * k for k in range(5)]
    euroc = trajectories.read(put(tmp_path, text.replace(" ", ",").replace("0,0,0,1", "1,0,0,0")))
    assert euroc.trajectory.times is not None
    np.testing.assert_allclose(euroc.trajectory.times, 0.05 * np.arange(5), rtol=1e-15)
    # 20 minutes after a machine's start; as milliseconds they would be of 2008, but half a day apart
    text = "".join(f"{1_200_000_000_000 + 50_000_000 * k},{k},0,0,1,0,0,0\n" for k in range(5))
    boot = trajectories.read(put(tmp_path, text))
    assert (boot.format, boot.notes) == ("euroc", ())
    assert boot.trajectory.times is not None
    np.testing.assert_allclose(boot.trajectory.times, 1200 + 0.05 * np.arange(5), rtol=1e-15)


def test_lines_out_of_order_are_sorted_and_told(tmp_path: Path) -> None:
    lines = table().splitlines()
    lines[3], lines[4] = lines[4], lines[3]
    file = trajectories.read(put(tmp_path, "\n".join(lines)))
    same(file)
    (note,) = file.notes
    assert note.startswith("the time goes back once (first: line 5, by at most 0.05 s): the poses are put in")
    backwards = trajectories.read(put(tmp_path, "\n".join(table().splitlines()[::-1])))
    same(backwards)
    assert backwards.notes[0].startswith("the time goes back 11 times")
    assert backwards.places is not None
    assert backwards.places.tolist() == list(range(N))[::-1]


def test_of_two_lines_of_one_time_the_first_of_the_file_stays_first(tmp_path: Path) -> None:
    """Keyframes written again behind the path: each follows its own pose, and is not the one that is used."""
    again = [[w[0], "9", *w[2:]] for w in LINES[::4]]
    text = table() + "".join(" ".join(w) + "\n" for w in again)
    file = trajectories.read(put(tmp_path, text))
    assert file.repeated == 3
    assert file.notes[1] == (
        "3 poses of 15 with the time of an earlier line (first: line 13): the first pose of each time is used"
    )
    _, where = np.unique(np.asarray(file.trajectory.times), return_index=True)
    assert 9.0 not in file.trajectory.t_world_body[where, 0]
    assert (file.trajectory.t_world_body[:, 0] == 9.0).sum() == 3


def test_times_of_which_most_are_doubled_ask_for_the_digits(tmp_path: Path) -> None:
    file = trajectories.read(put(tmp_path, table(lambda w: [f"{float(w[0]):.6g}", *w[1:]])))
    assert file.repeated == N - 1
    assert file.notes[0].endswith("is used; were the times written with too few digits?")


@pytest.mark.parametrize("lost", ["nan", "-nan", "-nan(ind)", "NaN", "-1.#IND", "inf", "NA", "None", "null"])
def test_a_lost_frame_is_left_out_and_told(tmp_path: Path, lost: str) -> None:
    text = "".join(
        " ".join([w[0], *([lost] * 7 if k in (2, 5) else w[1:])]) + "\n" for k, w in enumerate(LINES)
    )
    file = trajectories.read(put(tmp_path, text))
    same(file, [k for k in range(N) if k not in (2, 5)])
    assert file.notes == (
        "2 lines of 12 without a pose (nan, or a rotation of zeros; first: line 3): lost frames, left out",
    )


def test_zeros_for_a_quaternion_and_empty_fields_are_lost_frames(tmp_path: Path) -> None:
    """TUM's own program leaves out zeros; pandas writes nothing for what is not known."""
    zeros = table().splitlines()
    zeros[4] = " ".join([*LINES[4][:4], "0", "0.0", "0.000000", "0e0"])
    same(trajectories.read(put(tmp_path, "\n".join(zeros))), [k for k in range(N) if k != 4])
    empty = table(sep=",", head=TUM.replace(" ", ",")).splitlines()
    empty[1] = LINES[0][0] + 7 * ","
    file = trajectories.read(put(tmp_path, "\n".join(empty)))
    same(file, list(range(1, N)))
    assert "first: line 2" in file.notes[0]


def test_lost_lines_of_matrices_keep_the_places_of_the_others(tmp_path: Path) -> None:
    rows = [f"1 0 0 {k} 0 1 0 0 0 0 1 0" for k in range(6)]
    rows[2] = " ".join(["nan"] * 12)
    rows[4] = "0 0 0 7 0 0 0 7 0 0 0 7"
    file = trajectories.read(put(tmp_path, "\n".join(rows)))
    assert file.places is not None
    assert (file.format, file.places.tolist(), file.lines) == ("kitti", [0, 1, 3, 5], 6)
    assert file.trajectory.t_world_body[:, 0].tolist() == [0, 1, 3, 5]
    assert file.notes[0].startswith("2 lines of 6 without a pose")


def test_matrices_of_four_rows_are_read(tmp_path: Path) -> None:
    text = "\n".join(f"0 -1 0 {k} 1 0 0 2 0 0 1 3 0 0 0 1" for k in range(3))
    file = trajectories.read(put(tmp_path, text))
    assert (file.format, file.notes) == ("kitti", ("16 columns: the last four, 0 0 0 1, are not read",))
    assert file.trajectory.t_world_body.tolist() == [[0, 2, 3], [1, 2, 3], [2, 2, 3]]
    assert file.trajectory.R_world_body[0].tolist() == [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    with pytest.raises(FormatError, match=r":1: 16 columns; expected 12"):
        trajectories.read(put(tmp_path, text.replace("0 0 0 1", "0 0 0 2")), "kitti")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda w: [*w, "17"], "9 columns without names: the first 8 are read as time, tx"),
        (
            lambda w: ["17", *w],
            "9 columns without names: the first is taken for the number of the pose, the nex",
        ),
    ],
)
def test_a_column_more_is_passed_over_and_told(
    tmp_path: Path, change: Callable[[Words], Words], words: str
) -> None:
    """Which of the nine is none of the pose is told by the length of the quaternion."""
    file = trajectories.read(put(tmp_path, table(change)))
    same(file)
    assert file.notes[0].startswith(words)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            table()[:-40],
            r":12: 5 columns; expected 8, .*; the file ends within this line, as of a program that",
        ),
        (table()[:-8], r":12: quaternion of length .*; the file ends within this line"),
        (table()[30:], r":1: \d columns; expected 8, as in the other lines"),
        (table(lambda w: w[1:]), ":1: 7 columns; .*is the time missing"),
        (table(lambda w: w[:4]), ":1: 4 columns; .*positions alone are no poses"),
        (
            table(lambda w: w[:7], ",", head="time,x,y,z,roll,pitch,yaw"),
            ":1: the header has no column qw, qx",
        ),
        (table(lambda w: w[1:], ",", head="x,y,z,qx,qy,qz,qw"), ":1: the header has no column time"),
        (
            table(lambda w: [*w, "1"], ",", head="time,x,y,z,qx,qy,qz,qw,px"),
            "two columns could be tx: x and px",
        ),
        (table(lambda w: ["VERTEX_SE3:QUAT", *w]), ":1: time is 'VERTEX_SE3:QUAT'; expected a number"),
        (TUM + "\n", "no data below the header"),
        (table(lambda w: [w[0], *["nan"] * 7]), ":1: no pose in 12 lines"),
        (table(lambda w: ["nan", *w[1:]]), ":1: time is 'nan'; expected a finite number"),
        (table().replace(LINES[3][2], "1.2x"), ":4: ty is '1.2x'; expected a number"),
        ("<html>\n<p>404: not found here</p>\n", r"columns"),
    ],
)
def test_what_is_corrupt_is_one_line_that_says_where(tmp_path: Path, text: str, words: str) -> None:
    path = put(tmp_path, text)
    with pytest.raises(FormatError, match=words) as caught:
        trajectories.read(path)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(path))


def test_a_first_line_of_words_that_name_no_pose_is_told(tmp_path: Path) -> None:
    file = trajectories.read(put(tmp_path, table(head="a b c d e f g h")))
    same(file)
    assert file.notes == (
        "line 1 (a b c d e f g h) names no pose: the columns are taken to be in the usual order",
    )


def test_separators_that_change_are_told(tmp_path: Path) -> None:
    """Two files put together: as TUM's own program does, both are read."""
    lines = table().splitlines()
    file = trajectories.read(
        put(tmp_path, "\n".join([*lines[:5], *(x.replace(" ", ",") for x in lines[5:])]))
    )
    same(file)
    assert file.notes == ("separators change, first at line 6: read as if they were the same",)


def test_names_of_velocities_and_biases_are_no_positions() -> None:
    names = split_header("vx vy vz ax b_a_x w_x twist.linear.x t x y z qx qy qz qw sigma_x cov_xx")
    found = layout(names)
    assert not isinstance(found, str)
    assert [names[k] for k in (*found.time, *found.pose)] == ["t", "x", "y", "z", "qw", "qx", "qy", "qz"]


def test_what_was_sorted_is_written_in_order_with_its_digits(tmp_path: Path) -> None:
    lines = table(lambda w: first(ns(w)), ",").splitlines()
    file = trajectories.read(put(tmp_path, "\n".join([lines[1], lines[0], *lines[2:]])))
    text = trajectories.to_text(file.trajectory, "euroc", file.as_read)
    assert [line.split(",")[0] for line in text.splitlines()[1:]] == [ns(w)[0] for w in LINES]
    values = np.array([line.split(",")[4:] for line in text.splitlines()[1:]], dtype=float)
    np.testing.assert_array_equal(values, np.array([first(w)[4:] for w in LINES], dtype=float))

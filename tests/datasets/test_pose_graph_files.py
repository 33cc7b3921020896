"""Pose graph files: what a line means, round trips, what is told, and what is refused, and where."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest
from pose_graph_samples import EXPMAP, SE2, SE3, TEXTS, TORO2, TORO3
from scipy.spatial.transform import Rotation

from vslam_ref.datasets.pose_graph_files import PoseGraphFile, read_pose_graph, write_pose_graph
from vslam_ref.datasets.text import FormatError
from vslam_ref.estimation.posegraph import PoseGraph
from vslam_ref.estimation.posegraph.spaces import GROUPS, Space, tangent_size
from vslam_ref.geometry import sim3


def read(folder: Path, text: str, name: str = "graph.g2o") -> PoseGraphFile:
    (folder / name).write_text(text)
    return read_pose_graph(folder / name)


def test_a_line_of_the_plane(tmp_path: Path) -> None:
    file = read(tmp_path, SE2)
    graph = file.graph
    assert (graph.space, file.format, graph.sizes, file.notes) == ("se2", "g2o", (4, 4), ())
    np.testing.assert_allclose(graph.T_world[1], [1.02, 0.01, 1.56])
    assert graph.information[1].tolist() == [[50, -2, 1], [-2, 50, 0], [1, 0, 100]]
    assert (graph.tail.tolist(), graph.head.tolist()) == ([0, 1, 2, 3], [1, 2, 3, 0])
    assert graph.fixed.tolist() == file.told_fixed.tolist() == [True, False, False, False]
    assert file.edge_lines.tolist() == [6, 7, 8, 9]
    assert file.edge_name(3) == "edge 3 -> 0 (line 9)"


def test_quaternions_are_xyzw(tmp_path: Path) -> None:
    """Against SciPy's rotations, whose order is the same."""
    graph = read(tmp_path, SE3).graph
    wanted = Rotation.from_quat([0, 0.01, 0.7071, 0.70711]).as_matrix()
    np.testing.assert_allclose(graph.measured[1, :3, :3], wanted, atol=1e-15)
    assert graph.information[0, 0, 5] == graph.information[0, 5, 0] == 1.0
    assert graph.information[1, 3, 3] == 40.0


def test_toro_has_its_own_order_in_the_plane(tmp_path: Path) -> None:
    """11 12 22 33 13 23; another kind of line is counted."""
    file = read(tmp_path, TORO2)
    assert file.graph.information[0].tolist() == [[1, 0.1, 0], [0.1, 1, 0], [0, 0, 1]]
    assert file.graph.information[1].tolist() == [[1, 0, 0], [0, 1, 0.2], [0, 0.2, 1]]
    assert file.notes == ("1 line(s) of other kinds left out: 1 EQUIV",)
    assert file.format == "toro"


def test_information_by_rows_under_toros_tag_is_seen(tmp_path: Path) -> None:
    """11 12 13 22 23 33: in TORO's order the matrix would have a 0 on its diagonal."""
    file = read(tmp_path, "EDGE2 0 1 1 0 0 5 0 0 6 0 7\nEDGE2 1 2 1 0 0 5 0 0.1 6 0 7\n")
    assert np.diagonal(file.graph.information[1]).tolist() == [5, 6, 7]
    assert file.graph.information[1, 0, 2] == 0.1
    assert "row by row" in file.notes[0]


def test_roll_pitch_yaw_are_about_the_axes_of_the_world_in_this_order(tmp_path: Path) -> None:
    """Rz Ry Rx, by SciPy's extrinsic xyz; vertex 2 has no pose."""
    file = read(tmp_path, TORO3)
    wanted = Rotation.from_euler("xyz", [0.1, -0.1, 1.5]).as_matrix()
    np.testing.assert_allclose(file.graph.measured[0, :3, :3], wanted, atol=1e-15)
    assert file.placed.tolist() == [True, True, False]
    with pytest.raises(FormatError, match=r"graph.g2o:4: vertex 2 has no VERTEX line; expected a pose"):
        file.require_poses()


def test_the_logarithm_of_g2o_has_the_rotation_first(tmp_path: Path) -> None:
    file = read(tmp_path, EXPMAP)
    np.testing.assert_allclose(sim3.log(file.graph.T_world[1]), [1, 2, 3, 0.1, 0.2, 0.3, 0.05], atol=1e-14)
    np.testing.assert_allclose(file.graph.measured[0], file.graph.T_world[1])
    numbers = np.zeros((7, 7))
    numbers[np.triu_indices(7)] = np.arange(28) / 1000
    numbers += np.diag(np.arange(10.0, 17.0))
    words = " ".join(map(str, numbers[np.triu_indices(7)]))
    graph = read(tmp_path, f"EDGE_SIM3:EXPMAP 0 1 0 0 0 0 0 0 0 {words}\n").graph
    full = numbers + np.triu(numbers, 1).T
    # row 0 of the file is the first rotation, which is coordinate 3 here
    assert graph.information[0, 3, 0] == full[0, 3]
    assert graph.information[0, 3, 6] == full[0, 6]
    assert np.diagonal(graph.information[0])[:3].tolist() == np.diagonal(full)[3:6].tolist()


@pytest.mark.parametrize("suffix", [".g2o", ".graph", ".txt"])
@pytest.mark.parametrize("space", ["se2", "se3", "sim3"])
def test_round_trip(space: Space, suffix: str, tmp_path: Path) -> None:
    """Written and read again: the same graph to the rounding of quaternions, angles and logarithms."""
    rng, group, d = np.random.default_rng(1), GROUPS[space], tangent_size(space)
    A = rng.standard_normal((6, d, d))
    graph = PoseGraph(
        space,
        group.random(rng, (5,)),
        [0, 1, 2, 3, 0, 4],
        [1, 2, 3, 4, 2, 1],
        group.random(rng, (6,)),
        A @ np.swapaxes(A, 1, 2) + np.eye(d),
    )
    ids = np.array([3, 5, 8, 2**60, 2**62])
    file = PoseGraphFile(graph, ids=ids, told_fixed=np.arange(5) == 0)
    path = tmp_path / f"graph{suffix}"
    if space == "sim3" and suffix != ".g2o":
        with pytest.raises(ValueError, match=r"TORO's and GTSAM's text cannot say it; use .g2o"):
            write_pose_graph(path, file)
        assert not path.exists()
        return
    write_pose_graph(path, file)
    again = read_pose_graph(path)
    assert again.notes == ()
    assert again.ids.tolist() == ids.tolist()
    assert again.format == ("g2o" if suffix == ".g2o" else "toro")
    for name in ("tail", "head", "fixed"):
        assert (getattr(again.graph, name) == getattr(graph, name)).all()
    np.testing.assert_allclose(again.graph.T_world, graph.T_world, atol=1e-13)
    np.testing.assert_allclose(again.graph.measured, graph.measured, atol=1e-13)
    np.testing.assert_allclose(again.graph.information, graph.information, rtol=1e-14, atol=1e-15)


def test_packed_files_and_another_suffix(tmp_path: Path) -> None:
    path = tmp_path / "graph.g2o.gz"
    path.write_bytes(gzip.compress(SE2.encode()))
    assert read_pose_graph(path).graph.sizes == (4, 4)
    with pytest.raises(ValueError, match=r"suffix '.xyz' is of no format that is written; use .g2o"):
        write_pose_graph(tmp_path / "a.xyz", read_pose_graph(path))


def test_upright_angles_are_written(tmp_path: Path) -> None:
    """A pitch of a right angle, both ways."""
    for pitch in (np.pi / 2, -np.pi / 2):
        line = f"EDGE3 0 1 0 0 0 0.3 {pitch!r} 0.5 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n"
        file = read(tmp_path, line)
        write_pose_graph(tmp_path / "b.txt", file)
        again = read_pose_graph(tmp_path / "b.txt")
        np.testing.assert_allclose(again.graph.measured, file.graph.measured, atol=1e-8)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            SE3.replace("0 0 1 0\nE", "0 0 2 0\nE", 1),
            "1 quaternion(s) normalised: lengths up to 1 off 1 (first: line 3)",
        ),
        (SE2.replace("FIX 0", "VERTEX_SE2 1 7 7 7"), "(vertex 1 on lines 2 and 5): the first counts"),
        (SE2 + "EDGE_SE2 0 1 1 0 1.57 50 2 0 50 0 100\n", "1 edge(s) repeat one before"),
        (
            SE2 + "VERTEX_XY 9 1 2\nVERTEX_XY 10 1 2\nHELLO\n",
            "3 line(s) of other kinds left out: 2 VERTEX_XY, 1 H",
        ),
        (SE2 + "VERTEX_SE2 9 1 2 0\n", "2 parts that no edge joins; 1 of them a vertex without edges"),
        (SE2 + "EDGE_SE2 20 21 1 0 0 1 0 0 1 0 1\n", "2 parts that no edge joins: each is held at its first"),
    ],
)
def test_what_is_odd_is_told(text: str, told: str, tmp_path: Path) -> None:
    assert any(told in note for note in read(tmp_path, text).notes), read(tmp_path, text).notes


@pytest.mark.parametrize("name", [name for name in TEXTS if name != "toro2"])
def test_what_is_right_raises_no_note(name: str, tmp_path: Path) -> None:
    text = "# a comment\n\n" + TEXTS[name].replace(" ", "  ") + "\n"
    assert read(tmp_path, text).notes == ()


def test_rounded_quaternions_raise_no_note(tmp_path: Path) -> None:
    """Five digits: lengths up to 1e-5 off."""
    assert read(tmp_path, SE3.replace("0.70711", "0.7071")).notes == ()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            SE2.replace("1.5 5 0 0 5 0 10", "1.5 5 0 0 5 0"),
            ":9: 10 columns after the tag; EDGE_SE2 needs 11: i j x y",
        ),
        (SE2.replace("3.13", "nan"), ":3: theta is 'nan'; expected a finite number"),
        (SE2.replace("3.13", "1e999"), ":3: theta is '1e999'; expected a finite number"),
        (
            SE2.replace("EDGE_SE2 1 2", "EDGE_SE2 1 1"),
            ":7: edge from vertex 1 to itself; expected two vertices",
        ),
        (
            SE2.replace("50 -2 1 50 0 100", "50 -60 1 50 0 100"),
            ":7: EDGE_SE2: information of edge 1 -> 2 with least eigenvalue -10",
        ),
        (
            SE2.replace("50 -2 1 50 0 100", "0 0 0 50 0 100"),
            ":7: EDGE_SE2: information of edge 1 -> 2 with least eigenvalue 0;",
        ),
        (SE2.replace("FIX 0", "FIX 99"), ":5: FIX names vertex 99, which has no VERTEX line"),
        (SE2.replace("FIX 0", "FIX"), ":5: FIX without a vertex; expected FIX id ..."),
        (
            SE2.replace("EDGE_SE2 1 2", "EDGE_SE2 1 x2"),
            ":7: vertex is 'x2'; expected a whole number, 0 or more",
        ),
        (
            SE2.replace("EDGE_SE2 1 2", "EDGE_SE2 1 -2"),
            ":7: vertex is '-2'; expected a whole number, 0 or more",
        ),
        (
            SE2.replace("0.97", "1e15"),
            ":3: VERTEX_SE2 has a number of 1e+12 or more; expected metres and radians",
        ),
        (
            SE3.replace("0 0 0.70711 0.70711\nV", "0 0 0 0\nV"),
            "QUAT has a quaternion or a scale of 0; expected a",
        ),
        (
            SE2 + SE3,
            ":10: VERTEX_SE3:QUAT in a file that has VERTEX_SE2 on line 1; expected poses of one space",
        ),
        (
            "EDGE2 0 1 1 0 0.1 9 0 9\n",
            ":1: 8 columns after the tag; EDGE2 needs 11: i j x y theta I11 I12 I22 I33 I13 I23",
        ),
        ("VERTEX_SE2 0 0 0 0\n", ": 1 vertices and no edge; expected lines of g2o"),
        ("hello\n", ": no known line and no edge; expected lines of g2o"),
        ("", ": no known line and no edge; expected lines of g2o"),
        (
            EXPMAP.replace("3 0.05 1 1 0 0", "3 5e7 1 1 0 0"),
            ":2: VERTEX_SIM3:EXPMAP has a scale out of e^-8",
        ),
        (
            EXPMAP.replace("3 0.05 1 1 0 0", "3 9.05 1 1 0 0"),
            ":2: VERTEX_SIM3:EXPMAP has a scale out of e^-8",
        ),
    ],
)
def test_what_is_wrong_is_refused_in_one_line(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, text)
    message = str(caught.value)
    assert message.startswith(str(tmp_path / "graph.g2o"))
    assert said in message
    assert "\n" not in message


def test_a_file_beyond_the_limit_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.g2o").write_text(SE2)
    with pytest.raises(FormatError, match="more than 100 bytes unpacked"):
        read_pose_graph(tmp_path / "a.g2o", max_bytes=100)
    with pytest.raises(FormatError, match="no such file"):
        read_pose_graph(tmp_path / "b.g2o")


def test_without_its_rejected_edges_the_gauge_is_found_anew(tmp_path: Path) -> None:
    file = read(tmp_path, SE2)
    cut = file.without(np.array([False, True, False, True]))
    assert cut.graph.sizes == (4, 2)
    assert cut.graph.fixed.tolist() == [True, False, True, False]
    assert cut.edge_lines.tolist() == [6, 8]
    assert file.without(np.zeros(4, dtype=np.bool_)) is file

"""The public graphs: chi² that two other solvers found, in both conventions, and lists of false loops."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from vslam_ref.datasets import catalogue
from vslam_ref.datasets.pose_graph_files import PoseGraphFile, read_pose_graph
from vslam_ref.estimation.posegraph import (
    PoseGraph,
    book,
    chordal_start,
    marginal_covariances,
    odometry_start,
    solve_graph,
)
from vslam_ref.estimation.posegraph.spaces import GROUPS, translations

FOLDER = catalogue.find("pose_graphs")
pytestmark = pytest.mark.skipif(FOLDER is None, reason="data set pose_graphs is not in VSLAM_REF_DATA")

LEAST = {
    "tinyGrid3D.g2o": 18.6278189,
    "smallGrid3D.g2o": 1035.85066,
    "parking-garage.g2o": 1.2683848,
    "sphere2500.g2o": 1351.40193,
    "CSAIL.g2o": 40.5508833,
    "intel.g2o": 45.0042331,
    "manhattan.g2o": 3549.04107,
    "kitti_00.g2o": 98.3221382,
    "gtsam/Klaus3.g2o": 0.01405558,
}
"""By GTSAM and by a solver in SciPy, in the convention of the whole logarithm."""
LEAST_G2O = {
    "tinyGrid3D.g2o": 6.72788162,
    "smallGrid3D.g2o": 458.153784,
    "parking-garage.g2o": 1.23869058,
    "intel.g2o": 45.0046958,
    "CSAIL.g2o": 40.5551288,
    "manhattan.g2o": 3549.0368,
    "kitti_00.g2o": 98.3220117,
    "sphere2500.g2o": 727.149667,
}
"""By g2o itself, in its convention."""
DIGITS = 1e-7
"""Relative; the values above have eight or nine digits."""
SLOW = {"sphere2500.g2o", "manhattan.g2o", "parking-garage.g2o", "kitti_00.g2o"}


def named(table: dict[str, float]) -> list[Any]:
    return [pytest.param(n, v, id=n, marks=pytest.mark.slow if n in SLOW else ()) for n, v in table.items()]


def read(name: str) -> PoseGraphFile:
    assert FOLDER is not None
    return read_pose_graph(FOLDER / name)


@pytest.mark.parametrize(("name", "least"), named(LEAST))
def test_chi2_from_every_start(name: str, least: float) -> None:
    file = read(name)
    starts = [odometry_start(file.graph), chordal_start(file.graph)]
    if file.placed.all():
        starts.append(file.graph.T_world)
    for start in starts:
        found = solve_graph(file.graph.at(start))
        assert found.converged
        assert found.chi2 == pytest.approx(least, rel=DIGITS if least > 1 else 1e-6)


@pytest.mark.parametrize(("name", "least"), named(LEAST_G2O))
def test_chi2_in_the_convention_of_g2o(name: str, least: float) -> None:
    graph = read(name).graph
    found = solve_graph(graph.at(chordal_start(graph)), convention="g2o")
    assert found.chi2 == pytest.approx(least, rel=DIGITS)


def test_a_chain_of_exact_edges_closes() -> None:
    """The sphere without its noise: chained poses leave chi² as its six printed digits do."""
    file = read("gtsam/sphere2500_groundtruth.txt")
    assert (file.format, file.graph.sizes) == ("toro", (2500, 4949))
    start = file.graph.at(odometry_start(file.graph))
    assert solve_graph(start).initial_chi2 < 1.0


def test_two_formats_tell_the_same_measurements() -> None:
    """sphere2500 by roll, pitch, yaw and by quaternions: six printed digits of each."""
    angles, quaternions = read("gtsam/sphere2500.txt").graph, read("sphere2500.g2o").graph
    orders = [np.lexsort((graph.head, graph.tail)) for graph in (angles, quaternions)]
    one, other = (g.measured[order] for g, order in zip((angles, quaternions), orders, strict=True))
    assert (angles.tail[orders[0]] == quaternions.tail[orders[1]]).all()
    assert (angles.head[orders[0]] == quaternions.head[orders[1]]).all()
    np.testing.assert_allclose(one, other, atol=5e-5)


def test_toro_graph_in_the_plane() -> None:
    """w100: edges from the later to the earlier pose; its start is near, and fits at three orders lower."""
    file = read("gtsam/w100.graph")
    found = solve_graph(file.graph)
    assert file.graph.sizes == (100, 300)
    assert file.notes == ("40 line(s) of other kinds left out: 40 EQUIV",)
    assert found.chi2 < 0.2 * found.initial_chi2


def test_right_files_raise_no_note_but_for_doubled_edges() -> None:
    for name in LEAST:
        notes = read(name).notes
        assert all("repeat one before" in note for note in notes), (name, notes)


def with_false(graph: PoseGraph, kind: dict[str, Any]) -> PoseGraph:
    """The graph and the false edges of one list, by its rule."""
    group = GROUPS[graph.space]
    ends = zip(graph.tail.tolist(), graph.head.tolist(), strict=True)
    step = dict(zip(ends, graph.measured, strict=True))
    tail, head, measured, information = [], [], [], []
    for i, j, source, *count in kind["edges"]:
        z = graph.measured[source]
        for k in range(count[0] if count else 1):
            if k:
                back = group.inverse(step[i + k - 1, i + k])
                z = group.compose(back, group.compose(z, step[j + k - 1, j + k]))
            tail.append(i + k)
            head.append(j + k)
            measured.append(z)
            information.append(graph.information[source])
    return PoseGraph(
        graph.space,
        graph.T_world,
        np.append(graph.tail, tail),
        np.append(graph.head, head),
        np.concatenate([graph.measured, measured]),
        np.concatenate([graph.information, information]),
    )


@pytest.mark.parametrize("loss", ["switchable", "dcs"])
@pytest.mark.parametrize(
    "number", [*range(4), *(pytest.param(k, marks=pytest.mark.slow) for k in range(4, 8))]
)
def test_false_loops_are_all_found_and_no_true_one_is_lost(number: int, loss: str) -> None:
    """From the odometry; then the poses are those of the graph without them, to 1e-4 % of the path."""
    assert FOLDER is not None
    kind = json.loads((FOLDER / "reference_outliers.json").read_text())["sets"][number]
    clean = read(kind["graph"]).graph
    graph = with_false(clean, kind)
    found = solve_graph(graph.at(odometry_start(graph)), loss)
    false = np.arange(graph.sizes[1]) >= clean.sizes[1]
    assert int(false.sum()) == kind["false_edges"]
    assert (found.rejected == false).all()
    assert found.chi2 == pytest.approx(LEAST[kind["graph"]], rel=DIGITS)
    right = solve_graph(clean.at(chordal_start(clean))).graph.T_world
    off = translations(graph.space, found.graph.T_world) - translations(graph.space, right)
    assert float(np.sqrt((off**2).sum(1).mean())) < 1e-6 * kind["path_length"]


def test_covariances_of_a_real_graph() -> None:
    """smallGrid3D: of three poses, against the inverse of the book's dense matrix."""
    graph = solve_graph(read("smallGrid3D.g2o").graph).graph
    inverse = np.linalg.inv(book.dense_normal(graph, graph.T_world).H[6:, 6:])
    for cov, node in zip(marginal_covariances(graph, [1, 60, 124]), (1, 60, 124), strict=True):
        at = slice(6 * node - 6, 6 * node)
        np.testing.assert_allclose(cov, inverse[at, at], rtol=1e-6, atol=1e-9 * cov.max())

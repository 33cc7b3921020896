"""The pose graph of KITTI 00: its loops taken away, and given back; also with a scale that drifts."""

from __future__ import annotations

import time
from functools import cache

import numpy as np
import pytest

from vslam_ref.datasets import catalogue, trajectories
from vslam_ref.datasets.pose_graph_files import read_pose_graph
from vslam_ref.estimation.posegraph import PoseGraph, odometry_start, solve_graph
from vslam_ref.geometry import se3, sim3, so3
from vslam_ref.geometry.alignment import align

GRAPHS, PATHS = catalogue.find("pose_graphs"), catalogue.find("trajectories")
pytestmark = [
    pytest.mark.skipif(
        GRAPHS is None or PATHS is None, reason="pose_graphs or trajectories is not in VSLAM_REF_DATA"
    ),
    pytest.mark.slow,
]
DRIFT = 1.35


@cache
def graph() -> PoseGraph:
    assert GRAPHS is not None
    found = read_pose_graph(GRAPHS / "kitti_00.g2o").graph
    return found.at(odometry_start(found))


@cache
def truth() -> np.ndarray:
    """Places on the ground, (4541, 2)."""
    assert PATHS is not None
    file = trajectories.read(PATHS / "KITTI_00_gt.txt", "kitti")
    return np.asarray(file.trajectory.t_world_body[:, [0, 2]])


def ate(places: np.ndarray, with_scale: bool) -> float:
    """Metres; the frames of graph and truth may be mirrored (one looks down, one up)."""
    mirrored = (places * [1, sign] for sign in (1, -1))
    return min(align(one, truth(), with_scale=with_scale).rmse for one in mirrored)


def lifted(T: np.ndarray) -> np.ndarray:
    """Poses (n, 3) of the plane as poses of space."""
    zero = np.zeros(len(T))
    R = so3.exp(np.stack([zero, zero, T[:, 2]], -1))
    return se3.from_rt(R, np.stack([T[:, 0], T[:, 1], zero], -1))


def drifted() -> tuple[PoseGraph, PoseGraph]:
    """The graph over SE(3) and Sim(3), with the step from keyframe k longer by 1.35^(k / n)."""
    flat = graph()
    n, m = flat.sizes
    unit = DRIFT ** (np.arange(n) / n)
    Z = lifted(flat.measured)
    Z[:, :3, 3] *= unit[flat.tail, None]  # an edge is measured in the unit that the map has at its tail
    ends = flat.loops
    start = [np.eye(4)]
    along = np.argsort(flat.tail[~ends])
    assert (flat.head[~ends][along] == np.arange(1, n)).all()
    for step in Z[~ends][along]:
        start.append(start[-1] @ step)
    S = Z.copy()
    # a loop knows both units; along the odometry a system has no scale
    S[ends, :3, :3] *= (unit[flat.tail[ends]] / unit[flat.head[ends]])[:, None, None]
    graphs = []
    for space, measured, d in (("se3", Z, 6), ("sim3", S, 7)):
        one = np.broadcast_to(np.eye(d), (m, d, d))
        graphs.append(PoseGraph(space, np.array(start), flat.tail, flat.head, measured, one))  # type: ignore[arg-type]
    return graphs[0], graphs[1]


def test_without_its_loops_the_path_drifts_and_with_them_it_does_not() -> None:
    before, found = graph(), solve_graph(graph())
    open_, closed = (ate(g.T_world[:, :2], False) for g in (before, found.graph))
    print(f"ATE {open_:.2f} m without loops, {closed:.2f} m with {int(before.loops.sum())}")
    assert int(before.loops.sum()) == 137
    assert found.chi2 == pytest.approx(98.3221382, rel=1e-7)
    assert closed < 0.15 * open_
    # the chain alone agrees with itself, whatever it measured
    assert solve_graph(before.only(~before.loops)).chi2 < 1e-12


def test_a_scale_that_drifts_needs_loops_in_sim3() -> None:
    """137 loops at once over 4541 poses, identity as information."""
    rigid, similar = drifted()
    open_ = ate(similar.T_world[:, :2, 3], True)
    began = time.thread_time()
    closed = [solve_graph(one) for one in (rigid, similar)]
    in_se3, in_sim3 = (ate(found.graph.T_world[:, :2, 3], True) for found in closed)
    print(
        f"ATE {open_:.2f} m without loops, {in_se3:.2f} m in SE(3), {in_sim3:.2f} m in Sim(3), "
        f"{time.thread_time() - began:.1f} s of CPU"
    )
    assert in_sim3 < 0.2 * open_
    assert in_sim3 < 0.2 * in_se3
    unit = DRIFT ** (np.arange(similar.sizes[0]) / similar.sizes[0])
    found = sim3.scale(closed[1].graph.T_world) * unit
    # what no loop sees, the ends, keeps its drift; the middle comes back
    assert np.std(np.log(found)) < 0.5 * np.std(np.log(unit))

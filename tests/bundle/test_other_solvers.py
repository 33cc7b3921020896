"""Ceres and GTSAM on the same problem: the same minimum, and the same covariances."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.bench.bundle import cost, peers
from vslam_ref.estimation.bundle import BundleProblem, Options, bundle_adjust
from vslam_ref.estimation.bundle.covariance import covariance
from vslam_ref.geometry import se3
from vslam_ref.worlds.view_chain import chain

from .conftest import hold, make


def small() -> BundleProblem:
    problem = chain(6, seed=3)
    keep = problem.seen.point < 300
    return dataclasses.replace(problem, seen=problem.seen.only(keep))


@pytest.mark.parametrize("name", ["scipy", "pyceres", "gtsam"])
def test_same_minimum(name: str) -> None:
    """Relative 2e-5: a long weak valley, which every solver leaves at its own tolerance."""
    if name in peers.missing():
        pytest.skip(f"{name} is not installed (extra `peers`)")
    problem = small()
    build = {"scipy": peers.scipy_cookbook, "pyceres": peers.ceres, "gtsam": peers.gtsam_lm}[name]
    found = build(problem)()
    ours = bundle_adjust(problem, options=Options(cost=1e-10, max_iterations=300))
    assert found.iterations >= 3
    assert ours.cost < 0.01 * ours.initial_cost
    reached = cost(problem, found.scene)
    assert reached == pytest.approx(ours.cost, rel=2e-5 if name != "scipy" else 1e-2)
    assert ours.cost <= reached * (1 + 1e-9)
    assert cost(problem, ours.problem.scene) == pytest.approx(ours.cost, rel=1e-12)


def test_marginals_of_gtsam(rng: np.random.Generator) -> None:
    """Poses and points of a pinhole problem with two held views: 1e-6 of the largest entry.

    GTSAM perturbs T_world_cam from the right, rotation first: T_world_cam Exp(d) is Exp(-d) T_cam_world, so
    its covariance is ours with the halves swapped.
    """
    gtsam = pytest.importorskip("gtsam", reason="gtsam is not installed (extra `peers`)")
    problem, truth = make(rng, views=4, points=10, noise=0.5)
    problem = hold(problem, [0, 3], truth)
    result = bundle_adjust(problem, options=Options(cost=1e-14))
    scene, seen = result.problem.scene, problem.seen
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    fx, fy, cx, cy = scene.intrinsics[0]
    K, noise = gtsam.Cal3_S2(fx, fy, 0.0, cx, cy), gtsam.noiseModel.Isotropic.Sigma(2, 0.5)
    for i, j, uv in zip(seen.view.tolist(), seen.point.tolist(), seen.uv, strict=True):
        graph.add(gtsam.GenericProjectionFactorCal3_S2(uv, noise, i, 100 + j, K))
    for i, pose in enumerate(se3.inverse(scene.T_cam_world)):
        values.insert(i, gtsam.Pose3(pose))
        if i in (0, 3):
            graph.add(gtsam.NonlinearEqualityPose3(i, gtsam.Pose3(pose)))
    for j, X in enumerate(scene.X_world):
        values.insert(100 + j, gtsam.Point3(X))
    marginals = gtsam.Marginals(graph, values)
    found = covariance(result, [1, 2], [0, 7], sigma=0.5)
    assert found.view is not None
    assert found.point is not None
    swap = [3, 4, 5, 0, 1, 2]
    for number, i in enumerate((1, 2)):
        want = marginals.marginalCovariance(i)[np.ix_(swap, swap)]
        assert np.abs(found.view[number] - want).max() < 1e-6 * np.abs(want).max()
    for number, j in enumerate((0, 7)):
        want = marginals.marginalCovariance(100 + j)
        assert np.abs(found.point[number] - want).max() < 1e-6 * np.abs(want).max()

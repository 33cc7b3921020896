"""The loops and the blocks are one algorithm: same scene and cost after every step, and no code in common."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.estimation.bundle import Options, Robust, bundle_adjust
from vslam_ref.estimation.bundle.book import bundle_adjust_book
from vslam_ref.estimation.robust import L2, Huber, Tukey

from .conftest import hold, make

CASES = {
    "pinhole, least squares": ("pinhole", {}, L2()),
    "own lenses, focal and distortion free": (
        "radtan",
        {"sets": 4, "intrinsics": ("f", "k1", "k2", "p1", "p2", "k3")},
        L2(),
    ),
    "one shared lens, all free": ("radtan", {"intrinsics": ("fx", "fy", "cx", "cy", "k1")}, L2()),
    "two lenses for four views": ("pinhole", {"sets": 2, "intrinsics": ("f", "cx")}, L2()),
    "covariances": ("pinhole", {"with_cov": True}, L2()),
    "fov, shared": ("fov", {"intrinsics": ("f", "omega")}, L2()),
    "fisheye": ("fisheye", {}, L2()),
    "Tukey": ("pinhole", {"noise": 2.0}, Tukey(8.0)),
    "Huber with covariances": ("radtan", {"with_cov": True}, Huber(1.0)),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("held", [[], [0], [0, 2]])
def test_same_steps(name: str, held: list[int], rng: np.random.Generator) -> None:
    """Tolerance 1e-7: the damped system has a condition of 1e8 or less, times 1e-16, over 6 steps."""
    model, settings, loss = CASES[name]
    problem, truth = make(rng, model, **settings)
    problem = hold(problem, held, truth)
    fast = bundle_adjust(problem, Robust(loss), Options(max_iterations=6, cost=0.0, gradient=0.0))
    slow = bundle_adjust_book(problem, loss, iterations=len(fast.history))
    costs = [fast.initial_cost] + [step.cost for step in fast.history]
    assert costs == pytest.approx(slow.costs, rel=1e-9)
    assert slow.costs[-1] < 0.6 * slow.costs[0]
    scene = fast.problem.scene
    for got, want in zip(
        (scene.T_cam_world, scene.X_world, scene.intrinsics),
        (slow.scene.T_cam_world, slow.scene.X_world, slow.scene.intrinsics),
        strict=True,
    ):
        assert np.abs(got - want).max() <= 1e-7 * np.abs(want).max()
    assert (scene.T_cam_world[held] == problem.scene.T_cam_world[held]).all()


def test_fixed_points_stay_in_both(rng: np.random.Generator) -> None:
    problem, _ = make(rng)
    free = dataclasses.replace(problem.free, point=np.arange(12) >= 5)
    problem = dataclasses.replace(problem, free=free)
    fast = bundle_adjust(problem, options=Options(max_iterations=4, cost=0.0))
    slow = bundle_adjust_book(problem, iterations=4)
    assert fast.cost == pytest.approx(slow.costs[-1], rel=1e-9)
    assert (fast.problem.scene.X_world[:5] == problem.scene.X_world[:5]).all()
    assert np.abs(fast.problem.scene.X_world - slow.scene.X_world).max() < 1e-7

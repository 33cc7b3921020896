"""The clockwork of the benchmarks, without asserting a time of the library."""

from __future__ import annotations

import inspect
import time
from typing import Any

import numpy as np
import pytest

from vslam_ref.bench import filterpy_peer
from vslam_ref.bench.filters import array_step
from vslam_ref.bench.rows import row
from vslam_ref.support.timing import paired
from vslam_ref.worlds.mapped_vehicle import MappedVehicle


def test_a_ratio_is_that_of_the_things_timed() -> None:
    result = paired({"short": lambda: time.sleep(0.002), "long": lambda: time.sleep(0.02)}, repeats=3)
    assert result.ratio["short"] == 1.0
    # sleeping takes at least its time; a loaded machine adds to both, so only the order is certain
    assert result.ratio["long"] > 1.0
    assert result.seconds["long"] >= 0.02


def test_the_peer_computes_what_we_compute() -> None:
    """The benchmark compares equal work: filterpy's stacked step and ours end in the same state."""
    pytest.importorskip("filterpy", reason="the peer is not installed")
    world = MappedVehicle(10)
    ours, theirs = array_step(world), filterpy_peer.filterpy_step(world, "stacked")
    x_p, x_m, P_pp, P_pm, P_mm = _held(ours, "state")
    kalman = _held(_held(theirs, "predict"), "kalman")
    for _ in range(3):
        ours()
        theirs()
    P = np.block([[P_pp, P_pm], [P_pm.swapaxes(1, 2), P_mm]])
    assert np.allclose(np.concatenate([x_p, x_m], 1)[0], kalman.x, rtol=0, atol=1e-10)
    assert np.allclose(P[0], kalman.P, rtol=0, atol=1e-12)


def _held(function: Any, name: str) -> Any:
    """What a function made by another one holds."""
    return inspect.getclosurevars(function).nonlocals[name]


@pytest.mark.parametrize("i", [0, 1, 2])
def test_the_users_peer_linearises_rightly(i: int) -> None:
    """Central differences of range and bearing with h = 1e-6: rounding is eps |h(x)| / h = 1e-9 at most."""
    x, h = np.random.default_rng(0).normal(size=9), 1e-6
    steps = h * np.eye(9)
    moved = [(filterpy_peer.range_bearing(x + d, i), filterpy_peer.range_bearing(x - d, i)) for d in steps]
    slope = np.transpose([filterpy_peer.polar_residual(a, b) / (2 * h) for a, b in moved])
    assert np.allclose(slope, filterpy_peer.range_bearing_jacobian(x, i), rtol=0, atol=1e-8)


@pytest.mark.parametrize("way", filterpy_peer.WAYS)
def test_every_way_of_the_peer_measures_five_landmarks(way: str) -> None:
    pytest.importorskip("filterpy", reason="the peer is not installed")
    world = MappedVehicle(10)
    step = filterpy_peer.filterpy_step(world, way)
    kalman = _held(_held(step, "predict"), "kalman")
    before = np.diag(kalman.P)[3:].reshape(-1, 2).sum(1)
    step()
    shrunk = np.diag(kalman.P)[3:].reshape(-1, 2).sum(1) < before
    assert shrunk[world.seen].all()


def test_rows_name_goal_bound_and_verdict() -> None:
    assert row("EKF-4", "exponent", "numpy", 2.2, "", 2.1)["met"] == "no"
    assert row("EKF-1", "ratio", "numpy", 2.2, "x", 2.0, below=False)["met"] == "yes"
    assert row("EKF-1", "time", "numpy", 2.2, "µs")["met"] is None

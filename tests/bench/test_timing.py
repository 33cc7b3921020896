"""The clockwork of the benchmarks, without asserting a time of the library."""

from __future__ import annotations

import time

import numpy as np
import pytest

from vslam_ref.bench import filters
from vslam_ref.bench.timing import paired


def test_a_ratio_is_that_of_the_things_timed() -> None:
    result = paired({"short": lambda: time.sleep(0.002), "long": lambda: time.sleep(0.02)}, repeats=3)
    assert result.ratio["short"] == 1.0
    # sleeping takes at least its time; a loaded machine adds to both, so only the order is certain
    assert result.ratio["long"] > 1.0
    assert result.seconds["long"] >= 0.02


def test_the_peer_computes_what_we_compute() -> None:
    """The benchmark compares equal work: filterpy's stacked step and ours end in the same state."""
    pytest.importorskip("filterpy", reason="the peer is not installed")
    world = filters._World(10)
    ours, theirs = filters.array_step(world), filters.filterpy_step(world, stacked=True)
    mine, other = _state(ours), _state(theirs)
    for _ in range(3):
        ours()
        theirs()
    mean, cov = mine.full()
    assert np.allclose(mean[0], other.x, rtol=0, atol=1e-10)
    assert np.allclose(cov[0], other.P, rtol=0, atol=1e-12)


def _state(step: object) -> object:
    """The filter a step works on, from its closure."""
    cells = dict(zip(step.__code__.co_freevars, step.__closure__, strict=True))  # type: ignore[attr-defined]
    return cells["b" if "b" in cells else "kalman"].cell_contents


def test_rows_name_goal_bound_and_verdict() -> None:
    row = filters._row("EKF-4", "exponent", "numpy", 2.2, "", 2.1, below=True)
    assert row["met"] == "no"
    assert filters._row("EKF-1", "ratio", "numpy", 2.2, "x", 2.0, below=False)["met"] == "yes"
    assert filters._row("EKF-1", "time", "numpy", 2.2, "us", None, below=True)["met"] is None

"""The book's lifted and reduced filters, one run in whole matrices, and the two fast ones agree.

Tolerance as in ``test_reduction_theorem``: 60 steps of 47 rounding errors on numbers below 10 are 6e-12.
Every sign of the book that is changed shows by 1e-6, fifty thousand times as much.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vslam_ref.filters.carleman_ekf import LiftedCarlemanEkf, ReducedCarlemanEkf, book

EQUAL, SEEN = 2e-11, 1e-6


def run_book(module: Any, drive: Any, b: int, lifted: bool) -> Any:
    """Run ``b`` of a drive through the book, or through the book with a mistake."""
    belief = (module.start_lifted if lifted else module.start_reduced)(drive.mean[b], drive.cov)
    predict = module.predict_lifted if lifted else module.predict_reduced
    for step in drive.steps:
        belief = predict(belief, *(part[b] for part in step.increment))
        cov_z = np.broadcast_to(drive.cov_z, (len(step.ids), 2, 2))
        belief = module.see(belief, step.ids.tolist(), step.z[b], cov_z, lifted)
    return belief


def off(module: Any, drive: Any, fast: tuple[Any, ...], lifted: bool, runs: int = 1) -> float:
    """Largest difference of what the first runs say; ``fast`` is (mean, cov, pose, map)."""
    worst = 0.0
    for b in range(runs):
        belief = run_book(module, drive, b, lifted)
        mean, cov = module.pose(belief)
        pairs = ((belief.Z, fast[0]), (belief.P, fast[1]), (mean, fast[2].mean), (cov, fast[2].cov))
        worst = max(worst, *(float(np.abs(x - y[b]).max()) for x, y in pairs))
        for at, i in enumerate([] if lifted else fast[3].ids.tolist()):
            pairs = zip(module.composed(belief, i), fast[3][1:], strict=True)
            worst = max(worst, *(float(np.abs(x - y[b, at]).max()) for x, y in pairs))
    return worst


def fast_run(drive: Any, lifted: bool) -> tuple[Any, ...]:
    slam: Any = (LiftedCarlemanEkf if lifted else ReducedCarlemanEkf)(drive.mean, drive.cov)
    drive.feed(slam)
    return *slam.state(), slam.pose(), None if lifted else slam.landmarks(readout="composed")


@pytest.mark.parametrize("lifted", [True, False])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_book_and_the_fast_filter_take_the_same_steps(new_drive: Any, seed: int, lifted: bool) -> None:
    drive = new_drive(seed=seed)
    assert off(book, drive, fast_run(drive, lifted), lifted, runs=2) < EQUAL


def test_the_books_two_filters_are_the_same(new_drive: Any) -> None:
    """11 + 6 n states, reduced, are the 4 + 2 n: the theorem, without the library's fast forms."""
    lifted, reduced = (run_book(book, new_drive(seed=7), 0, lifted) for lifted in (True, False))
    assert reduced.ids == lifted.ids
    twin, poses = book.reduce(lifted), zip(book.pose(lifted), book.pose(reduced), strict=True)
    for x, y in (*poses, (twin.Z, reduced.Z), (twin.P, reduced.P)):
        assert np.abs(x - y).max() < EQUAL


def test_every_changed_sign_shows(new_drive: Any, flips: Any) -> None:
    drive = new_drive(batch=1, steps=30)
    fast = {lifted: fast_run(drive, lifted) for lifted in (True, False)}
    missed, tried = [], 0
    for line, module in flips(book):
        tried += 1
        try:
            seen = any(off(module, drive, fast[lifted], lifted) > SEEN for lifted in fast)
        except (ValueError, IndexError, TypeError, np.linalg.LinAlgError):
            continue  # shapes that do not fit: it shows
        missed += [] if seen else [line]
    assert tried > 80
    assert not missed


@pytest.mark.parametrize("make", [LiftedCarlemanEkf, ReducedCarlemanEkf])
@pytest.mark.parametrize("control", ["first_order", "gaussian"])
def test_innovation_can_be_asked_before_the_update(drive: Any, make: Any, control: str) -> None:
    """What the update would see; the twin that is never asked ends at the same place."""
    slam, unasked = (make(drive.mean, drive.cov, control=control) for _ in range(2))
    compared = 0
    for step in drive.steps:
        slam.predict(step.increment)
        if len(step.ids):
            asked = slam.innovation(step.ids, step.z, drive.cov_z)
            seen = slam.update(step.ids, step.z, drive.cov_z)
            assert (asked is None) == (seen is None)
            if seen is not None:
                compared += 1
                assert all(np.abs(a - b).max() < EQUAL for a, b in zip(asked, seen, strict=True))
    drive.feed(unasked)
    assert compared > 3
    for a, b in zip((*slam.state(), *slam.pose()), (*unasked.state(), *unasked.pose()), strict=True):
        assert np.abs(a - b).max() < EQUAL

"""What drifts in B's filter is the length of its heading vector h = (z3, z4), and why.

**Measured** (standard field, first-order control noise): |h| goes from 1 (0.9995 with a Gaussian start at
low P0) to 1.022 in two laps, above 1 in every run.  z5 + z6 stays 1 to rounding.

**Mechanism.**  Call E = |h|^2 + var z3 + var z4, the second moment of the heading vector as the filter
believes it.  For a real heading it is 1.

* A prediction turns h and leaves |h| alone; the first-order noise is *tangent* and adds v |h|^2 to the
  variances, v the variance of the turn.  E grows by v |h|^2.  A true rotation by a noisy angle would keep
  E: the mean should shrink by e^{-v/2}, and first order forgets that.
* An update moves variance into the mean: h <- h + K nu, the variances fall by tr K S K^T, and
  E |K nu|^2 = tr K S K^T.  With innovations as the filter expects them, E is kept in the mean.

So per lap sum(v) = 0.034 enters, and since measurements keep the variances small, it ends up in |h|^2:
1.016^2 = 1 + 0.033 after lap 1.  In lap 2 the loop closes and the innovations are no longer those expected
(landmarks out of sight were turned without shrinking, too): 2 h . K nu is negative on average and takes
a third back.  With **exact Gaussian moments** the mean shrinks as it should, E stays 1 (but for v var, of
second order) and |h| does not drift: the cure, and the test of this explanation.

Statistics: means over independent runs, 5 standard errors (false alarm 6e-7 each, were the mean Gaussian).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

from vslam_ref.filters.carleman_ekf import LiftedCarlemanEkf, ReducedCarlemanEkf

LOW = (1.0, 1.0, 0.001)
EPS = float(np.finfo(np.float64).eps)
RUNS = 40
LAP = 800


class Budget(NamedTuple):
    """Per run at the end of each lap: |h|^2, variances, sum of v |h|^2, sum of 2 h . K nu: (laps, B)."""

    length: np.ndarray
    variance: np.ndarray
    supply: np.ndarray
    pull: np.ndarray


def budget(field: Any, control: str) -> Budget:
    world = field(laps=2, runs=RUNS)
    rows: list[list[np.ndarray]] = [[], [], [], []]
    supply, pull, last = np.zeros(RUNS), np.zeros(RUNS), np.zeros((RUNS, 2))

    def look(slam: Any, k: int, what: str) -> None:
        h = slam.blocks.x_p[:, 2:].copy()
        if what == "predicted":
            supply[:] += world.increments[k - 1].cov[:, 1, 1] * (h**2).sum(1)
            last[:] = h
            if k % LAP:
                return
        elif k:
            pull[:] += 2 * (last * (h - last)).sum(1)
        if what == "updated" and k and k % LAP == 0:
            variance = slam.blocks.P_pp[:, 2, 2] + slam.blocks.P_pp[:, 3, 3]
            for row, value in zip(rows, ((h**2).sum(1), variance, supply, pull), strict=True):
                row.append(value.copy())

    world.run(lambda mean, cov: ReducedCarlemanEkf(mean, cov, control=control), LOW, look)
    return Budget(*(np.array(row) for row in rows))


@pytest.fixture(scope="module")
def first_order(field: Any) -> Budget:
    return budget(field, "first_order")


@pytest.fixture(scope="module")
def gaussian(field: Any) -> Budget:
    return budget(field, "gaussian")


def errors_from_zero(values: np.ndarray) -> float:
    """Mean over runs in standard errors."""
    return float(values.mean() / (values.std(ddof=1) / np.sqrt(len(values))))


def test_heading_vector_grows_in_every_run(first_order: Budget) -> None:
    length = np.sqrt(first_order.length[1])
    assert (length > 1).all()
    assert 1.018 < length.mean() < 1.026
    # the variances say 1 - |h|^2 = +0.001: no random variable has such moments
    assert (1 - first_order.length[1] < 0).all()
    assert (first_order.variance[1] > 0).all()


def test_first_lap_gains_what_the_tangent_noise_supplies(first_order: Budget) -> None:
    gained = first_order.length[0] + first_order.variance[0] - (1 + LOW[2])
    assert 0.03 < first_order.supply[0].mean() < 0.04
    assert abs(errors_from_zero(gained - first_order.supply[0])) < 5
    assert errors_from_zero(gained) > 10  # and the gain is no accident


def test_loop_closure_takes_a_part_back(first_order: Budget) -> None:
    """The only term with a mean besides the supply: innovations of lap 2 lean against h."""
    kept = first_order.length[1] + first_order.variance[1] - (1 + LOW[2])
    assert errors_from_zero(first_order.pull[1]) < -5
    assert abs(errors_from_zero(kept - first_order.supply[1] - first_order.pull[1])) < 5
    share = -first_order.pull[1].mean() / first_order.supply[1].mean()
    assert 0.2 < share < 0.5


def test_exact_moments_do_not_drift(gaussian: Budget) -> None:
    # a first-order start puts P0 = 0.001 on top of |h| = 1: that much stays
    for lap in range(2):
        assert abs(errors_from_zero(gaussian.length[lap] + gaussian.variance[lap] - (1 + LOW[2]))) < 5
        assert abs(errors_from_zero(gaussian.pull[lap])) < 5
    assert abs(np.sqrt(gaussian.length[1]).mean() - 1) < 0.002


@pytest.mark.parametrize("control", ["first_order", "gaussian"])
def test_what_one_prediction_does_to_the_second_moment(control: str, new_drive: Any) -> None:
    """Exactly: first order adds v |h|^2 and keeps |h|; exact moments keep E."""
    drive = new_drive()
    slam = LiftedCarlemanEkf(drive.mean, drive.cov, control=control)
    drive.feed(slam)
    step = drive.steps[0].increment

    def moment() -> tuple[np.ndarray, np.ndarray]:
        z, P = slam.state()
        return (z[:, 2:4] ** 2).sum(1), P[:, 2, 2] + P[:, 3, 3]

    (length, variance), _ = moment(), slam.predict(step)
    length_1, variance_1 = moment()
    v = step.cov[:, 1, 1]
    if control == "first_order":
        assert np.abs(length_1 - length).max() < 16 * EPS
        assert np.abs(variance_1 - variance - v * length).max() < 64 * EPS
    else:
        # E[h h] of a true rotation by noise: |h|^2 shrinks to e^{-v}, the rest is variance; what the
        # prior variance would lose to the shrunk mean rotation has no noise of its own in a Kalman filter
        assert np.abs(length_1 - np.exp(-v) * length).max() < 16 * EPS
        lost = variance * -np.expm1(-v)
        assert np.abs(length_1 + variance_1 - (length + variance - lost)).max() < 64 * EPS


def test_w_stays_one_while_the_heading_drifts(field: Any) -> None:
    """A check of z5 + z6 cannot fail: M(U) keeps it whatever |h| does.  One lap, two runs, lifted form."""
    world = field(laps=1, runs=2)
    seen: dict[str, np.ndarray] = {}

    def look(slam: Any, k: int, what: str) -> None:
        seen["z"] = slam._z[:, :11]
        # rows 5 and 6 of B16 have three terms each; a step is off by a few eps at most
        assert np.abs(seen["z"][:, 4] + seen["z"][:, 5] - 1).max() <= 10 * EPS * max(k, 1)

    world.run(lambda mean, cov: LiftedCarlemanEkf(mean, cov, capacity=30), LOW, look)
    assert np.abs(np.hypot(seen["z"][:, 2], seen["z"][:, 3]) - 1).max() > 1e-3

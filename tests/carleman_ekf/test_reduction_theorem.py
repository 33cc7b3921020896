"""Lifted, reduced and literal filters: the same pose, covariance, innovations, S and r_i.

The literal filter (conftest) is the oracle: 5 + 2 n textbook matrices, control moments by numeric
differentiation or by quadrature.  It shares no line with the package.

Tolerance: one step gathers about D = 47 rounding errors per entry on numbers below 10 (the metres of
the drive), 60 steps: 60 * 47 * 2.2e-16 * 10 = 6e-12, and as much again for the numeric control moments
(1e-13 each, 60 times).  ``EQUAL`` = 2e-11 covers both; what breaks a condition is told from it by a
factor of at least 1000, ``BROKEN`` = 2e-8.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from vslam_ref.filters.carleman_ekf import LiftedCarlemanEkf, ReducedCarlemanEkf, carleman_ekf, moments
from vslam_ref.filters.carleman_ekf.lift import Variant

EQUAL, BROKEN = 2e-11, 2e-8
KINDS = ("first_order", "gaussian")


def off_by(found: np.ndarray, expected: np.ndarray) -> float:
    """Largest difference, for numbers above 10 relative to them: ``EQUAL`` is derived for 10."""
    return float(np.abs(found - expected).max() / max(1.0, np.abs(expected).max() / 10.0))


def compare_with_literal(slam: Any, drive: Any, literals: list[Any]) -> float:
    """Feed both; the largest difference of pose states, innovations, S, and all r_i at the end."""
    worst = 0.0
    for step in drive.steps:
        slam.predict(step.increment)
        for b, one in enumerate(literals):
            one.predict(*(part[b] for part in step.increment))
        if not len(step.ids):
            continue
        seen = slam.update(step.ids, step.z, drive.cov_z)
        for b, one in enumerate(literals):
            other = one.update(step.ids.tolist(), step.z[b], drive.cov_z)
            if seen is not None and other is not None:
                # known landmarks keep the order of the sighting in every form
                worst = max(worst, off_by(seen.innovation[b], other[0]), off_by(seen.S[b], other[1]))
    ids, zero = drive.every_landmark()
    last = slam.update(ids, zero, drive.cov_z)
    for b, one in enumerate(literals):
        expected = one.update(ids.tolist(), zero[b], drive.cov_z)
        worst = max(worst, off_by(last.innovation[b], expected[0]), off_by(last.S[b], expected[1]))
        pose, x = slam.pose(), one.x
        J = np.zeros((3, len(x)))
        J[0, 0] = J[1, 1] = 1.0
        J[2, 2:4] = np.array([x[3], -x[2]]) / (x[2] ** 2 + x[3] ** 2)
        worst = max(worst, off_by(pose.mean[b], np.array([x[0], x[1], np.arctan2(x[2], x[3])])))
        # the heading's row of J grows as its vector (s, c) gets shorter than 1, and the errors with it
        worst = max(worst, off_by(pose.cov[b], J @ one.P @ J.T) / max(1.0, np.linalg.norm(J[2]) ** 2))
    return float(worst)


def literals_for(
    literal: Callable[..., Any], drive: Any, start: str, control: Any, **options: Any
) -> list[Any]:
    P0 = np.broadcast_to(drive.cov, (len(drive.mean), 3, 3))
    z, P = moments.lifted_start(drive.mean, P0, start)
    return [literal(z[b], P[b], control, **options) for b in range(len(z))]


@pytest.mark.parametrize("control", KINDS)
@pytest.mark.parametrize("start", KINDS)
@pytest.mark.parametrize("form", ["lifted", "reduced", "reduced-map"])
def test_every_form_is_the_literal_filter(
    literal: Any, drive: Any, form: str, start: str, control: str
) -> None:
    slam = carleman_ekf(drive.mean, drive.cov, form, capacity=2, start=start, control=control)
    assert compare_with_literal(slam, drive, literals_for(literal, drive, start, control)) < EQUAL


@pytest.mark.parametrize("start", KINDS)
def test_the_map_of_reduced_map_is_the_lifted_one(drive: Any, start: str) -> None:
    forms = [carleman_ekf(drive.mean, drive.cov, form, start=start) for form in ("lifted", "reduced-map")]
    for slam in forms:
        drive.feed(slam)
    a, b = (slam.landmarks() for slam in forms)
    assert a.ids.tolist() == b.ids.tolist()
    assert np.abs(a.mean - b.mean).max() < EQUAL
    assert np.abs(a.cov - b.cov).max() < EQUAL


def test_the_map_is_not_the_composition_of_reduced_states(drive: Any) -> None:
    """p + h r_i, all that 4 + 2 n states can offer, is another map: zi1, zi2 are no rows of T."""
    lifted = LiftedCarlemanEkf(drive.mean, drive.cov)
    drive.feed(lifted)
    z, _ = lifted.state()
    r = lifted.update(*drive.every_landmark(), drive.cov_z)
    ids = drive.every_landmark()[0]
    order = [lifted.landmarks().ids.tolist().index(i) for i in ids]
    h, place = z[:, 3] + 1j * z[:, 2], z[:, 0] + 1j * z[:, 1]
    seen = -r.innovation.reshape(len(z), -1, 2)
    composed = place[:, None] + h[:, None] * (seen[..., 0] + 1j * seen[..., 1])
    own = z[:, 11::6] + 1j * z[:, 12::6]
    assert np.abs(own[:, order] - composed).max() > 1e-3
    with pytest.raises(ValueError, match="carries no map"):
        ReducedCarlemanEkf(drive.mean, drive.cov).landmarks()


# --- the conditions, each broken -----------------------------------------------------------------------


def product_moments(ds: float, dalpha: float, cov: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gaussian moments with products of means in the quadratic monomials: |E[u]| < 1."""
    increment = moments.Increment(np.array([ds]), np.array([dalpha]), cov[None])
    w = moments.control_moments(increment, "gaussian", product_of_means=True)
    return w.mean[0, 1:], w.factor[0] @ w.factor[0].T


@pytest.mark.parametrize(("keep_w", "equal"), [(True, True), (False, False)])
def test_w_is_needed_when_the_mean_control_leaves_the_circle(
    literal: Any, drive: Any, keep_w: bool, equal: bool
) -> None:
    slam = LiftedCarlemanEkf(
        drive.mean, drive.cov, control="gaussian", variant=Variant(product_of_means=True)
    )
    off = compare_with_literal(
        slam, drive, literals_for(literal, drive, "first_order", product_moments, keep_w=keep_w)
    )
    assert off < EQUAL if equal else off > BROKEN


@pytest.mark.parametrize(("keep_w", "equal"), [(True, True), (False, False)])
def test_w_is_needed_when_the_noise_leaves_the_circle(
    literal: Any, drive: Any, monkeypatch: Any, keep_w: bool, equal: bool
) -> None:
    """A diagonal Q_U on (u1, u2, u3), which is what B10's notation suggests, has a radial part."""

    def diagonal(ds: float, dalpha: float, cov: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u1, u2, u3 = ds, np.sin(dalpha), np.cos(dalpha)
        D = np.zeros((8, 3))
        D[range(3), range(3)] = 1.0
        D[3, 1], D[4], D[5, 2] = 2 * u2, [0, u3, u2], 2 * u3
        D[6], D[7] = [u2, u1, 0], [u3, 0, u1]
        v = np.array([u1, u2, u3, u2 * u2, u2 * u3, u3 * u3, u1 * u2, u1 * u3])
        return v, D @ np.diag([cov[0, 0], cov[1, 1], cov[1, 1]]) @ D.T

    def patched(increment: Any, kind: str, product_of_means: bool = False) -> moments.ControlMoments:
        both = [diagonal(*(part[b] for part in increment)) for b in range(len(increment.ds))]
        values = [np.linalg.eigh(C) for _, C in both]
        factor = np.stack([vectors * np.sqrt(np.maximum(e, 0)) for e, vectors in values])
        return moments.ControlMoments(np.stack([np.concatenate([[1.0], v]) for v, _ in both]), factor)

    monkeypatch.setattr(moments, "control_moments", patched)
    slam = LiftedCarlemanEkf(drive.mean, drive.cov)
    off = compare_with_literal(
        slam, drive, literals_for(literal, drive, "first_order", diagonal, keep_w=keep_w)
    )
    assert off < EQUAL if equal else off > BROKEN


def test_start_must_be_the_reduction_of_the_lifted_start(literal: Any, drive: Any) -> None:
    slam = LiftedCarlemanEkf(drive.mean, drive.cov, start="gaussian")
    assert (
        compare_with_literal(slam, drive, literals_for(literal, drive, "first_order", "first_order")) > BROKEN
    )


def test_late_landmarks_enter_as_w_times_the_measurement(literal: Any, drive: Any) -> None:
    """With w = 1 the factor cannot be seen; off the circle r_new = z without it is another filter."""
    slam = LiftedCarlemanEkf(
        drive.mean, drive.cov, control="gaussian", variant=Variant(product_of_means=True)
    )
    wrong = literals_for(literal, drive, "first_order", product_moments)
    for one in wrong:
        one.new_landmark_scale = lambda: 1.0
    assert compare_with_literal(slam, drive, wrong) > BROKEN

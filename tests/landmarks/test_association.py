"""Gates, look-alikes, and beams that go through what was a landmark."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.geometry import se2
from vslam_ref.grids import Scan
from vslam_ref.grids.landmarks import (
    LandmarkConfig,
    Signature,
    associate,
    gate,
    look_alike,
    seen_through,
)
from vslam_ref.grids.landmarks.association import AMBIGUOUS, GATE, NONE


def test_the_gate_holds_99_percent() -> None:
    """Exact: chi^2 with two degrees has the tail exp(-x/2). And drawn: 20000, four standard errors."""
    assert np.exp(-GATE / 2) == pytest.approx(0.01, rel=1e-12)
    rng = np.random.default_rng(1)
    S = np.array([[4.0, 1.5], [1.5, 1.0]])
    v = rng.multivariate_normal([0, 0], S, 20_000)
    inside = (gate(v, S) <= GATE).mean()
    assert abs(inside - 0.99) < 4 * np.sqrt(0.99 * 0.01 / 20_000)
    np.testing.assert_allclose(gate(v[:5], S), np.einsum("ni,ij,nj->n", v[:5], np.linalg.inv(S), v[:5]))


def one(x: list[list[list[float]]], alike: list[list[bool]] | None = None) -> list[int]:
    innovation = np.array(x)
    shape = innovation.shape[:2]
    S = np.broadcast_to(np.eye(2), (*shape, 2, 2))
    return associate(innovation, S, np.ones(shape, bool) if alike is None else alike).landmark.tolist()


def test_what_nobody_claims_what_two_claim_and_what_is_contested() -> None:
    far, near = [9.0, 0.0], [0.5, 0.0]
    assert one([[far, far]]) == [NONE]
    assert one([[far, near]]) == [1]
    assert one([[near, near]]) == [AMBIGUOUS], "two look-alikes in one gate: the position cannot tell"
    assert one([[near, far], [near, far]]) == [AMBIGUOUS, AMBIGUOUS], "two corners, one landmark"
    assert one([[near, far], [far, near]]) == [0, 1]
    assert one([[near, near]], [[True, False]]) == [0], "another kind of corner is no rival"


def test_a_better_position_makes_the_same_pair_clear() -> None:
    """A4.4: the camera's position resolves look-alikes. Two landmarks 0.6 m apart; only S differs."""
    innovation = np.array([[[0.02, 0.0], [0.6, 0.0]]])
    for sigma, expected in ((0.3, AMBIGUOUS), (0.05, 0)):
        S = np.broadcast_to(sigma**2 * np.eye(2), (1, 2, 2, 2))
        assert associate(innovation, S, [[True, True]]).landmark[0] == expected


def test_look_alikes_agree_in_kind_and_direction_across_the_cut() -> None:
    a = Signature(np.array([np.pi - 0.1]), np.array([np.pi / 2]), np.array([True]))
    b = Signature(
        np.array([-np.pi + 0.1, 0.0, np.pi - 0.1, np.pi]),
        np.array([1.5, 1.5, 1.5, 2.4]),
        np.array([True, True, False, True]),
    )
    np.testing.assert_array_equal(look_alike(a, b), [[True, False, False, False]])


BEAMS = np.deg2rad(np.arange(-90.0, 90.5, 0.5))
POSE = np.array([1.0, 2.0, 0.6])


def corner_ahead(distance: float = 3.0) -> tuple[np.ndarray, np.ndarray]:
    """A corner straight ahead whose arms run to both sides, away from the laser."""
    place = se2.act(POSE, [[distance, 0.0]])
    return place, np.array([[POSE[2] + 0.8, POSE[2] - 0.8]])


@pytest.mark.parametrize(
    ("left", "right", "expected"),
    [
        (5.0, 5.0, True),  # the wall behind: gone
        (3.05, 3.05, False),  # still there
        (1.5, 1.5, False),  # somebody in front: no evidence
        (5.0, 1.5, False),  # one arm is hidden
        (5.0, 3.1, False),  # one arm is still there
        (np.nan, np.nan, False),  # no reading
        (np.inf, np.inf, True),  # nothing within the maximum range
    ],
)
def test_only_beams_behind_both_arms_prove_that_it_left(left: float, right: float, expected: bool) -> None:
    place, arms = corner_ahead()
    ranges = np.where(BEAMS > 0, left, right)
    if np.isinf(left):
        ranges = np.full(len(BEAMS), 9.0)  # a reading at the maximum range
    assert seen_through(POSE, place, arms, Scan(BEAMS, ranges, 10.0, 0.0), beyond=0.25).tolist() == [expected]


def test_what_is_outside_of_the_view_is_not_seen_through() -> None:
    place = se2.act(POSE, [[-3.0, 0.0]])
    assert not seen_through(
        POSE, place, [[0.0, 1.0]], Scan(BEAMS, np.full(len(BEAMS), 9.0), 10.0, 0.0), 0.25
    ).any()


@pytest.mark.parametrize(
    ("setting", "words"),
    [({"confirm": 0}, "at least 1"), ({"arms": 0.2}, "arms_left"), ({"same": 0.0}, "> 0")],
)
def test_rules_that_mean_nothing_are_refused(setting: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        LandmarkConfig(**setting)  # type: ignore[arg-type]

"""Exercise 4.1: weight, scale and place, each with the mistakes that are usually made."""

from __future__ import annotations

import math
from types import ModuleType

import numpy as np
import pytest

EXERCISE = "04_robust_place"


def test_the_weight_is_tukeys(answer: ModuleType) -> None:
    r = np.array([0.0, 1.0, 2.0, 3.0, 50.0])
    found = np.asarray(answer.weight(r.copy(), 2.0), dtype=float)
    if np.allclose(found, [1.0, 0.75, 0.0, 0.0, 0.0]):
        pytest.fail(
            "this is the root of the weight; it multiplies a residual, the weight multiplies its square"
        )
    if np.allclose(found[:3], [0.0, 0.5625, 0.0]):
        pytest.fail("this is the influence; divide it by the error to get the weight")
    if found[3] > 0.0:
        pytest.fail("beyond c the formula rises again: the weight must be 0 there")
    np.testing.assert_allclose(found, [1.0, 0.5625, 0.0, 0.0, 0.0], err_msg="(1 - r²/c²)² inside c")


def test_the_scale_is_that_of_one_coordinate(answer: ModuleType) -> None:
    rng = np.random.default_rng(1)
    r = 3.0 * np.linalg.norm(rng.standard_normal((20001, 2)), axis=1)
    found = answer.scale(r.copy())
    if abs(found / 3.0 - 1.7456) < 0.05:
        pytest.fail(
            "1.7 times too wide: 1.4826 is the constant of scalars; a norm has the median sqrt(2 ln 2)"
        )
    if abs(found / 3.0 - math.sqrt(2)) < 0.05:
        pytest.fail("this is the root mean square of the norm, sqrt(2) times that of one coordinate")
    # standard deviation of the median, 0.72 / sqrt(n); 4 of them
    assert found == pytest.approx(3.0, rel=4 * 0.72 / math.sqrt(len(r)))


def test_wrong_points_do_not_move_the_scale(answer: ModuleType) -> None:
    rng = np.random.default_rng(2)
    r = np.linalg.norm(rng.standard_normal((1000, 2)), axis=1)
    r[:300] = 1e9
    assert answer.scale(r) < 2.0, "three in ten are wrong and far away; a mean of squares believes them"


def test_one_point_has_no_scale(answer: ModuleType) -> None:
    assert answer.scale(np.array([0.0])) == math.inf, "one point: nothing is redundant, the scale is unknown"


def scattered(rng: np.random.Generator, n: int, share: float, where: float) -> np.ndarray:
    points = np.array([7.0, -2.0]) + rng.standard_normal((n, 2))
    points[: int(share * n)] += [where, where / 2]
    return points


@pytest.mark.parametrize("where", [30.0, 1e3, 1e8])
@pytest.mark.parametrize("share", [0.01, 0.2, 0.39])
def test_wrong_points_do_not_move_the_place(answer: ModuleType, share: float, where: float) -> None:
    rng = np.random.default_rng(3)
    points = scattered(rng, 400, share, where)
    found = np.asarray(answer.place(points.copy()), dtype=float)
    honest = points[int(share * 400) :].mean(axis=0)
    told = f"{share:.0%} of the points lie {where:g} away: the place is off by {found - honest}"
    if not np.abs(found - honest).max() < 0.1:
        pytest.fail(told + "; do scale or weights believe the wrong points, or is the loop over too soon?")


def test_it_turns_with_the_axes(answer: ModuleType) -> None:
    points = scattered(np.random.default_rng(4), 60, 0.3, 12.0)
    angle = 0.7
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    direct, turned = answer.place(points.copy()), answer.place(points @ turn.T)
    # coordinate-wise medians, the usual start, do not turn with the axes; the minimum does
    np.testing.assert_allclose(
        turn @ direct, turned, atol=1e-3, err_msg="turned points give another place: weights belong to norms"
    )


def test_it_moves_and_grows_with_the_points(answer: ModuleType) -> None:
    points = scattered(np.random.default_rng(5), 50, 0.2, 40.0)
    found = answer.place(points.copy())
    np.testing.assert_allclose(answer.place(points + 1e3), found + 1e3, atol=1e-6)
    told = "the same points in millimetres give another place: is there a constant in metres?"
    np.testing.assert_allclose(answer.place(1e3 * points), 1e3 * found, rtol=1e-6, err_msg=told)


def test_it_is_95_percent_efficient(answer: ModuleType) -> None:
    """Variance over that of the mean, in 600 coordinates: known to 0.003, by pairing with the mean."""
    rng = np.random.default_rng(6)
    off, mean = [], []
    for _ in range(300):
        points = rng.standard_normal((200, 2))
        off.append(answer.place(points))
        mean.append(points.mean(axis=0))
    # robust minus mean is nearly independent of the mean: var = var(mean) (1 + (1 - eta) / eta)
    lost = np.mean((np.array(off) - mean) ** 2) * 200
    eta = 1 / (1 + lost)
    if eta > 0.985:
        pytest.fail(f"efficiency {eta:.3f}: too careful; scalar constants on norms cut at 8.2 sigma")
    if 0.915 < eta < 0.939:
        pytest.fail(
            f"efficiency {eta:.3f}: 4.6851 is the constant of scalars; norms of plane errors want 5.1230"
        )
    assert eta == pytest.approx(0.95, abs=0.011)


def test_few_points_and_equal_points(answer: ModuleType) -> None:
    one = np.array([[3.0, 4.0]])
    np.testing.assert_allclose(answer.place(one), [3.0, 4.0], err_msg="one point: it is the place")
    same = np.array([[1.0, 2.0]] * 5 + [[50.0, 60.0]])
    found = np.asarray(answer.place(same), dtype=float)
    assert np.isfinite(found).all(), (
        "more than half of the points are the same: the scale is 0, and 0/0 is NaN"
    )
    np.testing.assert_allclose(found, [1.0, 2.0])

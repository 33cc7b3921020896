"""Pairs in time: nearest, near enough, each pose once."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vslam_ref.metrics.trajectory import associate

# whole milliseconds, so that ties and limits are met often; a multiple of 2^-10 s is exact
TIMES = st.lists(st.integers(0, 60), min_size=1, max_size=12).map(lambda t: np.sort(t) / 1024)
LIMIT = 8 / 1024


def by_hand(a: np.ndarray, b: np.ndarray, limit: float) -> list[tuple[int, int]]:
    """The rule, read aloud: a has no more poses than b."""
    chosen = [int(np.argmin(np.abs(b - time))) for time in a]  # argmin takes the first, the earlier
    pairs = []
    for j in sorted(set(chosen)):
        rivals = [i for i, c in enumerate(chosen) if c == j and abs(b[j] - a[i]) <= limit]
        if rivals:
            pairs.append((min(rivals, key=lambda i: (abs(b[j] - a[i]), i)), j))
    return sorted(pairs)


@given(TIMES, TIMES)
def test_pairs_follow_the_rule(a: np.ndarray, b: np.ndarray) -> None:
    got = associate(a, b, LIMIT)
    pairs = list(zip(got.estimate.tolist(), got.truth.tolist(), strict=True))
    if len(a) <= len(b):
        assert pairs == by_hand(a, b, LIMIT)
    else:
        assert pairs == sorted((i, j) for j, i in by_hand(b, a, LIMIT))


@given(TIMES, TIMES)
def test_pairs_are_one_to_one_in_order_and_near(a: np.ndarray, b: np.ndarray) -> None:
    got = associate(a, b, LIMIT)
    assert len(got.estimate) == len(got.truth)
    assert (np.diff(got.estimate) > 0).all()
    assert (np.diff(got.truth) > 0).all()
    assert (np.abs(a[got.estimate] - b[got.truth]) <= LIMIT).all()


@given(TIMES, TIMES)
def test_no_two_that_are_left_could_be_paired_better_than_those_that_are(
    a: np.ndarray, b: np.ndarray
) -> None:
    """A pose of the shorter that is left has no free partner that is its nearest."""
    if len(a) > len(b):
        a, b = b, a
    got = associate(a, b, LIMIT)
    free_a = set(range(len(a))) - set(got.estimate.tolist())
    free_b = set(range(len(b))) - set(got.truth.tolist())
    for i, j in itertools.product(free_a, free_b):
        nearest = int(np.argmin(np.abs(b - a[i])))
        assert nearest != j or abs(b[j] - a[i]) > LIMIT


def test_the_nearest_of_several_keeps_a_pose() -> None:
    got = associate([0.0, 0.003, 0.006], [0.004, 5.0, 6.0, 7.0])
    assert (got.estimate.tolist(), got.truth.tolist()) == ([1], [0])


def test_the_limit_itself_counts() -> None:
    assert len(associate([0.0], [0.01]).truth) == 1
    assert len(associate([0.0], [0.0100001]).truth) == 0


def test_without_overlap_there_are_no_pairs() -> None:
    assert len(associate([0.0, 1.0], [5.0, 6.0, 7.0]).estimate) == 0


@pytest.mark.parametrize(
    ("a", "b", "limit", "words"),
    [
        ([], [1.0], 0.01, r"times_estimate \(0,\): need \(N,\)"),
        ([1.0], [np.nan], 0.01, "times_truth .* finite"),
        ([2.0, 1.0], [1.0], 0.01, "times_estimate must not fall: 1.0 at 1 after 2.0"),
        ([1.0], [1.0], -1.0, "max_difference is -1 s"),
        ([1.0], [1.0], np.nan, "max_difference is nan s"),
    ],
)
def test_wrong_times_are_told(a: list[float], b: list[float], limit: float, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        associate(a, b, limit)

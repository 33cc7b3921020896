"""Pairs under common nodes: by brute force, mutual, by far the nearest; turns by a histogram."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.features.vocabulary import Matching, match, turned_alike


def brute(
    a: np.ndarray, b: np.ndarray, node_a: np.ndarray, node_b: np.ndarray, how: Matching
) -> list[tuple[int, int]]:
    d = np.unpackbits(a[:, None] ^ b, axis=-1).sum(-1).astype(float)
    d[node_a[:, None] != node_b] = np.inf
    pairs = []
    for i in range(len(a)):
        j = int(np.argmin(d[i]))
        rest = np.delete(d[i], j).min(initial=np.inf)
        if d[i, j] <= how.limit and d[i, j] < how.ratio * rest and int(np.argmin(d[:, j])) == i:
            pairs.append((i, j))
    return pairs


@pytest.mark.parametrize("nodes", [1, 4])
def test_pairs_are_those_of_brute_force(nodes: int) -> None:
    rng = np.random.default_rng(nodes)
    a = rng.integers(0, 256, (60, 32), dtype=np.uint8)
    b = np.concatenate([a[rng.permutation(60)[:40]], rng.integers(0, 256, (30, 32), dtype=np.uint8)])
    b ^= (rng.random(b.shape) < 0.2) * rng.integers(0, 256, b.shape, dtype=np.uint8)
    node_a, node_b = rng.integers(0, nodes, 60), rng.integers(0, nodes, 70)
    how = Matching(ratio=0.8, limit=100)
    found = match(a, b, node_a, node_b, how)
    expected = brute(a, b, node_a, node_b, how)
    assert len(expected) > 5
    assert list(zip(found.first.tolist(), found.second.tolist(), strict=True)) == expected
    bits = np.unpackbits(a[found.first] ^ b[found.second], axis=1).sum(1)
    assert found.distance.tolist() == bits.tolist()


def test_no_common_node_no_pair() -> None:
    a = np.zeros((3, 32), np.uint8)
    assert len(match(a, a, np.array([1, 1, 1]), np.array([2, 2, 2])).first) == 0
    assert len(match(a[:0], a, np.array([], int), np.array([2, 2, 2])).first) == 0
    with pytest.raises(ValueError, match="nodes"):
        match(a, a, np.array([1, 1]), np.array([2, 2, 2]))


def test_of_two_that_want_the_same_the_nearer_one_gets_it() -> None:
    a, b = (np.repeat(np.array(rows, np.uint8), 32, axis=1) for rows in ([[1], [3]], [[1], [255]]))
    zero = np.zeros(2, np.int64)
    found = match(a, b, zero, zero)
    assert (found.first.tolist(), found.second.tolist()) == ([0], [0])


def test_turns_that_differ_from_most_are_left_out() -> None:
    """Sixty pairs turn by 1.0 +- 0.05 radians: within two bins of 12 degrees; ten turn anyhow."""
    rng = np.random.default_rng(0)
    first = rng.uniform(-np.pi, np.pi, 70)
    turn = np.concatenate([rng.uniform(0.95, 1.05, 60), np.linspace(1.5, 6.5, 10)])
    second = (first + turn + np.pi) % (2 * np.pi) - np.pi
    kept = turned_alike(first, second)
    assert kept[:60].all()
    assert kept[60:].sum() <= 2  # the third bin is one of those with a single pair or two


def test_a_turn_of_zero_is_in_the_middle_of_a_bin() -> None:
    """Otherwise half of the pairs of an upright camera would be in the first bin, and half in the last."""
    turn = np.array([-0.05, 0.05, -0.01, 0.01, 1.5])
    assert turned_alike(np.zeros(5), turn, Matching(kept=1)).tolist() == [True] * 4 + [False]


@pytest.mark.parametrize("wrong", [{"ratio": 0.0}, {"ratio": 1.5}, {"limit": 300}, {"bins": 2}, {"kept": 0}])
def test_settings_that_mean_nothing_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="need 0 < ratio"):
        Matching(**wrong)  # type: ignore[arg-type]

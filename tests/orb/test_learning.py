"""The rule that learns pairs, in plain loops; and the table that came out of it."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.features.orb import OrbSettings, learning
from vslam_ref.features.orb.learning import GRID, drawn, learn, patches
from vslam_ref.features.orb.pair_table import PAIRS


def related(rng: np.random.Generator, n: int) -> np.ndarray:
    """Patches (n, 729) whose pixels vary together: three shared patterns and noise of their own."""
    pattern = rng.normal(size=(3, 729))
    grey = 128 + 20 * rng.normal(size=(n, 3)) @ pattern + rng.normal(0, 10, (n, 729)) + 5 * pattern[0]
    return np.clip(grey, 0, 255).astype(np.uint8)


def plain(patch: np.ndarray, candidate: np.ndarray, wanted: int) -> tuple[list[list[int]], float]:
    """The rule, word by word, with NumPy's correlation coefficient."""
    bits = np.array([patch[:, i] < patch[:, j] for i, j in candidate], float)
    order = sorted(range(len(candidate)), key=lambda k: (abs(2 * bits[k].sum() - len(patch)), k))
    limit = 0.20
    while True:
        taken: list[int] = []
        for k in order:
            if bits[k].std() == 0 or len(taken) == wanted:
                continue
            if all(abs(np.corrcoef(bits[k], bits[t])[0, 1]) < limit for t in taken):
                taken.append(k)
        if len(taken) == wanted:
            return [[*GRID[candidate[k, 0]], *GRID[candidate[k, 1]]] for k in taken], limit
        limit = round(limit + 0.04, 2)


@pytest.mark.parametrize(("n", "wanted"), [(301, 24), (128, 40)])
def test_plain_loops_take_the_same_pairs(n: int, wanted: int) -> None:
    """Patches of numbers that fill words of 64 bits, and of others; the limit rises in both cases."""
    rng = np.random.default_rng(n)
    patch, candidate = related(rng, n), drawn(60, rng)
    found = learn(patch, candidate, wanted)
    pairs, limit = plain(patch, candidate, wanted)
    assert found.pairs.tolist() == pairs
    assert found.limit == limit > 0.2


def test_a_test_that_is_always_true_is_never_taken() -> None:
    rng = np.random.default_rng(4)
    patch = rng.integers(10, 256, (200, 729), dtype=np.uint8)
    patch[:, 0] = 0
    constant = np.stack([np.zeros(5, int), np.arange(1, 6)], 1)
    found = learn(patch, np.concatenate([constant, drawn(8, rng)]), 8)
    assert not (found.pairs[:, :2] == GRID[0]).all(1).any()


def test_candidates_are_different_pairs_of_the_grid() -> None:
    pair = drawn(40_000, np.random.default_rng(0))
    assert (pair[:, 0] < pair[:, 1]).all()
    assert len(np.unique(pair, axis=0)) == 40_000
    assert pair.min() >= 0
    assert pair.max() < 729


def test_patches_stand_upright(wall: np.ndarray) -> None:
    """Turned by its angle, a patch has its centroid to the right: m10 is larger than m01."""
    found = patches(wall, OrbSettings(features=200, octaves=4))
    assert found.shape == (200, 729)
    inner = np.hypot(*GRID.T) <= 13.5
    m = found[:, inner].astype(float) @ GRID[inner]
    assert np.mean(m[:, 0] > np.abs(m[:, 1])) > 0.9


def test_too_little_is_refused() -> None:
    with pytest.raises(ValueError, match="10 candidates and 5 patches: need 256 candidates"):
        learn(np.zeros((5, 729), np.uint8), drawn(10, np.random.default_rng(0)))


def test_the_table_is_one() -> None:
    """256 different pairs of different pixels, within 13 of the centre: turned and rounded, within 18."""
    assert PAIRS.shape == (256, 4)
    assert np.abs(PAIRS).max() <= learning.REACH
    assert (PAIRS[:, :2] != PAIRS[:, 2:]).any(1).all()
    unordered = {frozenset([(a, b), (c, d)]) for a, b, c, d in PAIRS.tolist()}
    assert len(unordered) == 256
    turn = np.linspace(-np.pi, np.pi, 1001)[:, None, None]
    x, y = PAIRS.reshape(-1, 2).T
    reach = np.rint(np.cos(turn) * x - np.sin(turn) * y)
    assert np.abs(reach).max() == 18


@pytest.mark.slow
def test_the_command_makes_the_table_again() -> None:
    """Byte for byte, from the rendered scenes and three data sets: half a minute."""
    from vslam_ref.datasets import catalogue
    from vslam_ref.experiments.orb import learned_pairs

    missing = [name for name in learned_pairs.SETS if catalogue.find(name) is None]
    if missing:
        pytest.skip(f"{', '.join(missing)}: not in VSLAM_REF_DATA")
    assert learned_pairs.main(["--check"]) == 0

"""The rule that chooses pairs of fields, in plain loops; and the table that came out of it."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest

from vslam_ref.features.freak import learning, pair_table
from vslam_ref.features.freak.pair_table import PAIRS
from vslam_ref.features.orb import OrbSettings


def plain(mean: np.ndarray, wanted: int) -> tuple[list[tuple[int, int]], float]:
    """The rule, word by word, with NumPy's correlation coefficient."""
    pairs = [(i, j) for i in range(mean.shape[1]) for j in range(i + 1, mean.shape[1])]
    bits = [(mean[:, i] > mean[:, j]).astype(float) for i, j in pairs]
    order = sorted(range(len(pairs)), key=lambda k: (abs(2 * bits[k].sum() - len(mean)), k))
    limit = 0.20
    while True:
        taken: list[int] = []
        for k in order:
            if bits[k].std() == 0 or len(taken) == wanted:
                continue
            if all(abs(np.corrcoef(bits[k], bits[t])[0, 1]) < limit for t in taken):
                taken.append(k)
        if len(taken) == wanted:
            return [pairs[k] for k in taken], limit
        limit = round(limit + 0.04, 2)


@pytest.mark.parametrize("wanted", [6, 14])
def test_plain_loops_take_the_same_pairs(wanted: int) -> None:
    rng = np.random.default_rng(wanted)
    shared = rng.normal(size=(201, 3)) @ rng.normal(size=(3, 9))
    mean = 128 + 20 * shared + rng.normal(0, 8, (201, 9)) + 4 * np.arange(9)
    found = learning.learn(mean, wanted)
    pairs, limit = plain(mean, wanted)
    assert [tuple(p) for p in found.pairs.tolist()] == pairs
    assert found.limit == limit > 0.2
    share = [(mean[:, i] > mean[:, j]).mean() for i, j in pairs]
    np.testing.assert_allclose(found.mean, share, atol=1e-15)


def test_a_small_table_from_a_picture_is_the_plain_one(wall: np.ndarray) -> None:
    mean = learning.patches(wall, OrbSettings(features=120, octaves=3))[:, ::5]
    assert len(mean) > 30
    found = learning.learn(mean, 10)
    pairs, limit = plain(mean, 10)
    assert [tuple(p) for p in found.pairs.tolist()] == pairs
    assert found.limit == limit


def test_too_little_is_refused() -> None:
    with pytest.raises(ValueError, match="36 pairs and 5 key points: need 512 pairs"):
        learning.learn(np.zeros((5, 9)))
    with pytest.raises(ValueError, match="0 comparisons tell values apart: need 8"):
        learning.learn(np.zeros((5, 9)), 8)


def test_the_table_is_the_one_that_was_learned() -> None:
    """512 different pairs, the outer field first; the digest in its provenance is that of its numbers."""
    assert PAIRS.shape == (512, 2)
    assert (PAIRS[:, 0] < PAIRS[:, 1]).all()
    assert PAIRS.min() >= 0
    assert PAIRS.max() <= 42
    assert len(np.unique(PAIRS, axis=0)) == 512
    digest = hashlib.sha256(PAIRS.astype("<i8").tobytes()).hexdigest()[:32]
    assert digest in (pair_table.__doc__ or "")


def test_the_table_does_not_go_from_coarse_to_fine() -> None:
    """What the docstring of ``learning`` says of its four quarters; going to fine, they would rise."""
    ring = np.minimum(PAIRS // 6, 7).reshape(4, 256).mean(1)
    assert ring.round(1).tolist() == [2.7, 2.7, 2.6, 2.9]
    assert f"{ring[0]:.1f}, {ring[1]:.1f}, {ring[2]:.1f} and {ring[3]:.1f}" in (learning.__doc__ or "")


@pytest.mark.slow
def test_the_command_makes_the_table_again() -> None:
    """Byte for byte, from rendered scenes: a minute."""
    from vslam_ref.experiments.freak import learned_pairs

    assert learned_pairs.main(["--check"]) == 0

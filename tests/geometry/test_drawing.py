"""Samples of different numbers: never twice the same in one, and all equally likely."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import chi2

from vslam_ref.geometry.drawing import different_numbers


@pytest.mark.parametrize(("below", "size"), [(3, 3), (5, 3), (12, 3), (13, 3), (40, 5)])
def test_numbers_of_a_sample_differ_and_lie_in_range(below: int, size: int) -> None:
    """Both ways: by sorting up to four times the size, by drawing again above."""
    drawn = different_numbers(np.random.default_rng(below), 5000, below, size)
    assert drawn.shape == (5000, size)
    assert drawn.min() >= 0
    assert drawn.max() < below
    assert all(len(set(row)) == size for row in drawn.tolist())


@pytest.mark.parametrize("below", [5, 9])
def test_every_sample_in_every_order_is_equally_likely(below: int) -> None:
    """Chi-square of all ordered pairs, two-sided, false alarm one in a thousand each side."""
    drawn = different_numbers(np.random.default_rng(1), 40_000, below, 2)
    cells = math.perm(below, 2)
    counts = np.bincount(drawn[:, 0] * below + drawn[:, 1], minlength=below**2)
    counts = counts[counts > 0]
    assert len(counts) == cells
    expected = 40_000 / cells
    total = float(((counts - expected) ** 2 / expected).sum())
    assert chi2.ppf(0.001, cells - 1) < total < chi2.ppf(0.999, cells - 1)


def test_too_few_numbers_are_refused() -> None:
    with pytest.raises(ValueError, match="samples of 3 from 2 numbers: need at least 3"):
        different_numbers(np.random.default_rng(0), 10, 2, 3)

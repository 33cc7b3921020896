"""The quadtree against a plain one, and what it promises."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vslam_ref.features.orb import book
from vslam_ref.features.orb.candidates import candidates
from vslam_ref.features.orb.spread import spread


def corners(rng: np.random.Generator, width: int, height: int, n: int) -> np.ndarray:
    """Different pixels in row order, some of them in a cluster, and scores with ties: (n, 3)."""
    some = rng.integers(0, [width, height], (n, 2))
    cluster = rng.integers(0, [max(width // 8, 1), max(height // 8, 1)], (n, 2))
    xy = np.unique(np.where(rng.random((n, 1)) < 0.5, some, cluster)[:, ::-1], axis=0)[:, ::-1]
    return np.column_stack([xy, rng.integers(7, 12, len(xy))])


@given(
    seed=st.integers(0, 2**32 - 1),
    width=st.integers(1, 90),
    height=st.integers(1, 60),
    n=st.integers(0, 120),
    wanted=st.integers(0, 130),
)
def test_a_plain_tree_keeps_the_same(seed: int, width: int, height: int, n: int, wanted: int) -> None:
    found = corners(np.random.default_rng(seed), width, height, n)
    kept = spread(found[:, :2], found[:, 2], (height, width), wanted)
    listed = [tuple(c) for c in found.tolist()]
    expected = sorted(listed.index(c) for c in book.spread(listed, width, height, wanted))
    assert kept.tolist() == expected
    assert len(kept) == min(len(found), wanted)


def test_quarters_with_corners_keep_one_each() -> None:
    """A thousand strong corners in one quarter leave three weak ones, alone in theirs, their places."""
    rng = np.random.default_rng(5)
    strong = np.unique(rng.integers(0, 50, (1000, 2)), axis=0)
    xy = np.concatenate([strong, [[70, 20], [20, 70], [80, 90]]])
    score = np.concatenate([np.full(len(strong), 200), [7, 7, 7]])
    kept = spread(xy, score, (100, 100), 16)
    assert {len(strong), len(strong) + 1, len(strong) + 2} <= set(kept.tolist())
    assert len(kept) == 16


def test_features_cover_more_than_the_best_ones_do(wall: np.ndarray) -> None:
    """Of 8 x 8 fields of a picture whose right half has a tenth of the contrast, more have a feature."""
    faint = wall.copy()
    faint[:, 108:] = 128 + wall[:, 108:] // 6
    found = candidates(faint, 20, 7, 35)
    fields = [
        len({(x // 27, y // 27) for x, y in found.xy[k].tolist()})
        for k in (
            spread(found.xy, found.score, (216, 216), 60),
            np.argsort(-found.score, kind="stable")[:60],
        )
    ]
    assert fields[0] > fields[1]


def test_a_corner_outside_is_refused() -> None:
    with pytest.raises(ValueError, match=r"pixel \(10, 0\) of an image of 10 x 10"):
        spread([[10, 0]], [5], (10, 10), 4)

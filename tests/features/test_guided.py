"""Matches near predicted places, by reading distances window by window."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vslam_ref.features.guided import match_near
from vslam_ref.features.hamming import match


def plain(place, radius, a, uv, b, ratio, mutual, limit):  # type: ignore[no-untyped-def]
    """Plain loops over Python's numbers."""

    def holds(i: int, j: int) -> bool:
        return abs(place[i][0] - uv[j][0]) <= radius[i] and abs(place[i][1] - uv[j][1]) <= radius[i]

    def bits(i: int, j: int) -> int:
        return (int.from_bytes(a[i].tobytes(), "big") ^ int.from_bytes(b[j].tobytes(), "big")).bit_count()

    found = []
    for i in range(len(a)):
        near = sorted((bits(i, j), j) for j in range(len(b)) if holds(i, j))
        if not near or near[0][0] > limit:
            continue
        d, j = near[0]
        if ratio is not None and len(near) > 1 and not d < ratio * near[1][0]:
            continue
        if mutual and min((bits(k, j), k) for k in range(len(a)) if holds(k, j))[1] != i:
            continue
        found.append((i, j, d))
    return found


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(0, 12),
    m=st.integers(0, 12),
    ratio=st.sampled_from([None, 0.5, 0.8, 1.0]),
    mutual=st.booleans(),
    limit=st.integers(0, 8),
)
def test_plain_loops_find_the_same(
    seed: int, n: int, m: int, ratio: float | None, mutual: bool, limit: int
) -> None:
    """Whole pixels and descriptors of one byte: features at the edges of windows, and many ties."""
    rng = np.random.default_rng(seed)
    a, b = (rng.integers(0, 256, (k, 1), dtype=np.uint8) for k in (n, m))
    place, uv = (rng.integers(0, 12, (k, 2)).astype(float) for k in (n, m))
    radius = rng.integers(0, 9, n).astype(float)
    found = match_near(place, radius, a, uv, b, ratio=ratio, mutual=mutual, limit=limit)
    expected = plain(place.tolist(), radius.tolist(), a, uv.tolist(), b, ratio, mutual, limit)
    assert list(zip(*(part.tolist() for part in found), strict=True)) == expected


def test_windows_that_hold_all_match_as_without_them() -> None:
    rng = np.random.default_rng(1)
    a = rng.integers(0, 256, (60, 64), dtype=np.uint8)
    b = a[rng.permutation(60)] ^ (rng.random((60, 64)) < 0.2).astype(np.uint8)
    place, uv = rng.uniform(0, 100, (2, 60, 2))
    for found, expected in zip(match_near(place, 100.0, a, uv, b), match(a, b), strict=True):
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(
    ("place", "radius", "a", "told"),
    [
        ([[1.0, 2.0]], 1.0, np.zeros((2, 64), np.uint8), r"place is of shape \(1, 2\): need \(2, 2\)"),
        ([[1.0, 2.0]], -1.0, np.zeros((1, 64), np.uint8), "radius is -1.0"),
        ([[1.0, 2.0]], [1.0, 1.0], np.zeros((1, 64), np.uint8), r"radius is of shape \(2,\)"),
        ([[1.0, 2.0]], np.nan, np.zeros((1, 64), np.uint8), "radius"),
        ([[1.0, np.nan]], 1.0, np.zeros((1, 64), np.uint8), "place"),
        ([[1.0, 2.0]], 1.0, np.zeros((1, 32), np.uint8), "a has 32 bytes each and b 64"),
        ([[1.0, 2.0]], 1.0, np.zeros((1, 64)), "a is float64"),
    ],
)
def test_bad_questions_are_refused(place: object, radius: object, a: np.ndarray, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        match_near(place, radius, a, [[0.0, 0.0]], np.zeros((1, 64), np.uint8))  # type: ignore[arg-type]

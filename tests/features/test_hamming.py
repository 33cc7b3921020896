"""Distances of bits by Python's own count, and pairs by reading the table of distances."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from vslam_ref import _kernels
from vslam_ref.features import hamming

Bytes = NDArray[np.uint8]


def plain(a: Bytes, b: Bytes) -> list[list[int]]:
    numbers = [[int.from_bytes(row.tobytes(), "big") for row in k] for k in (a, b)]
    return [[(p ^ q).bit_count() for q in numbers[1]] for p in numbers[0]]


@pytest.mark.parametrize("name", ["numpy", "numba"])
@pytest.mark.parametrize("size", [1, 8, 31, 32, 33, 64])
@pytest.mark.parametrize(("n", "m"), [(70, 33), (1, 1), (0, 4), (3, 0)])
def test_distances_are_pythons(name: str, size: int, n: int, m: int) -> None:
    if name == "numba":
        pytest.importorskip("numba")
    rng = np.random.default_rng(size)
    a, b = (rng.integers(0, 256, (k, size), dtype=np.uint8) for k in (n, m))
    with _kernels.use_backend(name):
        d = hamming.distances(a, b)
    assert d.shape == (n, m)
    assert d.tolist() == plain(a, b)


def test_all_bits_differ_in_the_complement() -> None:
    a = np.random.default_rng(0).integers(0, 256, (5, 64), dtype=np.uint8)
    assert np.diag(hamming.distances(a, ~a)).tolist() == [512] * 5


def test_older_numpy_counts_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(np, "bitwise_count", raising=False)
    word = np.random.default_rng(1).integers(0, 2**64, (3, 4), dtype=np.uint64)
    word[0, :2] = 0, 2**64 - 1
    expected = [[int(w).bit_count() for w in row] for row in word]
    assert hamming.bit_count(word).tolist() == expected
    assert hamming.bit_count(word[:, 1:3]).tolist() == [row[1:3] for row in expected]


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(0, 12),
    m=st.integers(0, 12),
    ratio=st.sampled_from([None, 0.5, 0.8, 1.0]),
    mutual=st.booleans(),
    limit=st.integers(0, 8),
)
def test_pairs_are_those_of_the_table(
    seed: int, n: int, m: int, ratio: float | None, mutual: bool, limit: int
) -> None:
    """Descriptors of one byte: many ties."""
    rng = np.random.default_rng(seed)
    a, b = (rng.integers(0, 256, (k, 1), dtype=np.uint8) for k in (n, m))
    table, expected = plain(a, b), []
    for i in range(n if m else 0):
        j = min(range(m), key=lambda j: (table[i][j], j))
        others = [table[i][k] for k in range(m) if k != j]
        back = min(range(n), key=lambda k: (table[k][j], k))
        good = table[i][j] <= limit and (not mutual or back == i)
        if good and (ratio is None or not others or table[i][j] < ratio * min(others)):
            expected.append((i, j, table[i][j]))
    found = hamming.match(a, b, ratio, mutual, limit)
    assert list(zip(*(part.tolist() for part in found), strict=True)) == expected


@pytest.mark.parametrize(
    ("a", "b", "told"),
    [
        (np.zeros((2, 32)), np.zeros((2, 32), np.uint8), "a is float64"),
        (np.zeros((2, 32), np.uint8), np.zeros(32, np.uint8), r"b is uint8 of shape \(32,\)"),
        (np.zeros((2, 32), np.uint8), np.zeros((2, 31), np.uint8), "a has 32 bytes each and b 31"),
    ],
)
def test_bad_descriptors_are_refused(a: np.ndarray, b: np.ndarray, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        hamming.match(a, b)

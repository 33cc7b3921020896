"""Binary descriptors compared: how many bits differ, and which belong together."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import IntArray
from vslam_ref.features.levels import Bytes

Words = NDArray[np.uint64]
Counts = NDArray[np.int32]
PORTION = 32
"""Descriptors that are compared with all others at a time."""


class Matches(NamedTuple):
    """Pairs of descriptors.

    Attributes
    ----------
    first, second : ndarray of int64, shape (k,)
        Which of the first set belongs to which of the second; the first in ascending order.
    distance : ndarray of int64, shape (k,)
        Bits that differ.
    """

    first: IntArray
    second: IntArray
    distance: IntArray


def descriptors(name: str, given: ArrayLike) -> Bytes:
    """Check descriptors (n, bytes) that have no unit, and lay them out in rows.

    Raises
    ------
    ValueError
        If they are not bytes in rows.
    """
    array = np.asarray(given)
    if array.dtype != np.uint8 or array.ndim != 2:
        raise ValueError(f"{name} is {array.dtype} of shape {array.shape}: need uint8 of shape (n, bytes)")
    return np.ascontiguousarray(array)


def two_sets(a: ArrayLike, b: ArrayLike) -> tuple[Bytes, Bytes]:
    """Check two sets of descriptors (n, bytes) and (m, bytes), which have no unit, and lay them out in rows.

    Raises
    ------
    ValueError
        If they are not bytes in rows, or not as many.
    """
    first, second = descriptors("a", a), descriptors("b", b)
    if first.shape[1] != second.shape[1]:
        raise ValueError(f"a has {first.shape[1]} bytes each and b {second.shape[1]}: need as many")
    return first, second


def distances(a: ArrayLike, b: ArrayLike) -> Counts:
    """Count the bits in which each descriptor of a set differs from each one of another.

    Implements :eq:`eq-hamming`.

    Parameters
    ----------
    a : array_like of uint8, shape (n, bytes)
    b : array_like of uint8, shape (m, bytes)

    Returns
    -------
    ndarray of int32, shape (n, m)
        Counts of bits: they have no unit.

    Raises
    ------
    ValueError
        If they are not bytes, or not as many.

    Examples
    --------
    >>> distances(np.array([[0b1100]], np.uint8), np.array([[0b1010], [0b1100]], np.uint8))
    array([[2, 0]], dtype=int32)
    """
    return _distances(*two_sets(a, b))


@accelerated("hamming:distances")
def _distances(a: Bytes, b: Bytes) -> Counts:
    """Bits (n, m), some rows at a time so that they stay in the processor's cache."""
    p, q = words(a), np.ascontiguousarray(words(b).T)
    bits = np.zeros((len(a), len(b)), np.int32)
    for low in range(0, len(a), PORTION):
        part = slice(low, low + PORTION)
        for k in range(len(q)):
            bits[part] += bit_count(p[part, k, None] ^ q[k])  # eq-hamming
    return bits


def words(rows: Bytes) -> Words:
    """Descriptors (n, bytes) as words of 64 bits, without unit; the last one is filled up with zeros."""
    wide = np.zeros((rows.shape[0], -(-rows.shape[1] // 8) * 8), np.uint8)
    wide[:, : rows.shape[1]] = rows
    return wide.view(np.uint64)


def differing(a: Bytes, b: Bytes) -> IntArray:
    """Count the bits (...) in which descriptors ``a (..., bytes)`` differ from ``b (..., bytes)``, in pairs.

    Implements :eq:`eq-hamming`; counts have no unit.

    Examples
    --------
    >>> differing(np.array([[0b1100], [0b1]], np.uint8), np.array([[0b1010], [0b1]], np.uint8))
    array([2, 0])
    """
    apart = np.asarray(a ^ b)
    each = bit_count(words(apart.reshape(-1, apart.shape[-1])))  # eq-hamming
    bits: IntArray = each.sum(-1, dtype=np.int64)
    return bits.reshape(apart.shape[:-1])


def bit_count(word: Words) -> Bytes:
    """Count the bits that are set in each word (...); below NumPy 2, by a table of 16 bits.

    Examples
    --------
    >>> bit_count(np.array([0, 7, 2**63], np.uint64))
    array([0, 3, 1], dtype=uint8)
    """
    if hasattr(np, "bitwise_count"):
        return np.asarray(np.bitwise_count(word))
    quarters = np.ascontiguousarray(word)[..., None].view(np.uint16)
    return np.asarray(_table()[quarters].sum(-1, dtype=np.uint8))


@functools.cache
def _table() -> Bytes:
    return np.array([k.bit_count() for k in range(1 << 16)], np.uint8)


def match(
    a: ArrayLike, b: ArrayLike, ratio: float | None = 0.8, mutual: bool = True, limit: int = 256
) -> Matches:
    """Pair each descriptor of a set with its nearest one of another.

    Implements :eq:`eq-hamming-match`.

    Parameters
    ----------
    a : array_like of uint8, shape (n, bytes)
    b : array_like of uint8, shape (m, bytes)
    ratio : float, optional
        The distance must be below so many times that of the second nearest; with 1, only ties are refused.
        None does not ask.
    mutual : bool
        Whether a must be the nearest of b, too.  Of several that are equally near, the first is taken.
    limit : int
        Largest distance, bits.

    Returns
    -------
    Matches

    Raises
    ------
    ValueError
        As :func:`distances`.

    Examples
    --------
    >>> a = np.array([[0b0000], [0b1111]], np.uint8)
    >>> match(a, np.array([[0b0111], [0b0001]], np.uint8)).second
    array([1, 0])
    """
    d = distances(a, b)
    rows = np.arange(len(d))
    if d.size == 0:
        none = np.zeros(0, np.int64)
        return Matches(none, none, none)
    second = d.argmin(1)
    nearest = d[rows, second]
    ok = nearest <= limit
    if mutual:
        ok &= d.argmin(0)[second] == rows
    if ratio is not None and d.shape[1] > 1:
        d[rows, second] = np.iinfo(np.int32).max
        ok &= nearest < ratio * d.min(1)
    return Matches(rows[ok], second[ok], nearest[ok].astype(np.int64))  # eq-hamming-match

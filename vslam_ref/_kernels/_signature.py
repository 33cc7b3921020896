"""How a kernel is compiled: one signature, for arrays of any strides, its machine code kept on disk.

One signature means no second compilation when a map is full or a run alone.  A kernel's module is imported
at its first call, so that is when the cache is read.
"""

from __future__ import annotations

from numba import njit, types


def given(ndim, dtype=types.float64):
    """Type of an array that is only read; it may be a broadcast view."""
    return types.Array(dtype, ndim, "A", readonly=True)


def changed(ndim, dtype=types.float64):
    """Type of an array that is changed in place."""
    return types.Array(dtype, ndim, "A")


def made(ndim):
    """Type of an array that is returned."""
    return types.Array(types.float64, ndim, "C")


def kernel(*arguments, returns=types.void):
    """Compile for one signature and keep the machine code on disk."""
    return njit(returns(*arguments), cache=True)

"""How a kernel is compiled: one signature, for arrays of any strides, its machine code kept on disk.

One signature means no second compilation when a map is full or a run alone.  A kernel is compiled, or read
from the cache, at its own first call and not with its module: a program waits for what it uses only.
"""

from __future__ import annotations

from typing import Any

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
    """Declare a kernel with one signature, to be compiled by :func:`compiled`."""

    def declare(function):
        dispatcher: Any = njit(cache=True)(function)
        dispatcher.signature = returns(*arguments)
        return dispatcher

    return declare


def unpacks(dispatcher):
    """Declare a twin in Python that hands the fields of NamedTuples to a kernel."""

    def declare(function):
        function.kernel = dispatcher
        return function

    return declare


def compiled(twin):
    """Compile a kernel for its signature, or read it from the cache, and for no other; return the twin."""
    dispatcher = getattr(twin, "kernel", twin)
    if not dispatcher.signatures:
        dispatcher.compile(dispatcher.signature)
        dispatcher.disable_compile()
    return twin

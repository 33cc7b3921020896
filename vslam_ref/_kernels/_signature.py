"""How a kernel is compiled: one signature, for arrays of any strides, its machine code kept on disk.

One signature means no second compilation when a map is full or a run alone.  A kernel is compiled, or read
from the cache, at its own first call and not with its module: a program waits for what it uses only.

Numba takes a kernel from its cache as long as the kernel's own file is the same, whatever has changed in the
functions that it calls.  So the folder of the cache is named after the digest of all files of this package.
"""

from __future__ import annotations

import functools
import hashlib
import os
import tempfile
from pathlib import Path
from typing import Any

import numba
from numba import types

HERE = Path(__file__).resolve().parent
CONFIG: Any = numba.config


@functools.cache
def cache_folder() -> str | None:
    """Return the folder of the compiled kernels, or None where each process must compile them itself.

    It lies in ``NUMBA_CACHE_DIR`` if that is set, else beside the kernels, else in ``~/.cache/vslam_ref``:
    the first that can be written to.
    """
    sources = [path.read_bytes() for path in sorted(HERE.glob("*.py"))]
    if not sources:
        return None  # zipped, or compiled files only: Numba cannot tell when its code is out of date
    name = "kernels-" + hashlib.sha256(b"".join(sources)).hexdigest()[:16]
    bases = CONFIG.CACHE_DIR, HERE / "__pycache__", os.path.expanduser("~/.cache/vslam_ref")
    for base in filter(None, bases):
        folder = os.path.join(base, name)
        try:
            os.makedirs(folder, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
        except OSError:
            continue
        return folder
    return None


def njit(*, cache, error_model="python"):
    """Compile at the first call, as ``numba.njit`` does, and keep the code in :func:`cache_folder`.

    With ``error_model="numpy"`` a division by zero is not looked for, which costs a branch each time.
    Other threads go on while a kernel runs: it touches arrays only, no object of Python.
    """

    def declare(function):
        folder, before = cache_folder(), CONFIG.CACHE_DIR
        if folder is None:
            return numba.njit(error_model=error_model, nogil=True)(function)
        try:
            CONFIG.CACHE_DIR = folder  # read when the function is declared
            return numba.njit(cache=cache, error_model=error_model, nogil=True)(function)
        finally:
            CONFIG.CACHE_DIR = before

    return declare


def given(ndim, dtype=types.float64):
    """Type of an array that is only read; it may be a broadcast view."""
    return types.Array(dtype, ndim, "A", readonly=True)


def changed(ndim, dtype=types.float64):
    """Type of an array that is changed in place."""
    return types.Array(dtype, ndim, "A")


def kernel(*arguments, returns=types.void, error_model="python"):
    """Declare a kernel with one signature, to be compiled by :func:`compiled`."""

    def declare(function):
        dispatcher: Any = njit(cache=True, error_model=error_model)(function)
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

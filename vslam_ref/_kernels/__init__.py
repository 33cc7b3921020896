"""Which backend runs a hot loop: the readable NumPy function or its compiled Numba twin.

A NumPy function that has a twin says so with :func:`accelerated`::

    @accelerated("filters:cholesky_update")
    def cholesky_update(...): ...

The name before the colon is a module of this package, the one behind it a function there with the
same signature.  ``VSLAM_REF_BACKEND`` chooses: ``auto`` (Numba when installed, the default),
``numpy`` or ``numba``.  Numba is imported at the first accelerated call, never at import.

A twin stands for the NumPy function that it was tested against.  If the code of one of the two has changed
since (``digests.json``, which ``make twins`` writes), NumPy runs, and one warning says so; where
``VSLAM_REF_BACKEND=numba`` demands the twin, that is an error.
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

CHOICES = ("auto", "numpy", "numba")
REGISTRY: dict[str, tuple[Callable[..., Any], str]] = {}
"""Dotted name of the NumPy function -> (the NumPy function itself, ``module:function`` of its twin)."""

_chosen: str | None = None
_demanded = False  # Numba by name, not by "auto"
_warned = False


def backend() -> str:
    """Return the backend in force, ``"numpy"`` or ``"numba"``.

    Raises
    ------
    ValueError
        If ``VSLAM_REF_BACKEND`` is none of ``auto``, ``numpy``, ``numba``, or asks for Numba where
        it is not installed.
    """
    global _chosen, _demanded
    if _chosen is None:
        wanted = os.environ.get("VSLAM_REF_BACKEND", "auto")
        _chosen, _demanded = _resolve(wanted), wanted == "numba"
    return _chosen


def available() -> list[str]:
    """Return the backends that are there: ``numpy``, and ``numba`` where it is installed."""
    return ["numpy", "numba"] if importlib.util.find_spec("numba") else ["numpy"]


def _resolve(wanted: str) -> str:
    if wanted not in CHOICES:
        raise ValueError(f"VSLAM_REF_BACKEND={wanted!r}: must be one of {', '.join(CHOICES)}")
    installed = "numba" in available()
    if wanted == "numba" and not installed:
        raise ValueError(
            "VSLAM_REF_BACKEND='numba', but numba is not installed: pip install 'vslam-ref[fast]'"
        )
    return "numba" if installed and wanted != "numpy" else "numpy"


@contextmanager
def use_backend(name: str) -> Iterator[str]:
    """Run a block with backend ``name`` (``auto``, ``numpy`` or ``numba``), then restore the old one."""
    global _chosen, _demanded
    before = _chosen, _demanded
    _chosen, _demanded = _resolve(name), name == "numba"
    try:
        yield _chosen
    finally:
        _chosen, _demanded = before


def accelerated(twin: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Declare that a NumPy function has the Numba twin ``module:function`` of this package."""

    def declare(function: Callable[P, R]) -> Callable[P, R]:
        REGISTRY[f"{function.__module__}.{function.__qualname__}"] = (function, twin)
        kernel: Callable[..., Any] | None = None

        @functools.wraps(function)
        def choose(*args: P.args, **kwargs: P.kwargs) -> R:
            nonlocal kernel
            if _chosen == "numba" or (_chosen is None and backend() == "numba"):
                if kernel is None or (_demanded and kernel is function):
                    kernel = _load(twin) if _is_current(twin) else function
                return kernel(*args, **kwargs)  # type: ignore[no-any-return]
            return function(*args, **kwargs)

        return choose

    return declare


def _is_current(twin: str) -> bool:
    """Whether a twin may stand for its function; if not, warn once, or raise where Numba is demanded."""
    global _warned
    from vslam_ref._kernels import _digests

    changed = ", ".join(_digests.changed_files(twin))
    if not changed:
        return True
    said = f"{changed}: changed since NumPy and Numba were tested to give the same here"
    if _demanded:
        from vslam_ref.support.errors import InputError

        raise InputError(f"VSLAM_REF_BACKEND=numba, but {said}: 'make twins' tests them again")
    if not _warned:
        _warned = True
        said += "; NumPy runs instead of Numba until 'make twins' has tested them again"
        warnings.warn(said, RuntimeWarning, stacklevel=3)
    return False


def set_aside() -> list[str]:
    """Return the twins that are not used, since the code of their pair has changed."""
    from vslam_ref._kernels import _digests

    return sorted(twin for twin in _digests.stored()["pairs"] if _digests.changed_files(twin))


@functools.cache
def _load(twin: str) -> Callable[..., Any]:
    module, _, name = twin.partition(":")
    kernel = getattr(importlib.import_module(f"{__name__}.{module}"), name)
    return importlib.import_module(f"{__name__}._signature").compiled(kernel)  # type: ignore[no-any-return]


def warm(*modules: str) -> None:
    """Compile every twin, or those of some modules, or read them from the cache on disk, now."""
    for _, twin in REGISTRY.values():
        if (not modules or twin.partition(":")[0] in modules) and _is_current(twin):
            _load(twin)

"""Which backend runs a hot loop: the readable NumPy function or its compiled Numba twin.

A NumPy function that has a twin says so with :func:`accelerated`::

    @accelerated("filters:cholesky_update")
    def cholesky_update(...): ...

The name before the colon is a module of this package, the one behind it a function there with the
same signature.  ``VSLAM_REF_BACKEND`` chooses: ``auto`` (Numba when installed, the default),
``numpy`` or ``numba``.  Numba is imported at the first accelerated call, never at import.
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

CHOICES = ("auto", "numpy", "numba")
REGISTRY: dict[str, tuple[Callable[..., Any], str]] = {}
"""Dotted name of the NumPy function -> (the NumPy function itself, ``module:function`` of its twin)."""

_chosen: str | None = None


def backend() -> str:
    """Return the backend in force, ``"numpy"`` or ``"numba"``.

    Raises
    ------
    ValueError
        If ``VSLAM_REF_BACKEND`` is none of ``auto``, ``numpy``, ``numba``, or asks for Numba where
        it is not installed.
    """
    global _chosen
    if _chosen is None:
        _chosen = _resolve(os.environ.get("VSLAM_REF_BACKEND", "auto"))
    return _chosen


def _resolve(wanted: str) -> str:
    if wanted not in CHOICES:
        raise ValueError(f"VSLAM_REF_BACKEND={wanted!r}: must be one of {', '.join(CHOICES)}")
    installed = importlib.util.find_spec("numba") is not None
    if wanted == "numba" and not installed:
        raise ValueError(
            "VSLAM_REF_BACKEND='numba', but numba is not installed: pip install 'vslam-ref[fast]'"
        )
    return "numba" if installed and wanted != "numpy" else "numpy"


@contextmanager
def use_backend(name: str) -> Iterator[str]:
    """Run a block with backend ``name`` (``auto``, ``numpy`` or ``numba``), then restore the old one."""
    global _chosen
    before = _chosen
    _chosen = _resolve(name)
    try:
        yield _chosen
    finally:
        _chosen = before


def accelerated(twin: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Declare that a NumPy function has the Numba twin ``module:function`` of this package."""

    def declare(function: Callable[P, R]) -> Callable[P, R]:
        REGISTRY[f"{function.__module__}.{function.__qualname__}"] = (function, twin)
        kernel: Callable[..., Any] | None = None

        @functools.wraps(function)
        def choose(*args: P.args, **kwargs: P.kwargs) -> R:
            nonlocal kernel
            if _chosen == "numba" or (_chosen is None and backend() == "numba"):
                if kernel is None:
                    kernel = _load(twin)
                return kernel(*args, **kwargs)  # type: ignore[no-any-return]
            return function(*args, **kwargs)

        return choose

    return declare


@functools.cache
def _load(twin: str) -> Callable[..., Any]:
    module, _, name = twin.partition(":")
    kernel = getattr(importlib.import_module(f"{__name__}.{module}"), name)
    return importlib.import_module(f"{__name__}._signature").compiled(kernel)  # type: ignore[no-any-return]


def warm(*modules: str) -> None:
    """Compile every twin, or those of some modules, or read them from the cache on disk, now."""
    for _, twin in REGISTRY.values():
        if not modules or twin.partition(":")[0] in modules:
            _load(twin)

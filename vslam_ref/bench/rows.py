"""Measured figures as flat records, each with its goal and whether it is met; the parts that measure them."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from threadpoolctl import threadpool_limits

from vslam_ref import _kernels
from vslam_ref._kernels import available

Row = dict[str, Any]
Part = Callable[[], list[Row]]


def row(
    goal: str,
    case: str,
    backend: str,
    value: float,
    unit: str,
    bound: float | None = None,
    *,
    below: bool = True,
) -> Row:
    """Return a record of ``vslam-ref bench``.

    Parameters
    ----------
    goal : str
        Name of the goal, as BA-1.
    case : str
        What was measured.
    backend : str
        ``numpy``, ``numba``, or ``-``.
    value : float
    unit : str
    bound : float, optional
        The goal; without it the figure is only shown.
    below : bool
        Whether the value should be at most, or at least, the bound.

    Examples
    --------
    >>> row("IM-1", "import", "-", 1.2, "x", 1.5)["met"]
    'yes'
    """
    record = {"goal": goal, "case": case, "backend": backend, "value": float(value), "unit": unit}
    if bound is None:
        return {**record, "bound": None, "met": None}
    met = value <= bound if below else value >= bound
    return {**record, "bound": f"{'<=' if below else '>='} {bound:g}", "met": "yes" if met else "no"}


def measured(suite: str, parts: Mapping[str, Part]) -> list[Row]:
    """Rows of all parts, in turn; on a terminal a line on stderr says which part is being measured.

    Examples
    --------
    >>> [r["value"] for r in measured("toy", {"one": lambda: [row("G-1", "one", "-", 1.0, "s")]})]
    [1.0]
    """
    from tqdm import tqdm

    rows: list[Row] = []
    with tqdm(parts.items(), desc=suite, unit=" parts", leave=False, disable=None) as bar:
        for name, part in bar:
            bar.set_postfix_str(name)
            rows += part()
    return rows


def on_each_backend(quick: bool, *parts: Callable[[str, bool], list[Row]]) -> dict[str, Part]:
    """Name -> part, for all parts with every backend: one thread, and the backend in use while it runs."""

    def on(backend: str, part: Callable[[str, bool], list[Row]]) -> list[Row]:
        with threadpool_limits(1), _kernels.use_backend(backend):
            return part(backend, quick)

    return {f"{p.__name__}, {b}": functools.partial(on, b, p) for b in available() for p in parts}


def each_backend() -> Iterator[str]:
    """Yield the backends' names; while one is out, it is in use, on one thread."""
    with threadpool_limits(1):
        for backend in available():
            with _kernels.use_backend(backend):
                yield backend

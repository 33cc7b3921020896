"""One measured figure as a flat record, with its goal and whether it is met."""

from __future__ import annotations

from typing import Any


def row(
    goal: str,
    case: str,
    backend: str,
    value: float,
    unit: str,
    bound: float | None = None,
    *,
    below: bool = True,
) -> dict[str, Any]:
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
    met = None if bound is None else (value <= bound if below else value >= bound)
    return {
        "goal": goal,
        "case": case,
        "backend": backend,
        "value": value,
        "unit": unit,
        "bound": None if bound is None else f"{'<=' if below else '>='} {bound:g}",
        "met": {None: None, True: "yes", False: "no"}[met],
    }

# ruff: noqa: E501
"""Words for what was found: the order of numbers, a factor that has a name, where entries stand."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array


def in_order(order: tuple[int, ...]) -> str:
    """Where the right numbers stand."""
    return ", ".join(str(k) for k in np.argsort(order))


KNOWN = {
    "2": 2.0, "1/2": 0.5, "3": 3.0, "1/3": 1 / 3, "4": 4.0, "1/4": 0.25, "6": 6.0, "1/6": 1 / 6, "pi": np.pi, "-1": -1.0,
    "180/pi": 180 / np.pi, "pi/180": np.pi / 180, "sqrt(2)": 2**0.5, "1/sqrt(2)": 0.5**0.5, "-2": -2.0, "-1/2": -0.5,
    "ln 10": np.log(10), "1/ln 10": 1 / np.log(10), "1/ln 2": 1 / np.log(2), "1.4826": 1.482602218505602,
    "1/1.4826": 1 / 1.482602218505602,
}  # fmt: skip
"""Factors that have a name."""


def called(factor: float) -> str:
    """A factor by its name, or six digits of it."""
    return next((name for name, x in KNOWN.items() if abs(x - factor) < 1e-7 * abs(x)), f"{factor:.6g}")


def in_short(x: Array) -> str:
    """An array in one line."""
    return np.array2string(x, precision=6, separator=", ", suppress_small=True).replace("\n", "")


def places(wrong: Array) -> str:
    """Where a mask is true, in words: an entry, a row, a column, a block, some entries."""
    at = [tuple(int(i) for i in index) for index in np.argwhere(wrong)]
    if wrong.ndim == 0 or wrong.all():
        return "all entries"
    if len(at) == 1:
        return f"entry {_index(at[0])}"
    low, high = np.argwhere(wrong).min(axis=0), np.argwhere(wrong).max(axis=0)
    box = tuple(slice(int(a), int(b) + 1) for a, b in zip(low, high, strict=True))
    if wrong[box].all():
        if wrong.ndim == 2 and low[0] == high[0] and low[1] == 0 and high[1] == wrong.shape[1] - 1:
            return f"row {low[0]}"
        if wrong.ndim == 2 and low[1] == high[1] and low[0] == 0 and high[0] == wrong.shape[0] - 1:
            return f"column {low[1]}"
        spans = ", ".join(f"{a}-{b}" if a != b else f"{a}" for a, b in zip(low, high, strict=True))
        return f"block ({spans})" if wrong.ndim > 1 else f"entries {spans}"
    if len(at) <= 6:
        return f"entries {', '.join(map(_index, at))}"
    return f"{len(at)} of {wrong.size} entries, within {tuple(f'{a}-{b}' for a, b in zip(low, high, strict=True))}"


def _index(at: tuple[int, ...]) -> str:
    return str(at[0]) if len(at) == 1 else str(at)

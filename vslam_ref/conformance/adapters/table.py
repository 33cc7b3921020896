"""An adapter as a table: the function's name -> a Python function of the inputs by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Answers = dict[str, Callable[..., Any]]


def answer_from(table: Mapping[str, Callable[..., Any]], function: str, inputs: Mapping[str, Any]) -> Any:
    """Answer one question by a table.

    Raises
    ------
    NotImplementedError
        If the table has no such function.
    """
    if function not in table:
        raise NotImplementedError(function)
    return plain(table[function](**{name: _array(value) for name, value in inputs.items()}))


def plain(value: Any) -> Any:
    """Nested lists of numbers from arrays, named tuples and dictionaries."""
    if isinstance(value, dict):
        return {key: plain(v) for key, v in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    return value


def _array(value: Any) -> Any:
    """Arrays of lists of numbers; words, truth values, single numbers and records as they are."""
    if not isinstance(value, list):
        return value
    try:
        return np.array(value, dtype=np.float64)
    except (ValueError, TypeError):
        return value

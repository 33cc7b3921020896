"""Values as JSON text: floats to full precision, arrays as lists, a list of numbers on one line."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any


def plain(value: Any) -> Any:
    """Return ``value`` in the types of JSON: arrays and tuples as lists, non-finite numbers as None.

    Raises
    ------
    TypeError
        If a value has no place in JSON.
    """
    if value is None or isinstance(value, bool | str | int):
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, bytes):
        return [plain(inner) for inner in value]
    if hasattr(value, "tolist"):  # NumPy arrays and scalars
        return plain(value.tolist())
    raise TypeError(f"{type(value).__name__} cannot be written to JSON")


def to_json(document: Any) -> str:
    """Return a document as JSON text: floats to full precision, keys in their given order.

    Objects and lists of them are indented; a list of numbers or words stays on one line.

    Examples
    --------
    >>> print(to_json({"a": [0.1, float("nan")], "b": {}}), end="")
    {
      "a": [0.1, null],
      "b": {}
    }
    """
    return _lines(plain(document), "") + "\n"


def _lines(value: Any, indent: str) -> str:
    inner = indent + "  "
    if isinstance(value, dict) and value:
        rows = [
            f"{inner}{json.dumps(key, ensure_ascii=False)}: {_lines(v, inner)}" for key, v in value.items()
        ]
        return "{\n" + ",\n".join(rows) + f"\n{indent}}}"
    if isinstance(value, list) and any(isinstance(v, dict | list) for v in value):
        return "[\n" + ",\n".join(inner + _lines(v, inner) for v in value) + f"\n{indent}]"
    return json.dumps(value, ensure_ascii=False, allow_nan=False)

"""A table of functions of other libraries, whose arguments have other names: inputs go by their order."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from vslam_ref.conformance.adapters.table import answer_from


def asked(table: Mapping[str, Callable[..., Any]]) -> Callable[[str, dict[str, Any]], Any]:
    """The function ``answer`` of an adapter."""
    by_order = {name: _by_order(function) for name, function in table.items()}
    return lambda function, inputs: answer_from(by_order, function, inputs)


def _by_order(function: Callable[..., Any]) -> Callable[..., Any]:
    return lambda **inputs: function(*inputs.values())

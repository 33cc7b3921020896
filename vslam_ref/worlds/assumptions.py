"""How a world states its assumptions, each with unit and reason, and refuses values it cannot use."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from typing import Any


def assume(default: Any, unit: str, reason: str) -> Any:
    """Field of a frozen dataclass with its unit and the reason for its value."""
    return field(default=default, metadata={"unit": unit, "reason": reason})


def require(config: object, positive: Iterable[str], not_negative: Iterable[str] = ()) -> None:
    """Raise a ValueError unless the named fields are > 0, or >= 0."""
    for names, least, holds in ((positive, "> 0", float.__gt__), (not_negative, ">= 0", float.__ge__)):
        for name in names:
            if not holds(float(getattr(config, name)), 0.0):
                raise ValueError(f"{name}={getattr(config, name)!r}: must be {least}")

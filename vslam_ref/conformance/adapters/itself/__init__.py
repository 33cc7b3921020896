"""The library under its own vectors: a module for each group of chapters, each with a ``TABLE``."""

from __future__ import annotations

import importlib
import pkgutil
from typing import Any

from vslam_ref.conformance.adapters.table import Answers, answer_from

TABLE: Answers = {}
for _info in pkgutil.iter_modules(__path__):
    TABLE.update(importlib.import_module(f"{__name__}.{_info.name}").TABLE)


def answer(function: str, inputs: dict[str, Any]) -> Any:
    """Answer one question with this library's functions."""
    return answer_from(TABLE, function, inputs)

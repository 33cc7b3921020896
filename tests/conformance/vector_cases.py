"""Cases of the vector files, as the tests of more than one chapter take them."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from typing import Any

from vslam_ref.conformance import vectors_format as form


@functools.cache
def loaded(name: str) -> form.VectorFile:
    """A file, read once."""
    return form.load(name)


def some(name: str, keep: Callable[[form.Case], bool]) -> form.VectorFile:
    """A file with some of its cases."""
    file = loaded(name)
    return file._replace(cases=[case for case in file.cases if keep(case)])


def listed(case: form.Case) -> list[str]:
    """Mistakes that a case can name."""
    return [*case.mistakes, *(case.statistic or {}).get("mistakes", {})]


def mistakes(names: Iterable[str]) -> list[tuple[str, str, str]]:
    """All mistakes that files can name: file, function, note."""
    cases = ((name, case) for name in names for case in loaded(name).cases)
    return sorted({(name, case.function, note) for name, case in cases for note in listed(case)})


def size(value: Any) -> float:
    """Largest absolute number of an answer; 0 of an empty list."""
    return max(map(size, value), default=0.0) if isinstance(value, list) else abs(value)

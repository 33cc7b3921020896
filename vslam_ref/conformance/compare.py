"""Is an answer right?  Shape, finiteness, and distance in the norm of the largest entry."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.catalogue import functions
from vslam_ref.conformance.vectors_format import Case

Profile = Literal["float64", "float32"]
WORDS = {"nan": float("nan"), "inf": float("inf"), "-inf": float("-inf")}


class Difference(NamedTuple):
    """Whether an answer is right, and if not, where and by how much."""

    right: bool
    where: str
    got: Any
    expected: Any
    size: float
    allowed: float


RIGHT = Difference(True, "", None, None, 0.0, 0.0)


def numbers(value: Any) -> Array:
    """Array of floats from nested lists, words for what is not finite included; truth values are 0 and 1.

    >>> numbers([1, "inf", True]).tolist()
    [1.0, inf, 1.0]
    """
    if isinstance(value, list | tuple):
        parts = [numbers(v) for v in value]
        if len({part.shape for part in parts}) > 1:
            raise ValueError("rows of different lengths")
        return np.stack(parts) if parts else np.zeros(0)
    if isinstance(value, str):
        if value not in WORDS:
            raise ValueError(f"{value!r} is not a number")
        return np.array(WORDS[value])
    if isinstance(value, bool | int | float | np.generic):
        return np.array(float(value))
    if isinstance(value, np.ndarray):
        return value.astype(np.float64)
    raise ValueError(f"{type(value).__name__} is not a number")


def compare(case: Case, got: dict[str, Any], profile: Profile = "float64") -> Difference:
    """Compare an answer with the expected one, and with others that are as right."""
    tolerance = _tolerance(case, profile)
    first, kinds = RIGHT, functions()[case.function].outputs
    for number, expected in enumerate([case.expected, *case.accept]):
        found = _outputs(expected, got, tolerance, kinds)
        if found.right:
            return found
        first = found if number == 0 else first
    return first


def matches(answer: dict[str, Any], got: dict[str, Any], case: Case, profile: Profile = "float64") -> bool:
    """Whether an answer is that of a wrong formula, within ten times the tolerance."""
    relative, absolute = _tolerance(case, profile)
    kinds = functions()[case.function].outputs
    return _outputs(answer, got, (10 * relative, 10 * absolute), kinds).right


def _tolerance(case: Case, profile: Profile) -> tuple[float, float]:
    rule = case.tolerance if profile == "float64" else case.tolerance["float32"]
    return float(rule["relative"]), float(rule["absolute"])


def _outputs(
    expected: dict[str, Any], got: dict[str, Any], tolerance: tuple[float, float], kinds: Mapping[str, str]
) -> Difference:
    for name, value in expected.items():
        if name not in got:
            return Difference(False, name, None, value, float("inf"), 0.0)
        found = _value(name, *_prepared(kinds.get(name, "plain"), value, got[name]), tolerance)
        if not found.right:
            return found
    return RIGHT


def _prepared(kind: str, expected: Any, got: Any) -> tuple[Any, Any]:
    """What is compared: a set in the expected order, a quaternion of the expected sign, a table's numbers."""
    if kind == "poses":
        return expected, _in_order(expected, got)
    if kind == "quaternion":
        return expected, _same_side(expected, got)
    if kind == "table" and isinstance(expected, str) and isinstance(got, str):
        return _table(expected), _table(got)
    return expected, got


def _in_order(expected: Any, got: Any) -> Any:
    """Members of a set, each beside the nearest expected one that is still free."""
    try:
        want, have = numbers(expected), list(numbers(got))
    except ValueError:
        return got
    if want.ndim < 2 or len(have) != len(want) or any(member.shape != want.shape[1:] for member in have):
        return got
    return [have.pop(int(np.argmin([np.abs(member - x).max() for member in have]))) for x in want]


def _same_side(expected: Any, got: Any) -> Any:
    """A quaternion, or its negative where that is nearer to the expected one."""
    try:
        want, have = numbers(expected), numbers(got)
    except ValueError:
        return got
    if want.shape != have.shape or not np.isfinite(have).all():
        return got
    side = np.where(np.sum(want * have, axis=-1, keepdims=True) < 0, -1.0, 1.0)
    return side * have


def _table(text: str) -> list[list[float]] | str:
    """Rows of numbers of a text without its comments; the text itself where a word is not a number."""
    lines = (line.partition("#")[0].replace(",", " ").split() for line in text.splitlines())
    try:
        return [[float(word) for word in words] for words in lines if words]
    except ValueError:
        return text


def _value(where: str, expected: Any, got: Any, tolerance: tuple[float, float]) -> Difference:
    """Compare one output; of a list of records (a trace), the first that differs is reported."""
    if isinstance(expected, list) and expected and isinstance(expected[0], dict):
        if not isinstance(got, list) or len(got) != len(expected):
            length = len(got) if isinstance(got, list) else type(got).__name__
            return Difference(False, f"{where}: number of steps", length, len(expected), float("inf"), 0.0)
        for step, (want, have) in enumerate(zip(expected, got, strict=True)):
            if not isinstance(have, dict):
                return Difference(False, f"step {step}", have, want, float("inf"), 0.0)
            found = _outputs(want, have, tolerance, {})
            if not found.right:
                return found._replace(where=f"step {step}, {found.where}")
        return RIGHT
    if isinstance(expected, str) and expected not in WORDS:
        return RIGHT if got == expected else Difference(False, where, got, expected, float("inf"), 0.0)
    want = numbers(expected)
    try:
        have = numbers(got)
    except ValueError as error:
        return Difference(False, f"{where}: {error}", got, expected, float("inf"), 0.0)
    if want.shape != have.shape:
        shown = f"{where}: shape {list(have.shape)}, expected {list(want.shape)}"
        return Difference(False, shown, got, expected, float("inf"), 0.0)
    return _arrays(where, want, have, tolerance)


def _arrays(where: str, want: Array, have: Array, tolerance: tuple[float, float]) -> Difference:
    finite = np.isfinite(want)
    same_odd = bool(np.array_equal(want[~finite], have[~finite], equal_nan=True))
    if not same_odd or not np.isfinite(have[finite]).all():
        return Difference(False, where, have.tolist(), want.tolist(), float("inf"), 0.0)
    relative, absolute = tolerance
    # eq-vector-tolerance
    allowed = absolute + relative * float(np.abs(want[finite]).max(initial=0.0))
    size = float(np.abs(want - have)[finite].max(initial=0.0))
    if size <= allowed:
        return RIGHT
    return Difference(False, where, have.tolist(), want.tolist(), size, allowed)

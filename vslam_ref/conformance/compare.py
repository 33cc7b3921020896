"""Is an answer right?  Shape, finiteness, and distance in the norm of the largest entry.

There are three verdicts::

    |y^ - y|     0 ------- tolerance ---------- lost_digits ------------->
                  passed               lost digits              failed

"Lost digits" stands between the other two, where a formula in common use is right, and cancellation takes
digits that a user may not mind: an arc cosine near pi, 1 - (1 - u^2)^3 at tiny u.  It is the exception.
A case has it only if its tolerance has ``lost_digits``, with a reason of its own: the width is what that
formula loses.  An answer nearer to one of the case's known mistakes than to the right answer has failed, at
any distance.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.catalogue import functions
from vslam_ref.conformance.vectors_format import Case

Profile = Literal["float64", "float32"]
Verdict = Literal["passed", "lost digits", "failed"]
WORDS = {"nan": float("nan"), "inf": float("inf"), "-inf": float("-inf")}
MOST_DIGITS = 16.0
EPS = {"float64": 2.0**-52, "float32": 2.0**-23}
WORSE = ("passed", "lost digits", "failed")


class Difference(NamedTuple):
    """Whether an answer is right, and if not, where and by how much.

    Attributes
    ----------
    verdict : {"passed", "lost digits", "failed"}
    where : str
        Which output, and what about it; empty for a right answer.
    got, expected : object
    size, allowed : float
        Of that output: how far it is off, and how far it may be.
    digits : float
        Right digits of the worst output, 0 to 16: -log10 of its error over the size that the tolerance is
        relative to.  Right answers have them, too.
    """

    verdict: Verdict
    where: str
    got: Any
    expected: Any
    size: float
    allowed: float
    digits: float = 0.0

    @property
    def right(self) -> bool:
        """Whether the answer passes."""
        return self.verdict == "passed"


RIGHT = Difference("passed", "", None, None, 0.0, 0.0, MOST_DIGITS)


class Allowed(NamedTuple):
    """A tolerance of one profile, and the wider one within which only digits are lost."""

    relative: float
    absolute: float
    eps: float
    lost_relative: float = -1.0
    lost_absolute: float = 0.0

    def scale(self, largest: float) -> float:
        """What an error is relative to: the largest entry, and what the absolute part is a rounding of."""
        return largest + self.absolute / max(self.relative, self.eps)


def refused(where: str, got: Any, expected: Any) -> Difference:
    """An answer that no distance measures."""
    return Difference("failed", where, got, expected, float("inf"), 0.0)


def numbers(value: Any) -> Array:
    """Array of floats from nested lists, words for what is not finite included; truth values are 0 and 1.

    >>> numbers([1, "inf", True]).tolist()
    [1.0, inf, 1.0]
    """
    if isinstance(value, list | tuple):
        if (plain := _at_once(value)) is not None:
            return plain
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


def _at_once(value: list[Any] | tuple[Any, ...]) -> Array | None:
    """Array of nested lists that hold nothing but numbers and truth values; None for all others."""
    try:
        found = np.array(value)
    except (ValueError, OverflowError, RecursionError):
        return None
    return found.astype(np.float64) if found.dtype.kind in "fiub" else None


def compare(case: Case, got: dict[str, Any], profile: Profile = "float64") -> Difference:
    """Compare an answer with the expected one, and with others that are as right."""
    rule = rule_of(case, profile)
    kinds = functions()[case.function].outputs
    found = [_outputs(expected, got, rule, kinds) for expected in (case.expected, *case.accept)]
    best = min(found, key=lambda d: WORSE.index(d.verdict))  # the first of several
    if best.verdict == "lost digits" and _nearer_to_a_mistake(case, got, best, rule):
        return best._replace(verdict="failed")
    return best


def _nearer_to_a_mistake(case: Case, got: dict[str, Any], found: Difference, rule: Allowed) -> bool:
    """Whether a known wrong formula explains an answer better than lost digits do."""
    kinds = functions()[case.function].outputs
    strict = rule._replace(lost_relative=-1.0)
    return any(_outputs(wrong, got, strict, kinds).digits > found.digits for wrong in case.mistakes.values())


def matches(answer: dict[str, Any], got: dict[str, Any], case: Case, profile: Profile = "float64") -> bool:
    """Whether an answer is that of a wrong formula, within ten times the tolerance."""
    rule = rule_of(case, profile)
    rule = Allowed(10 * rule.relative, 10 * rule.absolute, rule.eps)
    return _outputs(answer, got, rule, functions()[case.function].outputs).right


def rule_of(case: Case, profile: Profile) -> Allowed:
    """The tolerance of a case in a profile."""
    given = case.tolerance if profile == "float64" else case.tolerance["float32"]
    rule = Allowed(float(given["relative"]), float(given["absolute"]), EPS[profile])
    lost = given.get("lost_digits")
    if lost is None:
        return rule
    return rule._replace(lost_relative=float(lost["relative"]), lost_absolute=float(lost["absolute"]))


def is_asked(case: Case, profile: Profile) -> bool:
    """Whether a case makes sense in a profile: single precision cannot hold all inputs."""
    return profile == "float64" or bool(case.tolerance["float32"].get("asked", True))


def _outputs(
    expected: Mapping[str, Any], got: Mapping[str, Any], rule: Allowed, kinds: Mapping[str, str]
) -> Difference:
    return _worst(
        _value(name, *_prepared(kinds.get(name, "plain"), value, got[name]), rule)
        if name in got
        else refused(name, None, value)
        for name, value in expected.items()
    )


def _worst(parts: Iterable[Difference]) -> Difference:
    """The first of the worst, with the fewest digits of all."""
    found = [RIGHT, *parts]
    worst = max(found, key=lambda d: WORSE.index(d.verdict))
    return worst._replace(digits=min(d.digits for d in found))


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


def _value(where: str, expected: Any, got: Any, rule: Allowed) -> Difference:
    """Compare one output; of a list of records (a trace), the first that differs is reported."""
    if isinstance(expected, list) and expected and isinstance(expected[0], dict):
        return _records(where, expected, got, rule)
    if isinstance(expected, str) and expected not in WORDS:
        return RIGHT if got == expected else refused(where, got, expected)
    want = numbers(expected)
    try:
        have = numbers(got)
    except ValueError as error:
        return refused(f"{where}: {error}", got, expected)
    if want.shape != have.shape:
        return refused(f"{where}: shape {list(have.shape)}, expected {list(want.shape)}", got, expected)
    return _arrays(where, want, have, rule)


def _records(where: str, expected: list[Any], got: Any, rule: Allowed) -> Difference:
    """Compare the steps of a trace."""
    if not isinstance(got, list) or len(got) != len(expected):
        length = len(got) if isinstance(got, list) else type(got).__name__
        return refused(f"{where}: number of steps", length, len(expected))
    found = []
    for step, (want, have) in enumerate(zip(expected, got, strict=True)):
        if not isinstance(have, dict):
            return refused(f"step {step}", have, want)
        one = _outputs(want, have, rule, {})
        found.append(one if one.right else one._replace(where=f"step {step}, {one.where}"))
    return _worst(found)


def _arrays(where: str, want: Array, have: Array, rule: Allowed) -> Difference:
    finite = np.isfinite(want)
    same_odd = bool(np.array_equal(want[~finite], have[~finite], equal_nan=True))
    if not same_odd or not np.isfinite(have[finite]).all():
        return refused(where, have.tolist(), want.tolist())
    largest = float(np.abs(want[finite]).max(initial=0.0))
    # eq-vector-tolerance
    allowed = rule.absolute + rule.relative * largest
    size = float(np.abs(want - have)[finite].max(initial=0.0))
    digits = _digits(size, rule.scale(largest))
    if size <= allowed:
        return RIGHT._replace(digits=digits)
    lost = size <= rule.lost_absolute + rule.lost_relative * largest
    verdict: Verdict = "lost digits" if lost else "failed"
    return Difference(verdict, where, have.tolist(), want.tolist(), size, allowed, digits)


def _digits(size: float, scale: float) -> float:
    """Right decimal digits of a number of a size, 0 to 16.

    >>> _digits(1e-12, 1.0), _digits(0.0, 1.0), _digits(5.0, 1.0)
    (12.0, 16.0, 0.0)
    """
    if size == 0.0:
        return MOST_DIGITS
    if scale == 0.0:
        return 0.0
    return float(min(MOST_DIGITS, max(0.0, np.log10(scale) - np.log10(size))))

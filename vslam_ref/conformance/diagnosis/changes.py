"""An input is taken in another way: negated, transposed, in degrees, exchanged, left out.

Where the change can be undone, the program is asked once more with the changed input, and must then be right.
Where it cannot (an input is ignored, only the first row is used), the library says what such a program
answers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations, permutations
from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.diagnosis.evidence import Answer, Evidence, Guess, array, outputs
from vslam_ref.conformance.vectors_format import Case

Change = Callable[[dict[str, Any]], dict[str, Any]]

UNDONE: dict[str, Callable[[Array], Any]] = {
    "is taken with the other sign": lambda x: -x,
    "is taken transposed": lambda x: _square(np.swapaxes(x, -1, -2)),
    "is taken inverted": lambda x: np.linalg.inv(x) if x.ndim >= 2 else 1.0 / x,
    "is taken in degrees": np.degrees,
    "is turned into degrees": np.radians,
    "is taken squared": np.sqrt,
    "is taken without its square root": np.square,
    "is taken in the reversed order": lambda x: _rows(x, 1)[::-1],
    "is taken with columns for rows": lambda x: _rows(x, 2)[..., ::-1],
    "is taken with its halves exchanged": lambda x: np.roll(x, x.shape[-1] // 2, -1),
    "is taken twice as large": lambda x: 0.5 * x,
    "is taken half as large": lambda x: 2.0 * x,
    "is taken with w last": lambda x: x[..., [1, 2, 3, 0]],
    "is taken conjugated": lambda x: x * [1, -1, -1, -1],
}
"""What the program does to an input -> the change that undoes it."""

LOST: dict[str, Callable[[Array], Any]] = {
    "is left out (as if it were zero)": np.zeros_like,
    "is left out (as if it were one)": np.ones_like,
    "is left out (as if it were the identity)": lambda x: np.broadcast_to(
        np.eye(x.shape[-1]), _square(x).shape
    ),
    "is used by its diagonal only": lambda x: _square(x) * np.eye(x.shape[-1]),
    "is used by its size, without its sign": np.abs,
    "is used up to the last": lambda x: _rows(x, 1)[:-1],
    "is used from the second on": lambda x: _rows(x, 1)[1:],
    "is used by its first row for all": lambda x: np.broadcast_to(_rows(x, 2)[0], x.shape),
    "is cut to whole numbers": np.trunc,
    "is rounded to whole numbers": np.round,
    "is rounded down to whole numbers": np.floor,
    "is rounded to single precision": lambda x: x.astype(np.float32).astype(np.float64),
    "is brought to unit length first": lambda x: x / np.linalg.norm(x, axis=-1, keepdims=True),
}
"""What the program does to an input, where it cannot be undone."""
MOST_ENTRIES = 12
LARGER = 100.0
"""No input is made larger than by this factor: a program may count up to it."""


def _square(x: Array) -> Array:
    if x.ndim < 2 or x.shape[-1] != x.shape[-2]:
        raise ValueError("no square matrix")
    return x


def _rows(x: Array, dimensions: int) -> Array:
    if x.ndim < dimensions or len(x) < 2:
        raise ValueError("no rows")
    return x


def undone(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """Repairs: the program is asked with a changed input."""
    names = list(evidence.function.inputs)
    for name in names:
        for words, change in UNDONE.items():
            yield f"the input {name} {words}", _asked(evidence, on(name, change))
        yield from _entries(evidence, name)
    for a, b in combinations(names, 2):
        yield f"the inputs {a} and {b} are exchanged", _asked(evidence, _both(a, b, back=True))


def _entries(evidence: Evidence, name: str) -> Iterator[tuple[str, Guess]]:
    """One entry of a short input: its sign, its unit; two exchanged."""
    size = short(evidence, name)
    for k in range(size):
        what = f"entry {k} of the input {name} is"
        yield f"{what} taken with the other sign", _asked(evidence, on(name, entry(k, np.negative)))
        yield f"{what} taken in degrees", _asked(evidence, on(name, entry(k, np.degrees)))
        yield f"{what} turned into degrees", _asked(evidence, on(name, entry(k, np.radians)))
    for j, k in combinations(range(size), 2):
        words = f"entries {j} and {k} of the input {name} are exchanged"
        yield words, _asked(evidence, on(name, _moved([j, k], [k, j])))


def short(evidence: Evidence, name: str) -> int:
    """Number of entries of a short list of numbers, else 0."""
    x = array(evidence.failed[0].case.inputs.get(name))
    return x.size if x is not None and x.ndim == 1 and 2 <= x.size <= MOST_ENTRIES else 0


def lost(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """Wrong formulas: the library's answer where an input, or an entry of one, is lost or changed."""
    names = list(evidence.function.inputs)
    for name in names:
        for words, change in LOST.items():
            yield f"the input {name} {words}", reference(evidence, on(name, change))
        size = short(evidence, name)
        for k in range(size):
            words = f"entry {k} of the input {name} is left out (as if it were zero)"
            yield words, reference(evidence, on(name, entry(k, np.zeros_like)))
        for j, k in permutations(range(min(6, size)), 2):
            words = f"entry {j} of the input {name} is used for entry {k}"
            yield words, reference(evidence, on(name, _moved([j], [k])))
    yield from _cut_together(evidence)
    for words, change in UNDONE.items():
        for name in names:
            yield f"the input {name} {words}", reference(evidence, on(name, UNDOES.get(words, change)))
    for a, b in permutations(names, 2):
        yield f"{a} is used for {b}", reference(evidence, _both(a, b, back=False))


CUTS = {
    "only the first is used": slice(1),
    "only the last is used": slice(-1, None),
    "the last is left out": slice(-1),
    "the first is left out": slice(1, None),
}


def _cut_together(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """Only the first of several sightings, views or points, or all but one: lists of one length together."""
    several = max((seen.case.inputs for seen in evidence.failed), key=_rows_in_all)
    lengths = {name: len(value) for name, value in several.items() if isinstance(value, list)}
    for length in sorted(set(lengths.values())):
        names = [name for name, n in lengths.items() if n == length]
        for words, part in CUTS.items():
            yield f"of {', '.join(names)} {words}", reference(evidence, _cut(names, part))


def _rows_in_all(given: dict[str, Any]) -> int:
    return sum(len(value) for value in given.values() if isinstance(value, list))


def _cut(names: list[str], part: slice) -> Change:
    def changed(given: dict[str, Any]) -> dict[str, Any]:
        if len({len(given[name]) for name in names}) != 1:
            raise ValueError("not alike")
        if len(given[names[0]]) < 2:
            raise ValueError("no change")
        return {**given, **{name: given[name][part] for name in names}}

    return changed


def echoes(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """An input given back as an answer."""
    for name in evidence.function.outputs:
        for given in evidence.function.inputs:
            yield f"{name} is the input {given}, unchanged", _echo(name, given)


def _echo(name: str, given: str) -> Guess:
    def formula(case: Case, got: Answer) -> Answer | None:
        return {**case.expected, name: case.inputs[given]}

    return formula


UNDOES: dict[str, Callable[[Array], Any]] = {
    "is taken in degrees": np.radians,
    "is turned into degrees": np.degrees,
    "is taken squared": np.square,
    "is taken without its square root": np.sqrt,
    "is taken twice as large": lambda x: 2.0 * x,
    "is taken half as large": lambda x: 0.5 * x,
    "is taken with w last": lambda x: x[..., [3, 0, 1, 2]],
}
"""The changes that are not their own way back, as the program makes them."""


def entry(k: int, change: Callable[[Array], Any]) -> Callable[[Array], Any]:
    """A change of one entry of a list of numbers."""

    def changed(x: Array) -> Array:
        out = x.copy()
        out[..., k] = change(out[..., k])
        return out

    return changed


def _moved(where: list[int], whence: list[int]) -> Callable[[Array], Any]:
    """Entries ``whence`` become those that stand at ``where``."""

    def changed(x: Array) -> Array:
        out = x.copy()
        out[..., whence] = x[..., where]
        return out

    return changed


def on(name: str, change: Callable[[Array], Any]) -> Change:
    """A question with one input changed; ValueError where that makes no sense, or no change."""

    def changed(given: dict[str, Any]) -> dict[str, Any]:
        x = array(given[name])
        if x is None or isinstance(given[name], bool):
            raise ValueError(f"{name} is no array of numbers")
        with np.errstate(all="ignore"):
            other = np.asarray(change(x))
        if np.abs(other).max(initial=0.0) > LARGER * max(1.0, float(np.abs(x).max(initial=0.0))):
            raise ValueError("a loop over so many would not end")
        if not np.isfinite(other).all() or (other.shape == x.shape and np.array_equal(other, x)):
            raise ValueError("no change")
        return {**given, name: other.tolist()}

    return changed


def _both(a: str, b: str, *, back: bool) -> Change:
    """Input a in the place of b, and on demand b in that of a."""

    def changed(given: dict[str, Any]) -> dict[str, Any]:
        words = any(isinstance(given[name], str | bool) for name in (a, b))
        if words or np.shape(given[a]) != np.shape(given[b]):
            raise ValueError("not alike")
        if given[a] == given[b]:
            raise ValueError("no change")
        return {**given, b: given[a], **({a: given[b]} if back else {})}

    return changed


FAILURES = (
    *(ValueError, TypeError, KeyError, IndexError, ArithmeticError, AttributeError),
    np.linalg.LinAlgError,
)


def _asked(evidence: Evidence, change: Change) -> Guess:
    """The program's answer to the changed question; its answer as it was where nothing changes."""

    def repair(case: Case, got: Answer) -> Answer | None:
        try:
            given = change(case.inputs)
        except ValueError as error:
            return got if str(error) == "no change" else None
        except FAILURES:
            return None
        return outputs(evidence.ask(evidence.function.name, given), evidence.function)

    return repair


def reference(evidence: Evidence, change: Change) -> Guess:
    """The library's answer to the changed question; the right one where nothing changes."""

    def formula(case: Case, got: Answer) -> Answer | None:
        try:
            given = change(case.inputs)
        except ValueError as error:
            return case.expected if str(error) == "no change" else None
        except FAILURES:
            return None
        return library(evidence, given)

    return formula


def library(evidence: Evidence, given: dict[str, Any]) -> Answer | None:
    """What this library answers, or None."""
    from vslam_ref.conformance.adapters import itself

    try:
        with np.errstate(all="ignore"):
            return outputs(itself.answer(evidence.function.name, given), evidence.function)
    except Exception:  # a question that makes no sense any more
        return None

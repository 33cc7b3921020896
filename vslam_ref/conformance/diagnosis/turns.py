# ruff: noqa: E501
"""Answers turned back: a sign, a transpose, an order, a unit, a factor, signs of entries.

Each is a repair: it turns a wrong answer into the right one, for every case of a function in the same way.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from itertools import permutations
from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.diagnosis.evidence import Answer, Evidence, Guess, array, spread
from vslam_ref.conformance.vectors_format import Case

TURNS: dict[str, Callable[[Array], Any]] = {
    "the sign is flipped": lambda x: -x,
    "the matrix is transposed, or column by column": lambda x: np.swapaxes(x, -1, -2),
    "it is the inverse": np.linalg.inv,
    "it is the inverse, transposed": lambda x: np.swapaxes(np.linalg.inv(x), -1, -2),
    "the rotation's part is transposed": lambda x: _part(x, 3, transposed=True),
    "the translation's sign is flipped": lambda x: _part(x, 3, sign=-1.0),
    "the two halves are exchanged": lambda x: np.roll(x, x.shape[-1] // 2, -1),
    "the order is reversed": lambda x: x[::-1],
    "the columns are in the reversed order": lambda x: x[..., ::-1],
    "the rows are in the reversed order": lambda x: x[..., ::-1, :],
    "the quaternion has w last": lambda x: _four(x)[..., [3, 0, 1, 2]],
    "the quaternion is conjugated": lambda x: _four(x) * [1, -1, -1, -1],
    "degrees are given for radians": np.radians,
    "radians are given for degrees": np.degrees,
    "the square is given": np.sqrt,
    "the square with its sign is given": lambda x: np.sign(x) * np.sqrt(np.abs(x)),
    "the square root is given": lambda x: x * x,
    "the reciprocal is given": lambda x: 1.0 / x,
    "the reciprocal's square root is given": lambda x: 1.0 / x**2,
    "the cube is given": np.cbrt,
    "the logarithm is given": np.exp,
    "the exponential is given": np.log,
    "one minus the right value is given": lambda x: 1.0 - x,
    "it is one too large": lambda x: x - 1.0,
    "it is one too small": lambda x: x + 1.0,
    "half a pixel is added": lambda x: x - 0.5,
    "half a pixel is missing": lambda x: x + 0.5,
    "only whole turns differ: the angle is not wrapped into (-pi, pi]": lambda x: (
        np.pi - (np.pi - x) % (2 * np.pi)
    ),
    "the last number is an angle that is not wrapped into (-pi, pi]": lambda x: _wrapped_last(x),
    "the third number is an angle that is not wrapped into (-pi, pi]": lambda x: _wrapped_third(x),
    "the long way round: the angle is beyond pi": lambda x: _short_way(x),
    "not of unit length": lambda x: x / np.linalg.norm(x, axis=-1, keepdims=True),
    "not a rotation by its scale": lambda x: x / np.cbrt(np.linalg.det(x))[..., None, None],
    "the rows come one after another, not as a matrix": lambda x: x.reshape(int(x.size**0.5), -1),
    "it stands in a list of its own": lambda x: x[0] if x.shape[:1] == (1,) else x[:0],
    "it is a column": lambda x: x[..., 0] if x.shape[-1:] == (1,) else x[:0],
    "truth is taken for falsehood": lambda x: np.where((x == 0) | (x == 1), 1 - x, np.nan),
}
"""What is wrong -> what puts it right."""


def _part(x: Array, n: int, *, transposed: bool = False, sign: float = 1.0) -> Array:
    if x.shape[-2:] != (n + 1, n + 1):
        raise ValueError("no rigid motion")
    out = x.copy()
    out[..., :n, n] *= sign
    if transposed:
        out[..., :n, :n] = np.swapaxes(x[..., :n, :n], -1, -2)
    return out


def _short_way(x: Array) -> Array:
    size = float(np.linalg.norm(x[-3:]))
    if x.shape != (3,) or size <= np.pi:
        raise ValueError("no long way")
    return x * (1 - 2 * np.pi / size)


def _four(x: Array) -> Array:
    if x.shape[-1] != 4:
        raise ValueError("no quaternion")
    return x


def _wrap(x: Any) -> Any:
    return np.pi - (np.pi - x) % (2 * np.pi)


def _wrapped_last(x: Array) -> Array:
    out = x.copy()
    out[..., -1] = _wrap(out[..., -1])
    return out


def _wrapped_third(x: Array) -> Array:
    out = x.copy()
    out[2] = _wrap(out[2])
    return out


def on_output(name: str, turn: Callable[[Array], Any]) -> Guess:
    """The repair that turns one output."""

    def repair(case: Case, got: Answer) -> Answer | None:
        x = array(got.get(name))
        if x is None:
            return None
        try:
            with np.errstate(all="ignore"):
                return {**got, name: np.asarray(turn(x)).tolist()}
        except (ValueError, IndexError, TypeError, np.linalg.LinAlgError):
            return None

    return repair


def turns(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """Repairs of each output: turned, multiplied, reordered, signs of entries."""
    for name in evidence.function.outputs:
        head = f"{name}: " if len(evidence.function.outputs) > 1 else ""
        for sentence, turn in TURNS.items():
            yield head + sentence, on_output(name, turn)
        pairs = both(evidence, name)
        if pairs:
            yield from ((head + text, on_output(name, turn)) for text, turn in _fitted(pairs))
    if len(evidence.function.outputs) == 2:
        a, b = evidence.function.outputs
        yield f"{a} and {b} are exchanged", lambda case, got: {a: got.get(b), b: got.get(a)}


def both(evidence: Evidence, name: str, most: int = 12) -> list[tuple[Array, Array]]:
    """An output of failed cases and what it should be, where both are finite numbers of one shape."""
    found = []
    for seen in spread(evidence.failed, most):
        want, have = array(seen.case.expected.get(name)), array(seen.got.get(name))
        if want is not None and have is not None and want.shape == have.shape:
            if evidence.function.outputs[name] == "quaternion" and np.vdot(want, have) < 0:
                have = -have
            if np.isfinite(want).all() and np.isfinite(have).all():
                found.append((want, have))
    return found


def _fitted(pairs: list[tuple[Array, Array]]) -> Iterator[tuple[str, Callable[[Array], Any]]]:
    """Repairs whose numbers are read off the failed cases."""
    ratios = np.array([np.vdot(w, h) / np.vdot(h, h) for w, h in pairs if np.vdot(h, h) > 0])
    if ratios.size and np.ptp(ratios) < 1e-6 * abs(ratios[0]):
        factor = float(np.median(ratios))
        if len(pairs) > 1 and abs(factor - 1) > 1e-9:
            yield f"a constant factor: {_called(1 / factor)} times the right value", lambda x: factor * x
    shapes = {w.shape for w, _ in pairs}
    if len(shapes) != 1 or len(pairs) < 2:
        return
    want, have = (np.array(part) for part in zip(*pairs, strict=True))
    (shape,) = shapes
    offset = (want - have).mean(axis=0)
    scale = np.abs(want).max()
    if np.abs(want - have - offset).max() < 1e-9 * scale and np.abs(offset).max() > 1e-6 * scale:
        yield f"a constant is added: {_short(-offset)}", lambda x: x + offset
    same, other = (np.abs(want - s * have).max(axis=0) < 1e-6 * scale for s in (1, -1))
    if (same | other).all() and not same.all():
        signs = np.where(same, 1.0, -1.0)
        yield f"the sign of {places(~same)} is flipped", lambda x: signs * x
    if shape in ((2,), (3,), (4,)):
        for order in permutations(range(shape[0])):
            if list(order) != sorted(order):
                yield f"the numbers are in another order: {_order(order)}", _ordered(order)


def _ordered(order: tuple[int, ...]) -> Callable[[Array], Any]:
    return lambda x: x[list(order)]


FORWARD: dict[str, Callable[[Array], Any]] = {
    "the square of the right value": lambda x: x * x,
    "the cube of the right value": lambda x: x**3,
    "the absolute value: its sign is lost": np.abs,
    "negative values are cut off at zero": lambda x: np.maximum(x, 0.0),
    "the right value cut to a whole number": np.trunc,
    "the right value rounded to a whole number": np.round,
    "the right value rounded down": np.floor,
    "each angle is brought into [0, 2 pi)": lambda x: np.mod(x, 2 * np.pi),
    "of unit length": lambda x: x / np.linalg.norm(x, axis=-1, keepdims=True),
    "only the diagonal is right, the rest is zero": lambda x: x * np.eye(*x.shape[-2:]),
    "the upper triangle is left at zero": np.tril,
    "the lower triangle is left at zero": np.triu,
    **{f"rounded to {k} decimals": functools.partial(np.round, decimals=k) for k in range(2, 13)},
}
"""What is given in place of the right value, where it cannot be turned back."""


def forward(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """Wrong formulas: each output replaced by something that is made of the right one."""
    for name in evidence.function.outputs:
        head = f"{name}: " if len(evidence.function.outputs) > 1 else ""
        for sentence, change in FORWARD.items():
            yield head + sentence, _made(name, change)


def _made(name: str, change: Callable[[Array], Any]) -> Guess:
    def formula(case: Case, got: Answer) -> Answer | None:
        x = array(case.expected.get(name))
        if x is None:
            return None
        try:
            with np.errstate(all="ignore"):
                return {**case.expected, name: np.asarray(change(x)).tolist()}
        except (ValueError, IndexError, TypeError, np.linalg.LinAlgError):
            return None

    return formula


POWERS = {1.0: "multiplied by {}", -1.0: "divided by {}", 2.0: "multiplied by {}^2", -2.0: "divided by {}^2", 0.5: "multiplied by the root of {}", -0.5: "divided by the root of {}"}  # fmt: skip


def scaled(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """Repairs: an output divided or multiplied by a number of the inputs, or by how many there are."""
    rows = [dict(numbers_of(seen.case)) for seen in spread(evidence.failed, 12)]
    for name in evidence.function.outputs:
        head = f"{name}: " if len(evidence.function.outputs) > 1 else ""
        pairs = both(evidence, name)
        ratios = np.array([np.vdot(w, h) / np.vdot(w, w) if np.vdot(w, w) > 0 else np.nan for w, h in pairs])
        if (
            len(pairs) != len(rows)
            or len(pairs) < 3
            or not np.isfinite(ratios).all()
            or np.ptp(ratios) < 1e-9
        ):
            continue
        for feature in rows[0]:
            values = np.array([row.get(feature, np.nan) for row in rows])
            for power, words in POWERS.items():
                with np.errstate(all="ignore"):
                    expected = np.sign(values) * np.abs(values) ** power
                if np.isfinite(expected).all() and np.allclose(ratios, expected, rtol=1e-6, atol=0.0):
                    yield head + words.format(feature), on_case(name, feature, power)


def on_case(name: str, feature: str, power: float) -> Guess:
    """The repair that undoes a factor of the inputs."""

    def repair(case: Case, got: Answer) -> Answer | None:
        x, value = array(got.get(name)), dict(numbers_of(case)).get(feature, 0.0)
        if x is None or value == 0.0:
            return None
        return {**got, name: (x / (np.sign(value) * abs(value) ** power)).tolist()}

    return repair


def numbers_of(case: Case) -> Iterator[tuple[str, float]]:
    """Numbers that tell a case from others: counts, sizes, angles, and single numbers of its inputs."""
    for name, value in case.inputs.items():
        x = array(value)
        if x is None or not np.isfinite(x).all():
            if isinstance(value, list):
                yield f"the number of {name}", float(len(value))
            continue
        if x.ndim:
            yield f"the number of rows of {name}", float(len(x))
        if x.ndim >= 2 and x.shape[-2:] in ((3, 3), (4, 4)):
            yield f"the angle of {name}", _angle(x.reshape(-1, *x.shape[-2:])[0])
        if x.ndim == 0:
            yield f"|{name}|", abs(float(x))
            yield name, float(x)
        elif x.ndim == 1:
            yield f"the length of {name}", float(np.linalg.norm(x))
            yield from ((f"|{name}[{k}]|", abs(float(v))) for k, v in enumerate(x[:6]))
            yield from ((f"{name}[{k}]", float(v)) for k, v in enumerate(x[:6]))
            if x.size in (6, 7):
                yield f"the angle of {name}", float(np.linalg.norm(x[3:6]))


def _angle(M: Array) -> float:
    R = M[:3, :3]
    sine = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    return float(np.arctan2(np.linalg.norm(sine), (np.trace(R) - 1) / 2))


def _order(order: tuple[int, ...]) -> str:
    """Where the right numbers stand."""
    return ", ".join(str(k) for k in np.argsort(order))


KNOWN = {
    "2": 2.0, "1/2": 0.5, "3": 3.0, "1/3": 1 / 3, "4": 4.0, "1/4": 0.25, "6": 6.0, "1/6": 1 / 6, "pi": np.pi, "-1": -1.0,
    "180/pi": 180 / np.pi, "pi/180": np.pi / 180, "sqrt(2)": 2**0.5, "1/sqrt(2)": 0.5**0.5, "-2": -2.0, "-1/2": -0.5,
    "ln 10": np.log(10), "1/ln 10": 1 / np.log(10), "1/ln 2": 1 / np.log(2), "1.4826": 1.482602218505602,
    "1/1.4826": 1 / 1.482602218505602,
}  # fmt: skip
"""Factors that have a name."""


def _called(factor: float) -> str:
    return next((name for name, x in KNOWN.items() if abs(x - factor) < 1e-7 * abs(x)), f"{factor:.6g}")


def _short(x: Array) -> str:
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

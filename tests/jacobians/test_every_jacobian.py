"""Every ``*_with_jacobians`` of the package has a numeric check, away from identity.

The rows stand beside the tests of their room, in ``tests/<room>/jacobian_checks.py``: ``CHECKS`` maps the
full name of a function to a list of rows, each a dictionary with the fields of :class:`Check`.  The
meta-test walks the package: a function without a row fails it, and so does a Jacobian that no row looks at.
"""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, NamedTuple

import numpy as np
import pytest

import vslam_ref
from vslam_ref.geometry import so2
from vslam_ref.testing import check_jacobian

Array = np.ndarray
EPS = float(np.finfo(float).eps)


class Check(NamedTuple):
    """Arguments and, for each, the field that holds the Jacobian in it; None: no Jacobian."""

    arguments: tuple[Any, ...]
    fields: tuple[str | None, ...]
    constants: Mapping[str, Any] = MappingProxyType({})
    angle: int | None = None  # index of an output that is an angle
    groups: tuple[ModuleType | None, ...] = ()  # for each argument: its group, perturbed from the left
    output: ModuleType | None = None  # group of the value, compared by left perturbations

    def group(self, k: int) -> ModuleType | None:
        return self.groups[k] if self.groups else None


def collected_rows() -> dict[str, list[Check]]:
    """The rows of all rooms; one function has its rows in one file."""
    found: dict[str, list[Check]] = {}
    for path in sorted(Path(__file__).resolve().parents[1].glob("*/jacobian_checks.py")):
        spec = importlib.util.spec_from_file_location(f"rows_{path.parent.name}", path)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        assert not set(found) & set(module.CHECKS), path
        found |= {name: [Check(**row) for row in rows] for name, rows in module.CHECKS.items()}
    return found


CHECKS = collected_rows()


def modules() -> Iterator[Any]:
    """All modules of the package that can be imported here; twins need no second check."""
    for info in pkgutil.walk_packages(vslam_ref.__path__, "vslam_ref."):
        if not info.name.startswith("vslam_ref._kernels") and not info.name.endswith("__main__"):
            yield importlib.import_module(info.name)


def found_functions() -> dict[str, Callable[..., Any]]:
    return {
        f"{module.__name__}.{name}": thing
        for module in modules()
        for name, thing in vars(module).items()
        if name.endswith("_with_jacobians") and getattr(thing, "__module__", None) == module.__name__
    }


def unchecked(found: dict[str, Callable[..., Any]], checks: dict[str, list[Check]]) -> set[str]:
    return set(found) - set(checks)


def test_every_function_with_jacobians_is_checked() -> None:
    found = found_functions()
    assert len(found) >= 24
    assert unchecked(found, CHECKS) == set()
    assert set(CHECKS) <= set(found), "a row for a function that is gone"


def test_the_meta_test_finds_a_missing_row() -> None:
    fewer = dict(list(CHECKS.items())[1:])
    assert unchecked(found_functions(), fewer) == {next(iter(CHECKS))}


@pytest.mark.parametrize("name", CHECKS)
def test_every_jacobian_field_is_looked_at(name: str) -> None:
    check = CHECKS[name][0]
    value = found_functions()[name](*check.arguments, **check.constants)
    assert {field for field in value._fields if field.startswith("J_")} == {f for f in check.fields if f}


CASES = [
    pytest.param(n, c, id=f"{'.'.join(n.split('.')[-2:])}-{i}")
    for n, cs in CHECKS.items()
    for i, c in enumerate(cs)
]


@pytest.mark.parametrize(("name", "check"), CASES)
def test_jacobian_is_the_derivative(name: str, check: Check) -> None:
    module, _, function = name.rpartition(".")
    room = importlib.import_module(module)
    with_jacobians, plain = getattr(room, function), getattr(room, function.removesuffix("_with_jacobians"))
    result = with_jacobians(*check.arguments, **check.constants)
    # two ways to compute one value: some eps of the largest number that enters
    size = max(np.abs(a).max() for a in check.arguments if isinstance(a, np.ndarray))
    value = plainly(plain, check)
    np.testing.assert_allclose(result[0], value, rtol=0, atol=8 * EPS * size)
    # where a group element comes out, what is differentiated is as small as the step, but made of products
    # of two matrices: 20 roundings of such a product (the check multiplies by 4) relative to the step
    roundings = int(5 * max(size, np.abs(value).max()) ** 2 / EPS ** (1 / 7)) if check.output else 100
    for k, field in enumerate(check.fields):
        if field is None:
            continue
        function_of_one, at = one_argument(plain, check, k, value)
        J = getattr(result, field)
        checked = check_jacobian(function_of_one, at, J, difference=subtraction(check), roundings=roundings)
        # the check is sharp: a sign flip of the largest entry is seen
        i, j = np.unravel_index(np.argmax(np.abs(J)), J.shape)
        assert checked.tolerance[i, j] < 1e-7 * np.abs(J[i, j])


def plainly(plain: Callable[..., Any], check: Check, *arguments: Any) -> Array:
    """The value alone, of the check's arguments or of others."""
    result = plain(*(arguments or check.arguments), **check.constants)
    return np.asarray(result[0] if isinstance(result, tuple) else result)


def one_argument(
    plain: Callable[..., Any], check: Check, k: int, value: Array
) -> tuple[Callable[[Array], Array], Array]:
    """The function of argument k alone, and where to differentiate it.

    A group element is moved from the left by a tangent vector, from zero; a group element that comes out is
    told by its logarithm relative to ``value``, from the left.
    """
    group, output = check.group(k), check.output

    def of_one(v: Array) -> Array:
        moved = v if group is None else group.perturb(check.arguments[k], v)
        arguments = [*check.arguments[:k], moved, *check.arguments[k + 1 :]]
        new = plainly(plain, check, *arguments)
        return new if output is None else output.log(output.compose(new, output.inverse(value)))

    return of_one, check.arguments[k] if group is None else np.zeros(group.DOF)


def subtraction(check: Check) -> Callable[[Array, Array], Array] | None:
    """Difference of two values that contain an angle."""
    if check.angle is None:
        return None
    angle = check.angle

    def subtract(a: Array, b: Array) -> Array:
        d = a - b
        d[angle] = so2.wrap(d[angle])
        return d

    return subtract


@pytest.mark.parametrize("name", CHECKS)
@pytest.mark.parametrize("batch", [(), (1,), (3, 1, 2)])
def test_batches_are_the_single_results(name: str, batch: tuple[int, ...]) -> None:
    check, function = CHECKS[name][0], found_functions()[name]
    single = function(*check.arguments, **check.constants)
    many = function(
        *[
            np.broadcast_to(a, (*batch, *a.shape)) if isinstance(a, np.ndarray) else a
            for a in check.arguments
        ],
        **check.constants,
    )
    for one, all_of_them in zip(single, many, strict=True):
        assert all_of_them.shape == (*batch, *one.shape)
        # vectorised and scalar sin, cos may differ in the last bit; sums of products in the last four
        np.testing.assert_allclose(
            all_of_them,
            np.broadcast_to(one, all_of_them.shape),
            rtol=1e-15,
            atol=16 * EPS * max(1, np.abs(one).max()),
        )

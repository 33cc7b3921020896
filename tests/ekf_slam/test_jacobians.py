"""Every ``*_with_jacobians`` of the package has a numeric check here, away from identity.

The meta-test walks the package: a new function without a row in ``CHECKS`` fails it, and so does a
Jacobian that no row looks at.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pytest

import vslam_ref
from vslam_ref.geometry import so2
from vslam_ref.testing import check_jacobian

Array = np.ndarray


class Check(NamedTuple):
    """Arguments (arrays) and, for each, the field that holds the Jacobian in it; None: no Jacobian."""

    arguments: tuple[Array, ...]
    fields: tuple[str | None, ...]
    constants: Mapping[str, float] = MappingProxyType({})
    angle: int | None = None  # index of an output that is an angle


POSES = (np.array([1.3, -2.1, 0.7]), np.array([-40.0, 3.0, -2.9]), np.array([0.2, 0.1, np.pi - 1e-4]))
CHECKS: dict[str, list[Check]] = {
    "vslam_ref.filters.vehicle.ackermann_with_jacobians": [
        Check((np.array(u),), ("J_control",), {"wheelbase": 2.7, "dt": 0.13})
        for u in ([1.2, 0.4], [-0.8, -1.1], [5.0, 1e-9])
    ],
    "vslam_ref.filters.vehicle.propagate_with_jacobians": [
        Check((pose, np.array(u)), ("J_pose", "J_increment"), angle=2)
        for pose in POSES
        for u in ([0.6, 0.2], [-3.0, -1.4])
    ],
    "vslam_ref.filters.observation.vehicle_from_world_with_jacobians": [
        Check((pose, np.array([4.2, -1.9])), ("J_pose", "J_landmark")) for pose in POSES
    ],
    "vslam_ref.filters.observation.world_from_vehicle_with_jacobians": [
        Check((pose, np.array([3.1, 2.4])), ("J_pose", "J_measurement")) for pose in POSES
    ],
}


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
    assert len(found) >= 4
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
    pytest.param(n, c, id=f"{n.rpartition('.')[2]}-{i}") for n, cs in CHECKS.items() for i, c in enumerate(cs)
]


@pytest.mark.parametrize(("name", "check"), CASES)
def test_jacobian_is_the_derivative(name: str, check: Check) -> None:
    module, _, function = name.rpartition(".")
    room = importlib.import_module(module)
    with_jacobians, plain = getattr(room, function), getattr(room, function.removesuffix("_with_jacobians"))
    result = with_jacobians(*check.arguments, **check.constants)
    # two ways to compute one value: some eps of the largest number that enters
    size = max(np.abs(a).max() for a in check.arguments)
    value = plain(*check.arguments, **check.constants)
    np.testing.assert_allclose(result.value, value, rtol=0, atol=8 * np.finfo(float).eps * size)

    def subtract(a: Array, b: Array) -> Array:
        d = a - b
        d[check.angle] = so2.wrap(d[check.angle])
        return d

    for k, field in enumerate(check.fields):
        if field is None:
            continue

        def of_one(v: Array, k: int = k) -> Array:
            arguments = [*check.arguments[:k], v, *check.arguments[k + 1 :]]
            return plain(*arguments, **check.constants)

        difference = subtract if check.angle is not None else None
        J = getattr(result, field)
        checked = check_jacobian(of_one, check.arguments[k], J, difference=difference)
        # the check is sharp: a sign flip of the largest entry is seen
        i, j = np.unravel_index(np.argmax(np.abs(J)), J.shape)
        assert checked.tolerance[i, j] < 1e-7 * np.abs(J[i, j])


@pytest.mark.parametrize("name", CHECKS)
@pytest.mark.parametrize("batch", [(), (1,), (3, 1, 2)])
def test_batches_are_the_single_results(name: str, batch: tuple[int, ...]) -> None:
    check, function = CHECKS[name][0], found_functions()[name]
    single = function(*check.arguments, **check.constants)
    many = function(*[np.broadcast_to(a, (*batch, *a.shape)) for a in check.arguments], **check.constants)
    for one, all_of_them in zip(single, many, strict=True):
        assert all_of_them.shape == (*batch, *one.shape)
        # vectorised and scalar sin, cos may differ in the last bit
        np.testing.assert_allclose(
            all_of_them, np.broadcast_to(one, all_of_them.shape), rtol=1e-15, atol=1e-15
        )

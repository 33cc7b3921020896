"""Every choice that may be declared: a right program of that convention passes with it, and fails without."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable
from types import ModuleType
from typing import Any, get_args, get_type_hints

import numpy as np
import plain_motions as motions
import plain_two_views
import pytest
from plain_views import PROGRAM as VIEWS
from scipy.linalg import expm
from vector_cases import some

from vslam_ref.conformance.adapters.table import answer_from
from vslam_ref.conformance.catalogue import Function
from vslam_ref.conformance.conventions import DECLARABLE, Convention
from vslam_ref.conformance.program import InProcess
from vslam_ref.conformance.runner import Report, run
from vslam_ref.testing import check_jacobian

Array = Any
TURN = 2 * np.pi


def positive(angle: float) -> float:
    return float(np.arctan2(np.sin(angle), np.cos(angle)) % TURN)


def heading(x: Array, home: Callable[[float], float]) -> Array:
    return np.array([x[0], x[1], home(x[2]), *x[3:]])


def from_pi(angle: float) -> float:
    return float((angle + np.pi) % TURN - np.pi)


def long_log(R: Array) -> Array:
    """Every rotation the long way, but for the identity and the half turn."""
    phi = motions.so3_log(R)
    angle = np.linalg.norm(phi)
    return phi * (1 - TURN / angle) if 0.1 < angle < 3.1 else phi


def rows(function: Callable[..., Array], *turned: str) -> Callable[..., Array]:
    def answer(**inputs: Any) -> Array:
        given = {k: np.swapaxes(v, -1, -2) if k in turned else v for k, v in inputs.items()}
        found = function(**given)
        return np.swapaxes(found, -1, -2) if np.ndim(found) == 2 and len(found) in (3, 4) else found

    return answer


def scale_first(xi: Array) -> Array:
    return xi[..., [6, 0, 1, 2, 3, 4, 5]]


BACK = [1, 2, 3, 4, 5, 6, 0]
SE2 = [2, 0, 1]
SE2_BACK = [1, 2, 0]
PROGRAMS: dict[tuple[str, str], dict[str, Callable[..., Any]]] = {
    ("angle_range", "[0, 2pi)"): {
        "so2.wrap": positive,
        "se2.compose": lambda a, b: heading(motions.se2_compose(a, b), positive),
        "se2.inverse": lambda x: heading(motions.se2_inverse(x), positive),
    },
    ("angle_range", "[-pi, pi)"): {
        "so2.wrap": from_pi,
        "se2.compose": lambda a, b: heading(motions.se2_compose(a, b), from_pi),
    },
    ("rotation_angle", "[0, 2pi)"): {"so3.log": long_log},
    ("group_jacobian", "right"): {
        "so3.left_jacobian": lambda phi: motions.so3_left_jacobian(-phi),
        "so3.left_jacobian_inverse": lambda phi: motions.so3_left_jacobian_inverse(-phi),
        "se2.left_jacobian": lambda xi: motions.se2_left_jacobian(-xi),
        "se3.left_jacobian": lambda xi: motions.se3_left_jacobian(-xi),
        "sim3.left_jacobian": lambda xi: motions.sim3_left_jacobian(-xi),
    },
    ("vectors", "rows"): {
        "so3.exp": rows(motions.so3_exp),
        "so3.log": rows(motions.so3_log, "R"),
        "se3.compose": lambda a, b: b @ a,
        "se3.act": lambda T, x: (np.array([*x, 1.0]) @ T)[:3],
        "sim3.compose": lambda a, b: b @ a,
    },
    ("essential", "unit_translation"): {
        "multiview.essential": lambda T_b_a: (
            VIEWS["multiview.essential"](T_b_a) / np.linalg.norm(T_b_a[:3, 3])
        ),
    },
    ("essential", "unit_norm"): {
        "multiview.essential": lambda T_b_a: (E := VIEWS["multiview.essential"](T_b_a)) / np.linalg.norm(E),
        "two_views.nearest_essential": lambda M: (
            plain_two_views.PROGRAM["two_views.nearest_essential"](M) / 2**0.5
        ),
    },
    ("quaternion_product", "jpl"): {
        "quaternion.from_rotation": lambda R: motions.quaternion_from_rotation(R) * [1, -1, -1, -1],
        "quaternion.to_rotation": lambda q: motions.quaternion_to_rotation(q * [1, -1, -1, -1]),
    },
    ("se2_order", "angle_first"): {
        "se2.exp": lambda xi: motions.se2_exp(xi[SE2_BACK]),
        "se2.log": lambda x: motions.se2_log(x)[SE2],
        "se2.adjoint": lambda x: motions.se2_adjoint(x)[SE2][:, SE2],
        "se2.left_jacobian": lambda xi: motions.se2_left_jacobian(xi[SE2_BACK])[SE2][:, SE2],
    },
    ("sim3_scale", "first"): {
        "sim3.exp": lambda xi: motions.sim3_exp(xi[BACK]),
        "sim3.log": lambda S: scale_first(motions.sim3_log(S)),
        "sim3.adjoint": lambda S: scale_first(scale_first(motions.sim3_adjoint(S)).T).T,
    },
}
FILES = {
    **{topic: f"02/{topic}.json" for topic in ("so2", "so3", "se2", "se3", "sim3", "quaternion")},
    "multiview": "01/multiview.json",
    "two_views": "09/two_views.json",
}


def report(table: dict[str, Callable[..., Any]], function: str, convention: Convention) -> Report:
    module = ModuleType("theirs")
    module.answer = lambda name, inputs: answer_from(table, name, inputs)  # type: ignore[attr-defined]
    file = some(FILES[function.partition(".")[0]], lambda case: case.function == function)
    return run(InProcess(module), [file], convention, names=False)


CASES = [(name, value, function) for (name, value), table in PROGRAMS.items() for function in table]


@pytest.mark.parametrize(("name", "value", "function"), CASES)
def test_a_program_passes_in_its_own_convention_and_in_no_other(name: str, value: str, function: str) -> None:
    table = PROGRAMS[name, value]
    declared = report(table, function, Convention(**{name: value}))
    bad = [o for o in declared.outcomes if o.status != "passed"]
    assert [
        (o.case.id, o.cause) for o in bad if o.difference is None or o.difference.verdict == "failed"
    ] == []
    assert report(table, function, Convention()).count("failed") > 0


@pytest.mark.parametrize(("name", "value", "function"), [c for c in CASES if c[0] != "rotation_angle"])
def test_a_house_program_does_not_pass_under_another_convention(name: str, value: str, function: str) -> None:
    """A declaration turns; it does not forgive.  (The short way round is inside [0, 2 pi), too.)"""
    house = {**motions.PROGRAM, **VIEWS, **plain_two_views.PROGRAM}
    assert report(house, function, Convention()).passed
    assert not report(house, function, Convention(**{name: value})).passed


def test_all_choices_are_listed_with_what_they_change() -> None:
    hints = {name: get_args(hint) for name, hint in get_type_hints(Convention).items()}
    house = Convention()
    expected = {(n, v) for n, values in hints.items() for v in values if v != getattr(house, n)}
    assert {(d.name, d.value) for d in DECLARABLE} == expected
    assert len(DECLARABLE) == len(expected)
    for d in DECLARABLE:
        assert dataclasses.replace(house, **{d.name: d.value}) != house
        assert len(d.changes) > 10


JACOBIAN = Function("x.y", 3, {"pose": "pose", "x": "plain"}, {"J": "pose_jacobian"}, "")
X = np.array([0.3, -0.4, 5.0])
POSE = motions.se3_exp(np.array([0.3, -0.2, 0.5, 0.4, -0.3, 0.2]))


@pytest.mark.parametrize(
    ("transform", "side", "order"),
    list(
        itertools.product(
            ("cam_from_world", "world_from_cam"), ("left", "right"), ("translation_first", "rotation_first")
        )
    ),
)
def test_split_steps_come_home(transform: Any, side: Any, order: Any) -> None:
    """The program's Jacobian by differences in its own step, rotation and translation apart."""
    convention = Convention(transform, side, order, pose_step="split")
    inputs = {"pose": POSE.tolist(), "x": X.tolist()}
    own = np.array(convention.inputs(JACOBIAN, inputs)["pose"])

    def seen(eta: Array) -> Array:
        rho, phi = (eta[3:], eta[:3]) if order == "rotation_first" else (eta[:3], eta[3:])
        turn, moved = expm(motions.skew(phi)), own.copy()
        moved[:3, :3] = turn @ own[:3, :3] if side == "left" else own[:3, :3] @ turn
        moved[:3, 3] = own[:3, 3] + rho
        T = np.linalg.inv(moved) if transform == "world_from_cam" else moved
        return T[:3, :3] @ X + T[:3, 3]

    house = motions.se3_act_jacobian(POSE, X)
    theirs = np.array(convention.converted("pose_jacobian", house.tolist(), inputs))
    check_jacobian(seen, np.zeros(6), theirs, method="central")
    home = convention.outputs(JACOBIAN, {"J": theirs.tolist()}, inputs)["J"]
    assert np.abs(np.array(home) - house).max() < 1e-11
    if (transform, side) != ("world_from_cam", "right"):
        return
    screw = Convention(transform, side, order)
    assert np.abs(np.array(screw.converted("pose_jacobian", house.tolist(), inputs)) - theirs).max() > 0.1


@pytest.mark.parametrize("bad", [-1.0, 7.0, -4.0])
def test_an_angle_outside_the_declared_range_stays_wrong(bad: float) -> None:
    angle = Convention(angle_range="[0, 2pi)").converted("angle", bad, {}, home=True)
    assert not -np.pi < angle <= np.pi

"""Exercise 24.1: an adapter asks its library, converts what is packing and declares what is meaning.

The oracle is the vectors.  The library's functions are exchanged, too: for a right one, after which all must
pass, and for wrong ones, each of which must show in its own function and in no other.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from vslam_ref.conformance.conventions import Convention
from vslam_ref.conformance.program import InProcess
from vslam_ref.conformance.runner import Outcome, run
from vslam_ref.conformance.vectors_format import Case, load

EXERCISE = "24_adapter"

ROTATIONS = {"so3.exp", "so3.left_jacobian", "se3.exp"}
IMAGES = {"camera.project", "camera.jacobian_pose"}
FILES = [load(name) for name in ("02/so3.json", "02/se3.json", "03/camera.json")]
ASKED = [case for file in FILES for case in file.cases]


def is_asked(case: Case) -> bool:
    return case.function in ROTATIONS or (case.function in IMAGES and case.inputs["model"] == "pinhole")


def outcomes(answer: ModuleType) -> list[Outcome]:
    return run(InProcess(answer), FILES, Convention(**answer.convention())).outcomes


def wrong(found: list[Outcome]) -> set[str]:
    """Functions with a case that did not pass."""
    return {o.case.function for o in found if o.status in ("failed", "error")}


def right_smear(degrees: Any) -> np.ndarray:
    """Mean of the rotations on the way, column by column: sum W^k / (k + 1)!, beyond 1 in closed form."""
    x, y, z = np.radians(degrees)
    W = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    a = np.linalg.norm([x, y, z])
    if a > 1.0:
        J = np.eye(3) + (1 - np.cos(a)) / a**2 * W + (a - np.sin(a)) / a**3 * W @ W
        return np.asarray(J).flatten("F")
    total = term = np.eye(3)
    for k in range(2, 60):
        term = term @ W / k
        total = total + term
    return total.flatten("F")


def test_what_is_declared_is_what_the_library_means(answer: ModuleType) -> None:
    declared = Convention(**answer.convention())
    assert declared == Convention("world_from_cam", "right", "rotation_first")


def test_only_the_fault_shows(answer: ModuleType) -> None:
    """All that is asked is answered; what fails is the left Jacobian at small angles, and it does fail."""
    found = outcomes(answer)
    assert {o.case.id for o in found if o.status == "unsupported"} == {
        case.id for case in ASKED if not is_asked(case)
    }
    bad = [o for o in found if o.status in ("failed", "error")]
    assert bad
    assert {(o.case.function, o.case.flags, o.status) for o in bad} == {
        ("so3.left_jacobian", ("small_angle",), "failed"),
        ("so3.left_jacobian", ("any_angle",), "failed"),
    }


def test_with_a_right_library_all_pass(answer: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """The fault is the library's: it goes when the library's function is mended, and with nothing else."""
    monkeypatch.setattr(answer, "lib_smear", right_smear)
    found = outcomes(answer)
    assert wrong(found) == set()
    assert sum(o.status == "passed" for o in found) == sum(map(is_asked, ASKED))


def transposed(function: Callable[..., Any]) -> Callable[..., Any]:
    return lambda degrees: np.reshape(function(degrees), (3, 3)).T.flatten()


def straight(function: Callable[..., Any]) -> Callable[..., Any]:
    def moved(step: Any) -> np.ndarray:
        T = np.array(function(step))
        T[12:15] = step[3:]
        return T

    return moved


def beside(function: Callable[..., Any]) -> Callable[..., Any]:
    def seen(*inputs: Any) -> Any:
        uv = function(*inputs)
        return None if uv is None else np.array(uv) + 0.5

    return seen


def forgets_focal(function: Callable[..., Any]) -> Callable[..., Any]:
    return lambda lens, *rest: function({**lens, "focal": (1.0, 1.0)}, *rest)


SPOILT = [
    ("lib_turn", transposed, "so3.exp"),
    ("lib_smear", transposed, "so3.left_jacobian"),
    ("lib_move", straight, "se3.exp"),
    ("lib_see", beside, "camera.project"),
    ("lib_slope", forgets_focal, "camera.jacobian_pose"),
]


@pytest.mark.parametrize(("name", "spoil", "function"), SPOILT, ids=[row[2] for row in SPOILT])
def test_another_fault_would_show(
    name: str, spoil: Any, function: str, answer: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each function of the catalogue is the library's own: spoilt there, it fails here, and nothing else."""
    if name != "lib_smear":
        monkeypatch.setattr(answer, "lib_smear", right_smear)
    monkeypatch.setattr(answer, name, spoil(getattr(answer, name)))
    found = outcomes(answer)
    assert wrong(found) == {function}
    generic = [o for o in found if o.case.function == function and o.case.flags in ((), ("pinhole",))]
    assert any(o.status == "failed" for o in generic)


def test_what_the_library_does_not_have_is_unsupported(answer: ModuleType) -> None:
    """Neither an error nor a number."""
    lens = {"model": "fov", "params": [300.0, 300, 320, 240, 0.9], "X_cam": [0.1, 0.2, 1.0]}
    for function, inputs in (("so3.log", {"R": np.eye(3).tolist()}), ("camera.project", lens)):
        with pytest.raises(NotImplementedError):
            answer.answer(function, inputs)


def test_what_the_library_refuses_is_an_error(answer: ModuleType) -> None:
    inputs = {"model": "pinhole", "params": [300.0, 300, 320, 240], "X_cam": [0.1, 0.2, -1.0]}
    with pytest.raises(ValueError, match=r"."):
        answer.answer("camera.project", inputs)


def test_answers_are_plain_and_inputs_are_left_alone(answer: ModuleType) -> None:
    """A line of JSON can hold the answer; the question is as it was."""
    convention = Convention(**answer.convention())
    for case in {c.function: c for c in ASKED if is_asked(c) and c.result == "valid"}.values():
        sent = convention.inputs(_function(case), case.inputs)
        before = copy.deepcopy(sent)
        assert isinstance(json.dumps(answer.answer(case.function, sent)), str)
        assert sent == before


def _function(case: Case) -> Any:
    from vslam_ref.conformance.catalogue import functions

    return functions()[case.function]


def test_the_fault_is_named(answer: ModuleType) -> None:
    """By the note that the vectors' runner gives for it, too."""
    function, note = answer.fault()
    assert (function, note) == ("so3.left_jacobian", "small-angle-sign")
    causes = {o.cause.partition(":")[0] for o in outcomes(answer) if o.case.function == function}
    assert note in causes

"""Sets in any order, quaternions of either sign, tables as numbers, and mistakes where no number is right."""

from __future__ import annotations

import copy
from types import ModuleType
from typing import Any

import numpy as np
import plain_estimates
import plain_motions
import plain_views
import pytest

from vslam_ref.conformance import vectors_format as form
from vslam_ref.conformance.adapters.table import plain
from vslam_ref.conformance.catalogue import Function
from vslam_ref.conformance.compare import compare, numbers
from vslam_ref.conformance.conventions import Convention
from vslam_ref.conformance.program import InProcess
from vslam_ref.conformance.runner import ask, run
from vslam_ref.conformance.statistics import mistaken


def case_of(name: str, function: str, keep: Any = lambda case: True) -> form.Case:
    return next(c for c in form.load(name).cases if c.function == function and keep(c))


def several() -> form.Case:
    return case_of("01/multiview.json", "multiview.p3p", lambda c: len(c.expected["poses"]) >= 3)


def test_a_set_is_right_in_any_order() -> None:
    case = several()
    poses = case.expected["poses"]
    for order in (slice(None), slice(None, None, -1)):
        assert compare(case, {"poses": poses[order]}).right
    assert compare(case, {"poses": [*poses[1:], poses[0]]}).right


def test_a_set_with_a_member_twice_or_missing_or_changed_is_wrong() -> None:
    case = several()
    poses = case.expected["poses"]
    changed = copy.deepcopy(poses)
    changed[-1][0][3] += 1e-3
    for wrong in ([poses[0], poses[0], *poses[2:]], poses[:-1], [*poses, poses[0]], changed, [], "none"):
        assert not compare(case, {"poses": wrong}).right


def test_a_quaternion_of_either_sign_is_right_and_a_mixed_one_is_not() -> None:
    case = case_of("02/quaternion.json", "quaternion.from_rotation", lambda c: not c.flags)
    q = np.array(case.expected["q"])
    assert compare(case, {"q": q.tolist()}).right
    assert compare(case, {"q": (-q).tolist()}).right
    assert not compare(case, {"q": (q * [1, 1, 1, -1]).tolist()}).right
    assert not compare(case, {"q": "w"}).right


def test_a_table_is_compared_as_numbers() -> None:
    case = case_of("23/format.json", "format.write_tum")
    text = case.expected["text"]
    assert compare(case, {"text": "# a head\n" + text.replace(" ", "   ")}).right
    for wrong in (text.replace("0.", "0.1", 1), text.splitlines()[0], text + "1 2\n", "no numbers", 7, ""):
        assert not compare(case, {"text": wrong}).right


def answering(value: Any) -> InProcess:
    module = ModuleType("answering")
    module.answer = lambda function, inputs: value  # type: ignore[attr-defined]
    return InProcess(module)


def test_a_number_where_a_refusal_is_right_fails_and_a_known_one_is_named() -> None:
    file = form.load("03/camera.json")
    case = next(c for c in file.cases if "mirrored" in c.mistakes)
    known = ask(answering(case.mistakes["mirrored"]), file, case, Convention(), "float64")
    assert (known.status, known.cause[:9]) == ("failed", "mirrored:")
    other = ask(answering({"uv": [1.0, 2.0], "valid": True}), file, case, Convention(), "float64")
    assert (other.status, other.cause) == ("failed", "there is no answer; the program gives one")
    for refusal in ({"uv": [1.0, 2.0], "valid": False}, {"valid": 0}):
        assert ask(answering(refusal), file, case, Convention(), "float64").status == "passed"
    rubbish = ask(
        answering({"uv": "x", "valid": True}), file, case, Convention(pixel_origin="corner"), "float64"
    )
    assert rubbish.status == "failed"


@pytest.mark.parametrize("measure", ["mean", "mean_square", "mean_fourth"])
def test_a_distribution_is_named_only_inside_its_band(measure: str) -> None:
    case = case_of("04/noise.json", "noise.gaussian", lambda c: c.statistic["measure"] == measure)
    right = case.inputs["sigma"] * np.random.default_rng(1).standard_normal(case.statistic["samples"])
    assert mistaken(case, {"x": right.tolist()}) == ""
    assert mistaken(case, {"x": (7.3 * right + 5).tolist()}) == ""
    assert mistaken(case, {}) == ""


def test_a_program_with_poses_of_the_body_in_the_world_passes() -> None:
    """Poses in and out are turned, those of sets and of several cameras, too."""
    inv = np.linalg.inv
    table = {
        "multiview.triangulate": lambda T_cams, bearings: plain_views.triangulate(inv(T_cams), bearings),
        "multiview.p3p": lambda bearings, X_world: inv(plain_views.p3p(bearings, X_world)),
    }
    module = ModuleType("away")
    module.answer = lambda function, inputs: plain(  # type: ignore[attr-defined]
        table[function](**{name: numbers(value) for name, value in inputs.items()})
    )
    file = form.load("01/multiview.json")
    file = file._replace(cases=[c for c in file.cases if c.function in table])
    assert run(InProcess(module), [file], Convention(transform="world_from_cam"), names=False).passed
    assert not run(InProcess(module), [file], names=False).passed


def test_normal_equations_of_a_right_perturbation_with_rotations_first_are_turned_home() -> None:
    """xi = Ad_T eta for T <- T Exp(eta): H becomes M^T H M, gradients and cross blocks follow."""
    order = [3, 4, 5, 0, 1, 2]

    def answer(function: str, inputs: dict[str, Any]) -> Any:
        given = {name: value if isinstance(value, str) else numbers(value) for name, value in inputs.items()}
        found = plain_estimates.normal_equations(**given, wrong="right-perturbation")
        found["B"] = found["B"][order][:, order]
        return plain({**found, **{name: found[name][:, order] for name in ("W_T", "g_view")}})

    module = ModuleType("right")
    module.answer = answer  # type: ignore[attr-defined]
    file = form.load("06/bundle.json")
    file = file._replace(cases=[c for c in file.cases if c.function == "bundle.normal_equations"])
    both = Convention(perturbation="right", tangent_order="rotation_first")
    assert run(InProcess(module), [file], both, names=False).passed
    for one in (Convention(), Convention(perturbation="right"), Convention(tangent_order="rotation_first")):
        assert run(InProcess(module), [file], one, names=False).count("failed") == len(file.cases)


def test_every_kind_goes_out_and_comes_home() -> None:
    """What a convention does to an information matrix, its way back undoes."""
    function = Function("x.y", 6, {"pose": "pose", "H": "pose_information"}, {"H": "pose_information"}, "")
    rng = np.random.default_rng(3)
    A, pose = rng.standard_normal((6, 6)), plain_motions.se3_exp(rng.standard_normal(6))
    given = {"pose": pose.tolist(), "H": (A @ A.T).tolist()}
    away = Convention("world_from_cam", "left", "rotation_first")
    sent = away.inputs(function, given)
    assert np.abs(np.array(sent["H"]) - given["H"]).max() > 0.1
    home = away.outputs(function, {"H": sent["H"]}, given)["H"]
    assert np.abs(np.array(home) - given["H"]).max() < 1e-12  # a product there and back, of order 10

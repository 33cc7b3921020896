# ruff: noqa: E501
"""Names of failing functions: the mistake that was put in, nothing that was not, and nothing where nothing fits."""

from __future__ import annotations

from collections import Counter
from types import ModuleType
from typing import Any

import numpy as np
import plain_branches
import plain_estimates
import plain_filters
import plain_grids
import plain_motions
import plain_short
import pytest
from scipy.stats import chi2
from wrong_programs import FIRST, SECOND, Fate, Wrong, judge, program, true_name, vectors
from wrong_short import THIRD

from vslam_ref.conformance.adapters import itself
from vslam_ref.conformance.adapters.table import answer_from, plain
from vslam_ref.conformance.conventions import Convention
from vslam_ref.conformance.diagnosis import NOTHING, diagnose
from vslam_ref.conformance.diagnosis.evidence import Evidence, gather, mostly, repairs
from vslam_ref.conformance.diagnosis.exchange import exchanged
from vslam_ref.conformance.program import InProcess
from vslam_ref.conformance.runner import ask as ask_case
from vslam_ref.conformance.runner import run

QUICK = [FIRST[k] for k in (0, 1, 2, 3, 4, 10, 12, 15, 19, 24, 27, 29, 35, 39, 42, 44, 50, 53, 56)] + [
    THIRD[k] for k in (22, 29, 35, 38, 45, 57, 63)
]


@pytest.mark.parametrize("wrong", QUICK, ids=lambda w: f"{w.function}: {w.new[:40]}")
def test_a_mistake_has_its_name(wrong: Wrong) -> None:
    fate = judge(wrong.function, program(wrong))
    assert not fate.slips
    assert true_name(wrong, fate), fate.name


@pytest.mark.slow
def test_most_mistakes_have_their_names_and_none_has_another() -> None:
    """Goal: at most 3 % slip, at least 60 % of those caught are named, no name is false."""
    tally: Counter[str] = Counter()
    for wrong in (*FIRST, *SECOND, *THIRD):
        fate = judge(wrong.function, program(wrong))
        kind = "slips" if fate.slips else "named" if fate.named else "unnamed"
        tally[kind] += 1
        assert kind != "named" or true_name(wrong, fate), (wrong, fate.name)
    caught = tally["named"] + tally["unnamed"]
    assert tally["slips"] <= 0.03 * tally.total()
    assert tally["named"] >= 0.6 * caught


@pytest.mark.parametrize("table", [plain_branches.PROGRAM, plain_short.PROGRAM], ids=["branches", "short"])
def test_right_programs_pass_and_get_no_name(table: dict[str, Any]) -> None:
    for function, program_of_it in table.items():
        assert_right(function, judge(function, program_of_it))


def assert_right(function: str, fate: Fate) -> None:
    assert (function, fate.failed, fate.name) == (function, 0, "")


def spoiled(value: Any, count: list[int]) -> Any:
    """Every number off by another per cent: no formula does this."""
    if isinstance(value, dict):
        return {key: spoiled(v, count) for key, v in value.items()}
    if isinstance(value, list):
        return [spoiled(v, count) for v in value]
    if isinstance(value, bool | str):
        return value
    count[0] += 1
    return value * (1 + 0.01 * np.sin(7.0 * count[0])) + 0.003


@pytest.mark.parametrize(
    "function",
    ["so3.exp", "so2.wrap", "se3.exp", "se3.inverse", "multiview.umeyama", "loss.cost", "ekf.predict", "ekf.augment",
     "consistency.band", "grid.log_odds", "vehicle.ackermann", "quaternion.from_rotation", "camera.jacobian_pose"],
)  # fmt: skip
def test_what_no_formula_does_has_no_name(function: str) -> None:
    count = [0]
    fate = judge(function, lambda **given: spoiled(itself.answer(function, plain(given)), count))
    assert fate.failed > 0
    assert fate.name.startswith(NOTHING), fate.name


def named(function: str, answering: Any) -> str:
    return judge(function, answering).name


def test_a_band_of_one_run_less_is_not_a_band_of_one_run() -> None:
    def band(runs: int, dof: int, confidence: float) -> Any:
        if runs < 1 or dof < 1 or not 0 < confidence < 1:
            raise ValueError("no band")
        tail = (1 - confidence) / 2
        return {
            "low": chi2.ppf(tail, (runs - 1) * dof) / runs,
            "high": chi2.isf(tail, (runs - 1) * dof) / runs,
        }

    name = named("consistency.band", band)
    assert "one-run" not in name
    assert "runs - 1" in name


def test_random_rotations_are_named_only_where_all_statistics_agree() -> None:
    uniform = named("so3.random", lambda N: plain_motions.so3_random(N, "uniform-angles"))
    assert uniform.startswith("uniform-angles")

    def near_identity(N: int) -> Any:
        return plain_motions.Rotation.from_rotvec(
            np.random.default_rng(1).uniform(-1, 1, (int(N), 3))
        ).as_matrix()

    other = named("so3.random", near_identity)
    assert "uniform-angles" not in other
    assert "mean_trace" in other


def test_another_order_of_the_quaternion_is_an_order() -> None:
    def last(R: Any) -> Any:
        return np.roll(plain_motions.quaternion_from_rotation(R), -1)

    assert "xyzw" in named("quaternion.from_rotation", last)


def test_cells_of_samples_along_the_line_are_not_bresenhams() -> None:
    def sampled(start: Any, end: Any) -> Any:
        steps = int(np.ceil(np.abs(np.subtract(end, start)).max())) + 1
        cells = [[int(v) for v in np.floor(start + (end - start) * k / steps)] for k in range(steps + 1)]
        return [cell for k, cell in enumerate(cells) if k == 0 or cell != cells[k - 1]]

    name = named("grid.ray_cells", sampled)
    assert "bresenham" not in name
    assert "end-cell-missing" not in name


def test_a_wrong_power_is_no_factor() -> None:
    def weight(name: str, c: float, x: Any) -> Any:
        right = plain_estimates.weight(name, c, x)
        return np.sqrt(right) if name == "geman-mcclure" else right

    name = named("loss.weight", weight)
    assert "factor" not in name
    assert "sqrt_weight" in name  # the power is told, as the library has it


def test_a_convention_of_the_vehicle_is_no_excuse_for_a_sign_or_a_unit() -> None:
    file = vectors("vehicle.ackermann")
    for case in (c for c in file.cases if c.result == "convention"):
        x = np.array(case.expected["x"])
        for other in (-x, 2 * x, np.degrees(x)):
            assert diagnose(file, case, {"x": other.tolist()}) == ""


def test_process_noise_in_a_single_update_is_named_also_beside_another_error() -> None:
    def update(wrong: str, **given: Any) -> Any:
        cov = np.array(given.pop("cov_z")) + np.diag([0.04, 0.01])
        found = plain_filters.update(**given, cov_z=cov)
        if wrong:
            found["x"] = np.asarray(found["x"]) * 1.001
        return found

    for beside in ("", "the mean is off"):
        name = named("ekf.update", lambda beside=beside, **given: update(beside, **given))
        assert "process noise as sensor noise" in name


def test_rounding_is_called_rounding() -> None:
    """Fmod differs in the last digit at small angles; that is no wrong formula."""

    def wrap(angle: float) -> float:
        return angle * (1 + 3e-15) if abs(angle) < 1e-3 else plain_motions.so2_wrap(angle)

    fate = judge("so2.wrap", wrap)
    assert fate.failed == 0 or fate.name.startswith("only the last digits differ")


def test_answers_where_there_are_none_are_told() -> None:
    name = named(
        "grid.log_odds", lambda probability: plain_grids.log_odds(min(max(probability, 1e-300), 1 - 1e-16))
    )
    assert "answers what must be refused" in name


def test_the_shape_is_told() -> None:
    assert "wrong shape: R is [9], expected [3, 3]" in named(
        "so3.exp", lambda phi: plain_motions.so3_exp(phi).ravel()[::-1]
    )


def test_single_precision_is_told() -> None:
    name = named("se3.act", lambda T, x: np.float32(plain_motions.se3_act(T, x)).astype(float))
    assert "single precision" in name


def test_the_library_is_as_before_after_a_change() -> None:
    from vslam_ref.geometry import so3

    code = so3.log.__code__
    with exchanged(so3.log, so3.inverse.__code__):
        assert so3.log.__code__ is so3.inverse.__code__
    assert so3.log.__code__ is code


def test_the_answer_is_kept_in_the_outcome() -> None:
    """What a name is made of; in the house's convention."""
    case = vectors("so2.exp").cases[0]

    class Module:
        """A program that answers the identity."""

        __name__ = "m"

        @staticmethod
        def answer(function: str, inputs: dict[str, Any]) -> Any:
            return np.eye(2).tolist()

    found = ask_case(InProcess(Module), vectors("so2.exp"), case, Convention(), "float64")  # type: ignore[arg-type]
    assert found.got == {"R": np.eye(2).tolist()}


def test_fates_say_what_happened() -> None:
    assert Fate(0, 5, "").slips
    assert not Fate(3, 5, f"{NOTHING}; wrong: somewhere").named
    assert Fate(3, 5, "the sign is flipped").named


def evidence_of(function: str, answering: Any) -> Evidence:
    """What is known of a function after a run."""
    module = ModuleType("mine")
    module.answer = lambda name, inputs: answer_from({function: answering}, name, inputs)  # type: ignore[attr-defined]
    outcomes = run(InProcess(module), [vectors(function)]).outcomes
    (found,) = gather(outcomes, lambda name, inputs: None)
    return found


def back(case: Any, got: Any) -> Any:
    """The repair of a transposed matrix."""
    return {"R": np.transpose(got["R"]).tolist()}


def test_a_guess_must_explain_most_failures_and_no_passed_case_may_speak_against_it() -> None:
    def mixed(share: float) -> Any:
        limit = np.quantile([np.linalg.norm(c.inputs["phi"]) for c in vectors("so3.exp").cases], share)

        def answer(phi: Any) -> Any:
            R = plain_motions.so3_exp(phi)
            return R.T if np.linalg.norm(phi) >= limit else R + 0.1

        return answer

    few, many = evidence_of("so3.exp", mixed(0.6)), evidence_of("so3.exp", mixed(0.2))
    assert mostly(few, back).explained == 0
    assert mostly(many, back).explained > 0.7 * len(many.failed)
    assert repairs(many, back).explained == 0  # one case that speaks against it is enough

    def above(phi: Any) -> Any:
        R = plain_motions.so3_exp(phi)
        return R.T if np.linalg.norm(phi) > 3.0 else R

    partly = repairs(evidence_of("so3.exp", above), back)
    assert partly.explained > 0
    assert partly.against
    told = named("so3.exp", above)
    assert told.startswith("only where the length of phi is above 3: transposed: ")

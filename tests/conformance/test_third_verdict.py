"""Three verdicts: passed, lost digits, failed; and how many digits an answer has."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vslam_ref.conformance import vectors_format as form
from vslam_ref.conformance.compare import compare


def case_with(expected: Any, rule: dict[str, Any], mistakes: dict[str, Any] | None = None) -> form.Case:
    """A case of so3.log with a tolerance."""
    base = next(c for c in form.load("02/so3.json").cases if c.function == "so3.log")
    rule = {"reason": "for the test", "float32": {"relative": 1e-3, "absolute": 0.0}, **rule}
    wrong = {name: {"phi": value} for name, value in (mistakes or {}).items()}
    return base._replace(expected={"phi": expected}, tolerance=rule, mistakes=wrong, accept=[])


WIDE = {
    "relative": 1e-14,
    "absolute": 0.0,
    "lost_digits": {"relative": 1e-6, "absolute": 0.0, "reason": "cos"},
}
PHI = np.array([2.0, -1.0, 0.5])


@pytest.mark.parametrize(
    ("off", "verdict"),
    [(0.0, "passed"), (1e-14, "passed"), (1e-12, "lost digits"), (1e-6, "lost digits"), (1e-5, "failed")],
)
def test_lost_digits_stand_between_right_and_wrong(off: float, verdict: str) -> None:
    found = compare(case_with(PHI.tolist(), WIDE), {"phi": (PHI + [off, 0, 0]).tolist()})
    assert found.verdict == verdict
    assert found.right == (verdict == "passed")


def test_without_a_width_there_are_two_verdicts() -> None:
    narrow = {"relative": 1e-14, "absolute": 0.0}
    assert compare(case_with(PHI.tolist(), narrow), {"phi": (PHI + 1e-12).tolist()}).verdict == "failed"


def test_single_precision_has_a_width_of_its_own_or_none() -> None:
    answer = {"phi": (PHI + [1e-2, 0, 0]).tolist()}
    assert compare(case_with(PHI.tolist(), WIDE), answer, "float32").verdict == "failed"
    single = {"relative": 1e-3, "absolute": 0.0, "lost_digits": WIDE["lost_digits"] | {"relative": 0.1}}
    assert (
        compare(case_with(PHI.tolist(), {**WIDE, "float32": single}), answer, "float32").verdict
        == "lost digits"
    )


def test_an_answer_nearer_to_a_known_mistake_has_failed() -> None:
    mistake = PHI + [1e-7, 0, 0]
    case = case_with(PHI.tolist(), WIDE, {"a-note": mistake.tolist()})
    assert compare(case, {"phi": mistake.tolist()}).verdict == "failed"
    assert compare(case, {"phi": (PHI - [1e-7, 0, 0]).tolist()}).verdict == "lost digits"


@pytest.mark.parametrize(
    ("off", "digits"), [(0.0, 16.0), (2e-12, 12.0), (2e-6, 6.0), (2.0, 0.0), (50.0, 0.0)]
)
def test_digits_are_of_the_largest_entry(off: float, digits: float) -> None:
    """An error of off in a vector whose largest entry is 2 is off/2."""
    found = compare(case_with(PHI.tolist(), WIDE), {"phi": (PHI + [0, 0, off]).tolist()})
    assert abs(found.digits - digits) < 1e-3


def test_right_answers_have_digits_and_rubbish_has_none() -> None:
    case = case_with(PHI.tolist(), {"relative": 1e-3, "absolute": 0.0})
    found = compare(case, {"phi": (PHI + 2e-6).tolist()})
    assert found.right
    assert abs(found.digits - 6.0) < 1e-3
    for answer in ({"phi": [1.0]}, {"phi": "west"}, {}, {"phi": [np.nan, 0, 0]}):
        assert compare(case, answer).digits == 0.0


def test_where_zero_is_right_the_absolute_part_is_the_yardstick() -> None:
    """1e-14 of the size 0.1, whose rounding the absolute part allows, is 13 digits."""
    case = case_with([0.0, 0.0, 0.0], {"relative": 1e-14, "absolute": 1e-15})
    found = compare(case, {"phi": [1e-14, 0, 0]})
    assert found.verdict == "failed"
    assert abs(found.digits - 13.0) < 1e-6


@pytest.mark.parametrize("name", form.names())
def test_known_mistakes_fail_in_every_width(name: str) -> None:
    for case in form.load(name).cases:
        if case.result == "valid" and case.statistic is None:
            for note, answer in case.mistakes.items():
                assert compare(case, answer).verdict == "failed", f"{case.id}: {note}"

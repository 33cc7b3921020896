"""A claim states its verdict in one of three words, and its numbers make sense."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from vslam_ref.experiments.framework import Claim
from vslam_ref.experiments.framework.claims import check_distinct

GOOD: dict[str, Any] = {
    "id": "a", "source": "B", "text": "t", "rule": "r", "measured": {"x": 1.0}, "ci": [0.0, 1.0],
    "null_rate": 0.05, "share": 0.5, "verdict": "reproduced",
}  # fmt: skip


def test_keys_are_those_of_the_result_file_in_order():
    assert list(Claim(**GOOD).to_dict()) == list(GOOD)
    assert Claim(**GOOD).to_dict() == GOOD


@pytest.mark.parametrize(
    "wrong",
    [
        {"verdict": "Reproduced"},
        {"verdict": "passed"},
        {"ci": [1.0, 0.0]},
        {"ci": [1.0]},
        {"share": 1.2},
        {"null_rate": -0.1},
    ],
)
def test_nonsense_is_refused_with_the_name_of_the_claim(wrong):
    with pytest.raises(ValueError, match="claim 'a'"):
        Claim(**{**GOOD, **wrong})


def test_claims_cannot_be_changed_after_judgement():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Claim(**GOOD).verdict = "not reproduced"  # type: ignore[misc]


def test_two_claims_of_one_name_are_refused():
    with pytest.raises(ValueError, match="two claims are called 'a'"):
        check_distinct([Claim(**GOOD), Claim(**GOOD)])

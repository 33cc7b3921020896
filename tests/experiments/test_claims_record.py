"""A claim states its verdict in one of three words, and its numbers make sense."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from vslam_ref.experiments.framework import Claim
from vslam_ref.experiments.framework.claims import check_distinct, judged, small_sample_note

GOOD: dict[str, Any] = {
    "id": "a", "source": "B", "text": "t", "rule": "r", "measured": {"x": 1.0}, "ci": [0.0, 1.0],
    "null_rate": 0.05, "share": 0.5, "verdict": "reproduced", "sentence": "x is 1: reproduced.",
    "runs": 4, "least_runs": 5, "quick": True,
}  # fmt: skip


def test_keys_are_those_of_the_result_file_in_order():
    expected = GOOD | {"small_sample": True}
    assert list(Claim(**GOOD).to_dict()) == list(expected)
    assert Claim(**GOOD).to_dict() == expected


@pytest.mark.parametrize(
    ("runs", "least", "small"), [(4, 5, True), (5, 5, False), (None, 5, False), (4, None, False)]
)
def test_a_sample_is_small_when_the_rule_asks_for_more_runs(runs, least, small):
    claim = Claim(**GOOD | {"runs": runs, "least_runs": least})
    assert claim.small_sample is small
    assert bool(small_sample_note(claim.to_dict())) is small


@pytest.mark.parametrize(
    ("holds", "word"), [(True, "reproduced"), (False, "not reproduced"), (None, "not testable")]
)
def test_the_sentence_ends_with_the_verdict_of_the_rule(holds, word):
    claim = judged("a", "B", "t", "r", holds, "x is 1", {"x": 1.0})
    assert (claim.verdict, claim.sentence) == (word, f"x is 1: {word}.")


def test_percent_signs_stand_apart_as_in_the_book():
    claim = judged("a", "B", "t", "r", True, "78% of 95 % is 74.1%", {})
    assert claim.sentence == "78 % of 95 % is 74.1 %: reproduced."


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

"""The verdict rule, and what the judge does with studies it cannot judge."""

import dataclasses
import json

import numpy as np
import pytest

from vslam_ref.experiments.iekf import (
    SENTENCES,
    all_at_once,
    claim_ids,
    conclude,
    evaluate,
    judge,
    rules_table,
)
from vslam_ref.experiments.iekf.measures import average, difference_factor, ratio, share_above_line
from vslam_ref.experiments.iekf.rules import Rule
from vslam_ref.support.json_text import to_json


@pytest.fixture(scope="module")
def evaluation(studies):
    (e,) = evaluate(studies["paper"], ["ekf-low-lap2-inconsistent"], np.random.default_rng(5))
    return e


def altered(e, **changes):
    """Replace parts of an evaluation; ``held`` of 100 drawn studies shall lie on the claim's side."""
    held = changes.pop("held", None)
    if held is not None:
        side = 1.0 if e.sentence.rule.above else -1.0
        changes["subsets"] = e.threshold + side * np.where(np.arange(100) < held, 1.0, -1.0)
        changes["naive"] = None
    return dataclasses.replace(e, **changes)


def test_all_three_conditions_are_needed(evaluation):
    c = evaluation.threshold
    good = altered(evaluation, held=85, interval=(c + 0.1, c + 1), null_rate=0.05)
    assert conclude(good).verdict == "reproduced"
    for failing, change in {
        "true": {"interval": (c - 0.1, c + 1)},
        "seen": {"held": 79},
        "telling": {"null_rate": 0.4},
    }.items():
        claim = conclude(altered(good, **change))
        assert claim.verdict == "not reproduced"
        assert [k for k in ("true", "seen", "telling") if not claim.measured[k]] == [failing]


def test_the_sentence_of_a_failed_claim_names_the_condition_that_failed(evaluation):
    c = evaluation.threshold
    good = altered(evaluation, held=85, interval=(c + 0.1, c + 1), null_rate=0.05)
    assert "show B's picture: reproduced." in conclude(good).sentence
    for words, change in (
        ("do not settle on which side", {"interval": (c - 0.1, c + 1)}),
        ("where 80 % are asked for", {"held": 79}),
        ("but so do 40 % where it is false", {"null_rate": 0.4}),
    ):
        assert words in conclude(altered(good, **change)).sentence


def test_the_bound_of_a_share_of_time_is_in_percent():
    rule = Rule(("nees:iekf/high",), share_above_line("lap 1"), False, "consistent", False, 0.25)
    assert "lies above the line 3.592 for 0% of lap 1" in rule.found(0.0)
    assert rule.bound(0.25) == "the rule asks for at most 25%"


def test_a_rule_that_cannot_say_no_tests_nothing(evaluation):
    claim = conclude(altered(evaluation, held=100, null_rate=0.51))
    assert claim.verdict == "not testable"
    assert "false" in claim.measured["reason"]


@pytest.mark.parametrize(
    ("reason", "change"),
    [
        ("series nees:ekf/low is missing", lambda s: s["nees"].pop("ekf/low")),
        ("series nees:control/low is missing", lambda s: s["nees"].pop("control/low")),
        (
            "has no value somewhere in 1 of its runs",
            lambda s: s["nees"]["ekf/low"].__setitem__((7, 3), np.nan),
        ),
        (
            "has 199 runs, the rule needs 4 times 50",
            lambda s: s["nees"].update({"ekf/low": s["nees"]["ekf/low"][:199]}),
        ),
        (
            "has 399 runs, the rule needs 8 times 50",
            lambda s: s["nees"].update({"control/low": s["nees"]["control/low"][:399]}),
        ),
        ("ends at 160 s, before the second lap does", lambda s: s.update({"lap_seconds": 90.0})),
    ],
)
def test_what_cannot_be_tested_says_why(studies, reason, change):
    study = {**studies["paper"], "nees": {k: v.copy() for k, v in studies["paper"]["nees"].items()}}
    change(study)
    (claim,) = judge(study, ["ekf-low-lap2-inconsistent"], np.random.default_rng(0))
    assert claim.verdict == "not testable"
    assert reason in claim.measured["reason"]
    assert claim.share is claim.null_rate is claim.ci is None


def test_a_missing_series_leaves_the_other_claims_alone(studies, judged):
    study = {**studies["paper"], "position_error": {}}
    found = {c.id: c for c in judge(study, list(SENTENCES), np.random.default_rng(5))}
    for i, claim in judged["paper"].items():
        if i.startswith("error"):
            assert found[i].verdict == "not testable"
        else:
            assert found[i] == claim


def test_same_seed_same_numbers_whatever_else_is_asked(studies, judged):
    for figure in (2, 3, 4):
        alone = judge(studies["paper"], claim_ids(figure)[:2], np.random.default_rng(5))
        assert alone == [judged["paper"][i] for i in claim_ids(figure)[:2]]


def test_numbers_of_the_judge_are_those_of_the_arrays(studies, judged):
    nees = studies["paper"]["nees"]["ekf/low"]
    claim = judged["paper"]["ekf-low-lap2-inconsistent"]
    assert claim.measured["own_runs"] == pytest.approx(nees[:50, 80:].mean(), rel=1e-12)
    assert claim.measured["population"] == pytest.approx(nees[:, 80:].mean(), rel=1e-12)
    error = nees[:, 80:].mean(axis=1).std() / 20
    # percentile interval of a mean of 400: 1.96 standard errors, known to a few percent from 2000 draws
    assert claim.ci == pytest.approx(nees[:, 80:].mean() + error * np.array([-1.96, 1.96]), abs=0.25 * error)
    assert claim.measured["share_low"] <= claim.share <= claim.measured["share_high"]


def test_claims_can_be_written(judged):
    for claims in judged.values():
        for claim in claims.values():
            assert json.loads(to_json(claim.to_dict()))["id"] == claim.id


def test_all_at_once_is_no_more_than_the_rarest(studies):
    es = evaluate(studies["paper"], claim_ids(3), np.random.default_rng(5))
    joint = all_at_once(es)
    assert joint["rules"] <= min(e.share for e in es)
    assert joint["rules"] == np.mean(np.all([e.holds for e in es], axis=0))
    with pytest.raises(ValueError, match="at least one"):
        all_at_once([])


def test_a_control_that_is_not_consistent_is_refused(studies):
    nees = {**studies["paper"]["nees"], "control/low": 1.4 * studies["paper"]["nees"]["control/low"]}
    with pytest.raises(ValueError, match=r"control/low has a mean of .* consistent is 3"):
        judge({**studies["paper"], "nees": nees}, ["ekf-low-lap2-inconsistent"], np.random.default_rng(0))


def test_bad_input_is_named(studies):
    paper = studies["paper"]
    with pytest.raises(ValueError, match="unknown claim 'nonsense'"):
        judge(paper, ["nonsense"], np.random.default_rng(0))
    short = {**paper, "nees": {**paper["nees"], "ekf/low": paper["nees"]["ekf/low"][:, :-1]}}
    with pytest.raises(ValueError, match=r"shape \(400, 160\)"):
        judge(short, ["ekf-low-lap2-inconsistent"], np.random.default_rng(0))
    unequal = {**paper, "nees": {**paper["nees"], "ekf/low": paper["nees"]["ekf/low"][:300]}}
    with pytest.raises(ValueError, match="must hold the same runs"):
        judge(unequal, ["ekf-p0-amplifies"], np.random.default_rng(0))
    with pytest.raises(ValueError, match="figures 2, 3 and 4"):
        claim_ids(5)


def test_the_table_has_every_claim_once():
    assert [len(claim_ids(f)) for f in (2, 3, 4)] == [8, 14, 6]
    table = rules_table()
    for i, s in SENTENCES.items():
        assert table.count(f"`{i}`") == 1
        assert s.rule.text().split(";")[0] in table
        assert s.source == f"B 4.1, figure {s.figure}, sentence {s.place}"


@pytest.mark.parametrize(
    ("message", "make"),
    [
        ("threshold", lambda: Rule(("a",), average("lap 1"), True, "consistent", False)),
        ("one place", lambda: Rule(("a",), average("lap 1"), False, "inflated", True, effect=1.0)),
        ("halves", lambda: Rule(("a",), average("lap 1"), True, "swapped", True)),
        ("declared effect", lambda: Rule(("a", "b"), difference_factor("lap 1"), False, "scaled", True)),
        ("one window", lambda: Rule(("a", "b"), ratio("lap 1"), False, "scaled", False, effect=1.1)),
    ],
)
def test_a_rule_that_makes_no_sense_is_refused(message, make):
    with pytest.raises(ValueError, match=message):
        make()

"""The public setups: rules on true and false worlds, and the quick runs end to end."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.experiments.framework import RunContext, load
from vslam_ref.experiments.iekf.circle import PUBLISHED, published_claim
from vslam_ref.experiments.iekf.neighbours import (
    FILTERS,
    QUESTIONS,
    SETTLE,
    STARTS,
    Errors,
    common_claims,
    last,
    rmse,
)
from vslam_ref.support.json_text import to_json

TRUE = {
    "ekf/zero": 2.5, "ekf-anchored/zero": 2.5, "iekf/zero": 1.5,
    "ekf/high": 9.0, "ekf-anchored/high": 1.1, "iekf/high": 1.4,
}  # fmt: skip


def world(nees: dict[str, float], stretch: float = 1.03, runs: int = 200) -> dict[str, Errors]:
    """Errors of made-up runs whose mean NEES per freedom is given; equal values share their runs."""
    errors = {}
    for key, level in nees.items():
        rng = np.random.default_rng(int(100 * level))
        heading = np.deg2rad(3.02) * rng.standard_normal((runs, 1)) * np.ones(30)
        position = 0.67 / np.sqrt(2) * np.hypot(*rng.standard_normal((2, runs, 1))) * np.ones(30)
        square = np.broadcast_to(level * rng.chisquare(3, (runs, 1)) / 3, (runs, 30)).copy()
        square[:, :SETTLE] = np.nan
        long = np.full((runs, 30), stretch if key.startswith("iekf") else 1.0)
        errors[key] = Errors(heading, position, square, square, square, long)
    return errors


def verdicts(errors: dict[str, Errors], enough: bool = True) -> dict[str, str]:
    return {c.id: c.verdict for c in common_claims("made up", errors, enough, np.random.default_rng(0))}


def test_the_questions_are_answered_yes_where_they_are_true():
    found = verdicts(world(TRUE))
    assert set(found) == {q.id for q in QUESTIONS} | {"zero-anchored-is-ekf"}
    assert set(found.values()) == {"reproduced"}


@pytest.mark.parametrize(
    ("id", "change", "stretch"),
    [
        ("zero-ekf-overconfident", {"ekf/zero": 1.0, "ekf-anchored/zero": 1.0, "iekf/zero": 0.5}, 1.03),
        ("zero-iekf-better", {"iekf/zero": 3.5}, 1.03),
        ("high-iekf-much-better", {"ekf/high": 2.0}, 1.03),
        ("high-anchored-not-worse", {"ekf-anchored/high": 3.0}, 1.03),
        ("zero-iekf-stretches", {}, 1.005),
        ("zero-anchored-is-ekf", {"ekf-anchored/zero": 2.6}, 1.03),
    ],
)
def test_a_question_is_answered_no_where_it_is_false(id, change, stretch):
    found = verdicts(world(TRUE | change, stretch))
    assert [i for i, v in found.items() if v != "reproduced"] == [id]


def test_a_short_course_gives_no_answer():
    found = verdicts(world(TRUE), enough=False)
    assert all(found[q.id] == "not testable" for q in QUESTIONS)


@pytest.mark.parametrize("number", PUBLISHED, ids=lambda p: p.id)
def test_a_published_number_is_met_and_missed(number):
    """Errors scaled to the published value meet it; errors 1.4 times that miss it, whatever is asked."""
    errors = world(TRUE, runs=400)
    data = getattr(errors[number.key], number.quantity)
    is_nees = number.quantity.startswith("nees")
    unit = 180 / np.pi if number.quantity == "heading" else 1.0
    ours = np.nanmean(data) if is_nees else unit * rmse(data)
    for factor, expected in ((1.0, "reproduced"), (1.4, "not reproduced"), (0.6, "not reproduced")):
        scaled = errors[number.key]._replace(**{number.quantity: data * number.value * factor / ours})
        claim = published_claim(number, {number.key: scaled}, 100, True, np.random.default_rng(3))
        assert claim.measured["ours"] == pytest.approx(factor * number.value)
        assert claim.verdict == expected
    assert published_claim(number, errors, 100, False, np.random.default_rng(3)).verdict == "not testable"


def test_the_last_tenth_is_a_tenth():
    x = np.arange(40.0)[None]
    assert last(x) == pytest.approx([37.5])


@pytest.mark.parametrize("id", ["iekf-circle", "iekf-bailey"])
def test_quick_run_end_to_end(id):
    experiment = load(id)
    config = experiment.configure(quick=True)
    study = experiment.run(config)
    series = experiment.series(study)
    assert set(series["nees"]) == {f"{name}/{start}" for name in FILTERS for start in STARTS}
    assert all(len(c) == len(series["time"]) for c in series["rmse_position"].values())
    claims = {c.id: c for c in experiment.claims(study)}
    assert claims["zero-anchored-is-ekf"].verdict == "reproduced"
    assert {c.verdict for i, c in claims.items() if i != "zero-anchored-is-ekf"} == {"not testable"}
    assert len(experiment.figure(study).axes) == 4
    # one worker or two, the same bytes
    again = experiment.run(config, RunContext(jobs=2))
    assert to_json(experiment.series(again)) == to_json(series)


def test_sensitivity_quick_run_end_to_end():
    experiment = load("iekf-sensitivity")
    study = experiment.run(experiment.configure(quick=True, overrides=["study.field.lap_seconds=20"]))
    claims, series = experiment.claims(study), experiment.series(study)
    assert len(claims) == 6 + 28
    assert {c.verdict for c in claims} == {"not testable"}
    assert series["axis"][0] == "baseline"
    assert all(np.isfinite(row).all() for row in series["nees_end"].values())
    assert len(experiment.figure(study).axes) == 2

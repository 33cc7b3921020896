"""Every rule of the grid says yes in a world where its sentence is true, and no in one where it is false."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.experiments.iekf.grid import NUMERIC, SensitivityConfig, baseline_value
from vslam_ref.experiments.iekf.grid_rules import along_axis, mechanism_claims, rises_along, statement_claim
from vslam_ref.experiments.iekf.sentences import SENTENCES
from vslam_ref.experiments.iekf.settings import Grid

AT = {axis: baseline_value(SensitivityConfig(), axis) for axis in NUMERIC}
LAYOUT_CLAIM = "ekf-low-lap2-inconsistent"


def true_share(id, setting):
    """Everything holds everywhere, but for one statement that one layout spoils."""
    return 0.1 if id == LAYOUT_CLAIM and setting.name == "layout #2" else 0.95


def true_end(key, setting):
    """The EKF suffers from P0, the IEKF from steering noise, the anchored EKF from nothing."""
    if key == "ekf/high":
        return 3000.0 * setting.study.p0_high[2] + 10.0
    if key.startswith("iekf"):
        return 3.0 + 60.0 * setting.study.field.sigma_phi
    return 3.0


def judged(grid: Grid) -> dict[str, str]:
    return {c.id: c.verdict for c in mechanism_claims(grid, AT, np.random.default_rng(1))}


@pytest.fixture(scope="module")
def truth(make) -> dict[str, str]:
    return judged(make(true_share, true_end))


def test_all_mechanisms_are_found_where_they_are_at_work(truth):
    assert len(truth) == 6
    assert set(truth.values()) == {"reproduced"}


FALSE = {
    "high-p0-gap-everywhere": (
        lambda i, s: 0.3 if i == "iekf-high-much-better" and s.axis == "max_range" else true_share(i, s),
        true_end,
    ),
    "ekf-low-depends-on-layout": (lambda i, s: 0.95, true_end),
    "anchored-not-worse": (
        true_share,
        lambda k, s: 9.0 if k == "ekf-anchored/high" and s.name == "landmarks 15" else true_end(k, s),
    ),
    "ekf-end-grows-with-p0": (true_share, lambda k, s: 15.0 if k == "ekf/high" else true_end(k, s)),
    "iekf-end-grows-with-steering-noise": (
        true_share,
        lambda k, s: 3.0 if k.startswith("iekf") else true_end(k, s),
    ),
    "small-noises-keep-gap": (
        lambda i, s: 0.5 if i == "iekf-high-much-better" and s.axis == "small_noises" else true_share(i, s),
        true_end,
    ),
}


@pytest.mark.parametrize("id", FALSE)
def test_a_mechanism_is_refused_where_it_is_absent(make, truth, id):
    share, end = FALSE[id]
    found = judged(make(share, end))
    assert found[id] == "not reproduced"
    others = {i for i in truth if i != id and found[i] != truth[i]}
    # the small-noise corner is one of the settings of the whole grid
    assert others <= {"high-p0-gap-everywhere"}


def test_dependence_on_the_draw_is_not_taken_for_dependence_on_the_layout(make):
    """Shares that another draw of the noises moves as much say nothing about layouts."""

    def share(i, s):
        return 0.1 if i == LAYOUT_CLAIM and s.name in ("layout #2", "draw #1") else 0.95

    assert judged(make(share, true_end))["ekf-low-depends-on-layout"] == "not reproduced"


def test_a_rise_with_one_step_down_is_no_rise(make):
    def end(key, s):
        return 1.0 if key == "ekf/high" and s.name == "heading_variance 0.01" else true_end(key, s)

    assert judged(make(true_share, end))["ekf-end-grows-with-p0"] == "not reproduced"
    with pytest.raises(ValueError, match="no order"):
        rises_along("x", "layout", "ekf/high", make(true_share, end), AT, np.random.default_rng(0), "")


def test_nothing_testable_is_not_a_verdict(make):
    found = judged(make(lambda i, s: None, true_end))
    assert found["high-p0-gap-everywhere"] == "not testable"
    assert found["ekf-low-depends-on-layout"] == "not testable"
    assert found["small-noises-keep-gap"] == "not testable"
    grid = make(lambda i, s: None, true_end)
    assert {statement_claim(s, grid).verdict for s in SENTENCES.values()} == {"not testable"}


def test_few_runs_give_no_verdict_on_means(make):
    grid = make(true_share, true_end)
    few = Grid(tuple(j._replace(end={k: x[:60] for k, x in j.end.items()}) for j in grid.judged))
    found = judged(few)
    for id in ("anchored-not-worse", "ekf-end-grows-with-p0", "iekf-end-grows-with-steering-noise"):
        assert found[id] == "not testable"


def test_a_statement_holds_over_the_grid_only_if_it_holds_at_every_setting(make):
    sentence = SENTENCES[LAYOUT_CLAIM]
    everywhere = statement_claim(sentence, make(lambda i, s: 0.95, true_end))
    assert everywhere.verdict == "reproduced"
    assert everywhere.share == 1.0
    grid = make(true_share, true_end)
    spoiled = statement_claim(sentence, grid)
    assert spoiled.verdict == "not reproduced"
    assert spoiled.measured["baseline"] == "reproduced"
    assert spoiled.measured["layout"] == "stops at: #2"
    assert spoiled.measured["sigma_v"] == "holds over the whole axis"
    assert spoiled.measured["least_share"] == ["layout #2", 0.1]
    assert spoiled.share == pytest.approx(1.0 - 1.0 / len(grid.judged))


def test_the_words_for_an_axis(make):
    id = LAYOUT_CLAIM
    only = make(lambda i, s: 0.9 if s.name == "sigma_v 0.05" else 0.2, true_end)
    assert along_axis(id, "sigma_v", only) == "holds only at: 0.05"
    assert along_axis(id, "sigma_z", only) == "holds nowhere"
    gap = make(lambda i, s: None if s.name == "sigma_v 0.05" else 0.9, true_end)
    assert along_axis(id, "sigma_v", gap) == "holds over the whole axis; untested: 0.05"


def test_a_setting_that_cannot_be_tested_does_not_spoil_the_grid(make):
    one = make(lambda i, s: None if s.axis == "draw" else 0.95, true_end)
    found = statement_claim(SENTENCES[LAYOUT_CLAIM], one)
    assert found.verdict == "reproduced"
    assert found.measured["settings_tested"] == len(one.judged) - 2
    assert dataclasses.asdict(found)["null_rate"] == 0.05

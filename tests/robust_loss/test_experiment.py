"""tukey-errata: every claim is judged on a world where it is true and on one where it is false."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vslam_ref.experiments.framework import Study, load
from vslam_ref.experiments.tukey import errata
from vslam_ref.experiments.tukey import scene as scenes
from vslam_ref.experiments.tukey.scene import COSTS, Run
from vslam_ref.support.errors import InputError


@pytest.fixture(scope="module")
def study() -> Study[Run]:
    experiment = load("tukey-errata")
    return experiment.run(experiment.configure(quick=True, runs=12))


def changed(study: Study[Run], **fields: np.ndarray) -> Study[Run]:
    return replace(study, data=study.data._replace(**fields))


def verdicts(study: Study[Run]) -> dict[str, str]:
    return {c.id: c.verdict for c in errata.claims(study)}


IDS = {
    "falls-beyond-its-top",
    "prefers-to-be-lost",
    "drives-away-from-the-truth",
    "wastes-honest-data",
    "right-as-the-reweighted-residual",
    "corrected-is-robust",
}


def test_the_claims_hold_of_the_print(study: Study[Run]) -> None:
    assert verdicts(study) == dict.fromkeys(IDS, "reproduced")
    shares = {c.id: c.share for c in errata.claims(study)}
    assert shares["drives-away-from-the-truth"] == shares["prefers-to-be-lost"] == 1.0
    assert load("tukey-errata").figure(study).axes


def test_the_claims_fail_of_a_right_print(study: Study[Run]) -> None:
    """Had A printed Tukey's cost: the print's columns are those of the correction."""
    printed, corrected = COSTS.index("printed"), COSTS.index("corrected")
    error, clean = study.data.error.copy(), study.data.clean.copy()
    error[:, printed], clean[:, printed] = error[:, corrected], clean[:, corrected]
    right = changed(study, error=error, clean=clean, far_cost=study.data.true_cost + 1.0)
    right = replace(right, once=study.once | {"printed": study.once["corrected"]})
    kept = {"right-as-the-reweighted-residual", "corrected-is-robust"}
    assert {id for id, v in verdicts(right).items() if v == "reproduced"} == kept


def test_the_other_claims_fail_where_they_are_false(study: Study[Run]) -> None:
    apart = changed(study, reweighted=study.data.reweighted + 1e-3)
    assert verdicts(apart)["right-as-the-reweighted-residual"] == "not reproduced"
    error = study.data.error.copy()
    error[:, COSTS.index("corrected")] = error[:, COSTS.index("l2")]
    assert verdicts(changed(study, error=error))["corrected-is-robust"] == "not reproduced"
    one = study.data.far_cost.copy()
    one[0] = study.data.true_cost[0] + 1.0  # a single run is enough
    assert verdicts(changed(study, far_cost=one))["prefers-to-be-lost"] == "not reproduced"


def test_the_loss_of_precision_is_the_one_that_the_efficiency_predicts(study: Study[Run]) -> None:
    """Variance of the print over Tukey's from the integrals of chapter 04; 12 runs know it to a factor."""
    from vslam_ref.estimation.robust import efficiency

    costs = scenes.losses()
    predicted = efficiency(costs["corrected"], 2) / efficiency(costs["printed"], 2)
    assert predicted == pytest.approx(1.8, abs=0.3)
    clean = study.data.clean
    measured = clean[:, COSTS.index("printed")].mean() / clean[:, COSTS.index("corrected")].mean()
    assert 0.5 * predicted < measured < 2.0 * predicted


def test_the_same_seed_gives_the_same_runs_in_any_order(study: Study[Run]) -> None:
    config = study.config
    seeds = np.random.SeedSequence(config.seed).spawn(config.runs)
    alone = scenes.simulate(config, None, seeds[5])
    np.testing.assert_array_equal(alone.error, study.data.error[5])


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("starts=0,1", "must hold 0 and the judged"),
        ("wrong=0.6", "need 0 <= wrong < 0.5"),
        ("runs=1", "runs=1"),
    ],
)
def test_scenes_that_mean_nothing_are_refused(setting: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load("tukey-errata").configure(overrides=[setting])

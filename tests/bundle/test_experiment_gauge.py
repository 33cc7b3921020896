"""bundle-gauge: every claim is judged on a world where it is true and on one where it is false."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.experiments.bundle import gauge, gauges
from vslam_ref.experiments.framework import Study, load
from vslam_ref.support.errors import InputError

Runs = Study[gauges.Repetitions]


@pytest.fixture(scope="module")
def result() -> Runs:
    experiment = load("bundle-gauge")
    return experiment.run(experiment.configure(quick=True))


def verdicts(study: Runs) -> dict[str, str]:
    return {c.id: c.verdict for c in gauge.claims(study)}


def lost(study: Runs) -> set[str]:
    return {id for id, v in verdicts(study).items() if v != "reproduced"}


IDS = {
    "seven-directions-are-invisible",
    "one-minimum-one-set-of-images",
    "fixed-over-free",
    "badly-over-fixed",
    "what-images-show-is-as-sure-in-every-gauge",
    "covariances-are-those-of-the-repetitions",
    "two-views-held-are-five-numbers-too-many",
}


def drawn(study: Runs, runs: int = 400) -> Runs:
    """Repetitions drawn from the predicted covariances: a world in which all is as it should be."""
    rng = np.random.default_rng(5)
    config, p = dataclasses.replace(study.config, runs=runs), study.once
    error = np.stack([rng.multivariate_normal(np.zeros(21), c, runs, method="svd") for c in p.cov], axis=1)
    told = rng.standard_normal((runs, 1, 2)) * p.invariant_sd + 1.0
    cost = np.full((runs, 4), 20.0)
    cost[:, 3] += 0.5 * config.sigma**2 * rng.chisquare(5, runs)
    ran = gauges.Repetitions(cost, np.full(runs, 1e-8), error, told, np.ones(runs, dtype=bool))
    return Study(config, ran, p)


def test_the_claims_hold(result: Runs) -> None:
    assert set(verdicts(result)) == IDS
    assert not lost(result)
    assert not lost(drawn(result))
    assert gauge.figure(result).axes
    assert result.data.converged.all()


def test_each_claim_fails_where_it_is_false(result: Runs) -> None:
    study = drawn(result)
    p, runs = study.once, study.data
    for number, value in ((-1, 1e-3), (-8, 1e-12)):  # six zeros, and eight
        singular = p.singular.copy()
        singular[number] = value
        other = dataclasses.replace(study, once=p._replace(singular=singular))
        assert lost(other) == {"seven-directions-are-invisible"}
    apart = runs.apart.copy()
    apart[7] = 1e-3  # one repetition is enough
    assert lost(dataclasses.replace(study, data=runs._replace(apart=apart))) == {
        "one-minimum-one-set-of-images"
    }
    cost = runs.cost.copy()
    cost[7, 1] *= 1 + 1e-6
    assert lost(dataclasses.replace(study, data=runs._replace(cost=cost))) == {
        "one-minimum-one-set-of-images"
    }
    for rise in (6.0, 4.0):
        cost = runs.cost.copy()
        cost[:, 3] = 20.0 + 0.5 * study.config.sigma**2 * rise
        wrong = dataclasses.replace(study, data=runs._replace(cost=cost))
        assert lost(wrong) == {"two-views-held-are-five-numbers-too-many"}
    sd = p.invariant_sd.copy()
    sd[2] *= 1.001
    assert lost(dataclasses.replace(study, once=p._replace(invariant_sd=sd))) == {
        "what-images-show-is-as-sure-in-every-gauge"
    }


@pytest.mark.parametrize("factor", [0.7, 1.4])
def test_a_wrong_covariance_is_seen_on_both_sides(result: Runs, factor: float) -> None:
    study = drawn(result)
    p = study.once
    wrong = dataclasses.replace(
        study, once=p._replace(cov=factor * p.cov, invariant_sd=np.sqrt(factor) * p.invariant_sd)
    )
    assert lost(wrong) == {
        "covariances-are-those-of-the-repetitions",
        "what-images-show-is-as-sure-in-every-gauge",
    }


def test_gauges_that_differ_little_are_not_told_apart(result: Runs) -> None:
    study = drawn(result)
    runs = study.data
    error = np.repeat(runs.error[:, :1], 3, axis=1)
    same = dataclasses.replace(
        study,
        data=runs._replace(error=error),
        once=study.once._replace(cov=np.repeat(study.once.cov[:1], 3, 0)),
    )
    assert lost(same) == {"fixed-over-free", "badly-over-fixed"}


def test_what_is_held_stays(result: Runs) -> None:
    """Seven numbers in the gauges that choose, twelve where two views are tied."""
    bundle, _ = gauges.world(result.config)
    problem = bundle.problem(bundle.uv, bundle.truth)
    held = {g: int(np.sum(~gauges.held(problem, g).free.pose)) for g in gauges.GAUGES}
    assert held == {"free": 0, "fixed": 7, "badly": 7, "tied": 12}
    assert not gauges.held(problem, "badly").free.pose[1].all()  # the neighbour at a short distance


def test_free_covariance_is_the_pseudo_inverse(result: Runs) -> None:
    """The oracle knows nothing of views and points: numpy's pseudo-inverse of J^T J."""
    config = result.config
    bundle, chosen = gauges.world(config)
    J = gauges.free_jacobian(bundle)
    whole = config.sigma**2 * np.linalg.pinv(J.T @ J, rcond=1e-12)
    V = config.views
    rows = np.concatenate(
        [6 * i + np.arange(6) for i in chosen.views] + [6 * V + 3 * j + np.arange(3) for j in chosen.points]
    )
    # condition of J^T J about 1e7 in its 6 V + 3 N - 7 measured directions, times eps
    np.testing.assert_allclose(result.once.cov[0], whole[np.ix_(rows, rows)], atol=1e-7 * np.abs(whole).max())


def test_invariants_do_not_move_with_the_world(result: Runs) -> None:
    X = np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0]])
    np.testing.assert_allclose(gauges.invariants(X), [0.75, np.pi / 2])
    turned = 2.5 * X[:, [1, 2, 0]] + [1.0, 2, 3]
    np.testing.assert_allclose(gauges.invariants(turned), gauges.invariants(X))


@pytest.mark.parametrize(
    ("setting", "words"), [("runs=5", "need runs >= 20"), ("short=0.9", "need 0 < short < spread")]
)
def test_scenes_that_mean_nothing_are_refused(setting: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load("bundle-gauge").configure(overrides=[setting])

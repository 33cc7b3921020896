"""posegraph-starts: every claim is judged on a world where it is true and on one where it is false."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.experiments.framework import Study, load
from vslam_ref.experiments.posegraph import starts
from vslam_ref.support.errors import InputError

Runs = Study[starts.StartRuns]


def verdicts(study: Runs) -> dict[str, str]:
    return {claim.id: claim.verdict for claim in starts.claims(study)}


def lost(study: Runs) -> set[str]:
    return {id for id, verdict in verdicts(study).items() if verdict != "reproduced"}


def drawn(runs: int = 60) -> Runs:
    """A world in which all claims hold: odometry fails in half of the graphs at the largest noise."""
    config = dataclasses.replace(load("posegraph-starts").default(), runs=runs)
    shape = (len(config.noises), runs, 3)
    ended = np.full(shape, 100.0)
    ended[-1, ::2, 0] = 150.0
    begun = np.broadcast_to([1e4, 200.0, 120.0], shape).copy()
    return Study(config, starts.StartRuns(begun, ended, np.full(shape, 5.0)))


def changed(study: Runs, **fields: np.ndarray) -> Runs:
    return dataclasses.replace(study, data=study.data._replace(**fields))


def test_the_claims_hold_where_they_are_true() -> None:
    assert lost(drawn()) == set()
    assert len(verdicts(drawn())) == 4


def test_each_claim_fails_where_it_is_false() -> None:
    study = drawn()
    ended = study.data.ended.copy()
    ended[0, 7, 0] *= 1.0 + 1e-5  # one graph is enough
    assert lost(changed(study, ended=ended)) == {"with-little-noise-any-start-will-do"}
    begun = study.data.begun.copy()
    begun[2, 3, 1] = 2e4
    assert lost(changed(study, begun=begun)) == {"chordal-begins-lower"}
    ended = study.data.ended.copy()
    ended[2, 3, 1] = 101.0
    assert lost(changed(study, ended=ended)) == {"chordal-always-ends-at-the-best"}
    ended = np.full_like(study.data.ended, 100.0)
    assert lost(changed(study, ended=ended)) == {"chordal-bears-more-noise"}
    ended[-1, ::2, 1] = 150.0  # the other way round
    assert lost(changed(study, ended=ended)) == {
        "chordal-bears-more-noise",
        "chordal-always-ends-at-the-best",
    }


def test_rounding_is_not_another_minimum() -> None:
    study = drawn()
    noise = 1.0 + 1e-8 * np.random.default_rng(1).uniform(-1, 1, study.data.ended.shape)
    assert lost(changed(study, ended=study.data.ended * noise)) == set()


def test_a_small_run_measures_what_it_says() -> None:
    experiment = load("posegraph-starts")
    config = experiment.configure(overrides=["runs=3", "noises=1.0,24.0", "per_round=10"])
    study = experiment.run(config)
    data: starts.StartRuns = study.data
    assert data.ended.shape == (2, 3, 3)
    assert (data.ended <= data.begun * (1 + 1e-12)).all()
    assert starts.best(data)[0].all()
    # the same graphs at every noise: at the true poses chi² does not depend on it
    np.testing.assert_allclose(data.begun[0, :, 2], data.begun[1, :, 2], rtol=1e-6)
    assert starts.figure(study).axes
    assert set(starts.series(study)) >= {"share_best", "mean_steps"}


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("runs=1", "need runs >= 2"),
        ("noises=3.0,1.0", "noises above 0 that grow"),
        ("space=sim3", "expected one of se2, se3"),
    ],
)
def test_graphs_that_mean_nothing_are_refused(setting: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load("posegraph-starts").configure(overrides=[setting])

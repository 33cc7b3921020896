"""orbslam-essential: every claim where it is true and where it is false; the town itself."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.experiments.framework import Study, load
from vslam_ref.experiments.orbslam import essential
from vslam_ref.geometry import se3, sim3
from vslam_ref.support.errors import InputError
from vslam_ref.worlds.town import TownConfig, make_town

Runs = Study[essential.EssentialRun]
SMALL = TownConfig(keyframes=150, corners=2, loops=6)


def lost(study: Runs) -> set[str]:
    return {claim.id for claim in essential.claims(study) if claim.verdict != "reproduced"}


def drawn(runs: int = 20) -> Runs:
    """A world in which all claims hold: what A says, and ORB-SLAM's threshold in the middle of the best."""
    config = dataclasses.replace(load("orbslam-essential").default(), runs=runs)
    noise = 1 + 0.02 * np.random.default_rng(0).standard_normal((6, runs))
    shape = np.array([[2.0, 1.5, 1.0, 1.0, 1.0, 1.0]]).T * noise
    work = np.array([[1.0, 1.5, 3.0, 5.0, 10.0, 27.0]]).T * np.ones((1, runs))
    return Study(
        config,
        essential.EssentialRun(
            10.0 * np.ones((6, runs)), shape, 3 * shape, 1e3 * work, 8 + 0 * work, 5e7 * work, work
        ),
    )


def changed(study: Runs, field: str, graph: int, factor: float, run: slice = slice(None)) -> Runs:
    values = getattr(study.data, field).copy()
    values[graph, run] *= factor
    return dataclasses.replace(study, data=study.data._replace(**{field: values}))


def test_the_claims_hold_where_they_are_true() -> None:
    assert lost(drawn()) == set()
    assert len(essential.claims(drawn())) == 5


def test_each_claim_fails_where_it_is_false() -> None:
    study = drawn()
    assert lost(changed(study, "before", 2, 0.15, slice(3, 4))) == {"closes-the-loops"}  # one drive is enough
    worse = changed(changed(study, "after", 2, 1.2), "after", 0, 1.2)
    assert lost(worse) == {"as-accurate-as-all-edges"}
    assert lost(changed(study, "misled", 2, 1.2)) == {"bears-a-false-loop-as-well"}
    unsure = study.data.misled.copy()
    unsure[2] *= np.where(np.arange(20) % 2, 2.0, 0.5)  # the same in the mean, and nobody can say so
    wide = dataclasses.replace(study, data=study.data._replace(misled=unsure))
    assert lost(wide) == {"bears-a-false-loop-as-well"}
    assert lost(changed(study, "work", 2, 10.0, slice(5, 6))) == {"cheaper-than-all-edges"}
    assert lost(changed(study, "after", 0, 0.5)) == {"nothing-cheaper-is-as-accurate"}


def test_a_small_run_measures_what_it_says() -> None:
    experiment = load("orbslam-essential")
    config = experiment.configure(
        overrides=["runs=2", "keyframes=130", "corners=2", "loops=5", "least_shared=1e6,100,1"]
    )
    study = experiment.run(config)
    data: essential.EssentialRun = study.data
    assert data.after.shape == (3, 2)
    assert (data.edges[0] == 129).all()
    assert (np.diff(data.edges, axis=0) > 0).all()
    assert (np.diff(data.work / data.steps, axis=0) > 0).all()
    assert (data.after < data.before).all()
    np.testing.assert_array_equal(data.before[0], data.before[2])  # the same drives along every graph
    assert essential.figure(study).axes
    assert set(essential.series(study)) >= {"least_shared", "after", "seconds"}


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("runs=1", "need runs >= 2"),
        ("least_shared=100.0,50.0,1.0", "must fall, with 100 between its ends"),
        ("least_shared=1e6,1.0,100.0", "must fall"),
        ("keyframes=5", "keyframes >= 10"),
    ],
)
def test_graphs_that_mean_nothing_are_refused(setting: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load("orbslam-essential").configure(overrides=[setting])


def test_a_drive_that_never_comes_back_is_told() -> None:
    town = make_town(np.random.default_rng(0), dataclasses.replace(SMALL, loops=0))
    with pytest.raises(ValueError, match="comes back to no place"):
        essential.false_loop(town, np.random.default_rng(0))


def test_the_town_without_noise_is_mapped_as_it_is_and_its_loops_agree() -> None:
    exact = dataclasses.replace(
        SMALL, turn=0.0, sideways=0.0, log_scale=0.0, loop_m=0.0, loop_rad=0.0, loop_log=0.0
    )
    town = make_town(np.random.default_rng(1), exact)
    np.testing.assert_allclose(town.T_kf_world, town.true, atol=1e-9)
    assert len(town.loops) == 6
    i, j = town.loops.T
    assert (j > i).all()
    np.testing.assert_allclose(town.S_loop, se3.compose(town.true[i], se3.inverse(town.true[j])), atol=1e-9)
    # the camera looks where it goes
    X = se3.inverse(town.true)
    ahead = np.einsum("ki,ki->k", X[:-1, :3, 2], np.diff(X[:, :3, 3], axis=0))
    assert (ahead > 0.9 * np.linalg.norm(np.diff(X[:, :3, 3], axis=0), axis=1)).all()
    np.testing.assert_allclose(np.linalg.det(X[:, :3, :3]), 1.0, atol=1e-12)


def test_a_loop_brings_the_later_unit_back_to_the_earlier_one() -> None:
    """With exact loops S_i_j takes a point at j, in the unit that the map has there, to where it is at i."""
    c = dataclasses.replace(SMALL, turn=0.0, sideways=0.0, log_scale=0.02, loop_m=0, loop_rad=0, loop_log=0)
    town = make_town(np.random.default_rng(2), c)
    # the step after a keyframe was mapped in its unit
    X, true = se3.inverse(town.T_kf_world), se3.inverse(town.true)
    unit = np.linalg.norm(np.diff(X[:, :3, 3], axis=0), axis=1)
    unit /= np.linalg.norm(np.diff(true[:, :3, 3], axis=0), axis=1)
    steps = town.loops[:, 1] < len(unit)
    for (i, j), S in zip(town.loops[steps], town.S_loop[steps], strict=True):
        X_j = np.array([1.0, -0.5, 6.0])
        at_i = se3.act(town.true[i] @ true[j], X_j)
        np.testing.assert_allclose(sim3.act(S, unit[j] * X_j), unit[i] * at_i, atol=1e-9)


def test_common_points_join_neighbours_in_time_only() -> None:
    town = make_town(np.random.default_rng(3), SMALL)
    K = len(town.true)
    np.testing.assert_array_equal(town.shared, town.shared.T)
    assert (np.diag(town.shared, 1) > 0).all()
    lag = np.abs(np.arange(K)[:, None] - np.arange(K))
    assert (town.shared[lag * 3.3 > 120.0] == 0).all()
    assert (town.parent[1:] < np.arange(1, K)).all()

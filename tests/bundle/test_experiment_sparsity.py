"""bundle-sparsity: every claim is judged on a world where it is true and on one where it is false."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.sparse import csc_array

from vslam_ref.experiments.bundle import counts, elimination, sparsity
from vslam_ref.experiments.framework import Study, load
from vslam_ref.support.errors import InputError

Runs = Study[counts.Walk]


@pytest.fixture(scope="module")
def result() -> Runs:
    experiment = load("bundle-sparsity")
    return experiment.run(experiment.configure(quick=True))


@pytest.fixture
def simulated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VSLAM_REF_DATA", "")


def verdicts(study: Runs) -> dict[str, str]:
    return {c.id: c.verdict for c in sparsity.claims(study)}


def lost(study: Runs) -> set[str]:
    return {id for id, v in verdicts(study).items() if v != "reproduced"}


IDS = {
    "the-matrix-is-an-arrow",
    "two-views-meet-where-they-share-a-point",
    "points-first",
    "a-walk-costs-what-it-is-long",
    "order-makes-the-band",
}


def test_the_claims_hold(result: Runs) -> None:
    assert set(verdicts(result)) == IDS
    assert not lost(result)
    assert sparsity.figure(result).axes


@pytest.mark.usefixtures("simulated")
def test_the_claims_hold_of_a_simulation() -> None:
    experiment = load("bundle-sparsity")
    found = experiment.run(experiment.configure(quick=True))
    assert not found.once.arrow.real
    assert not lost(found)


def test_each_claim_fails_where_it_is_false(result: Runs) -> None:
    study, drawn = result, result.once
    d, V = drawn.arrow.d, len(drawn.arrow.sees)
    view, point = np.argwhere(drawn.arrow.sees)[0]
    unseen = np.argwhere(~drawn.arrow.sees)[0]
    tip = d * V
    for row, column in ((0, d), (tip, tip + 3), (d * unseen[0], tip + 3 * unseen[1])):
        H = drawn.arrow.H.copy()
        H[row, column] = H[column, row] = 1e-9  # two views, two points, a view that does not see the point
        assert lost(dataclasses.replace(study, once=drawn._replace(arrow=drawn.arrow._replace(H=H)))) == {
            "the-matrix-is-an-arrow"
        }
    H = drawn.arrow.H.copy()
    H[d * view : d * view + d, tip + 3 * point : tip + 3 * point + 3] = (
        0.0  # an observation that tells nothing
    )
    assert lost(dataclasses.replace(study, once=drawn._replace(arrow=drawn.arrow._replace(H=H)))) == {
        "the-matrix-is-an-arrow"
    }
    walks = sparsity.walks(study)
    for change, id in (
        ({"missing": 1}, "two-views-meet-where-they-share-a-point"),
        ({"extra": 1}, "two-views-meet-where-they-share-a-point"),
        ({"difference": 1e-6}, "order-makes-the-band"),
        ({"shuffled": 2 * walks.banded[-1]}, "order-makes-the-band"),
        ({"points": 8 * walks.points[-2]}, "a-walk-costs-what-it-is-long"),
        ({"dense": 4 * walks.dense[-2]}, "a-walk-costs-what-it-is-long"),
    ):
        [(name, value)] = change.items()
        column = getattr(study.data, name).copy()
        column[-1] = value  # of the longest walk
        assert lost(dataclasses.replace(study, data=study.data._replace(**{name: column}))) == {id}
    for change in (
        {"points_first": 1.001 * drawn.counts.predicted},
        {"views_first": 2 * drawn.counts.predicted},
    ):
        other = drawn._replace(counts=drawn.counts._replace(**change))
        assert lost(dataclasses.replace(study, once=other)) == {"points-first"}


def test_counts_of_closed_forms() -> None:
    """Sums over columns of c^2: full, banded, and an arrow that points the right and the wrong way."""
    n, w = 12, 3
    everything = np.arange(n)
    full = csc_array(np.ones((n, n)) + n * np.eye(n))
    assert elimination.elimination_cost(full, everything)[0] == elimination.dense_cost(n) == 650
    near = np.abs(everything[:, None] - everything) <= w
    band = csc_array(near + n * np.eye(n))
    assert (
        elimination.elimination_cost(band, everything)[0]
        == elimination.banded_cost(n, w)
        == 9 * 16 + 9 + 4 + 1
    )
    arrow = n * np.eye(n)
    arrow[0] = arrow[:, 0] = 1.0
    arrow[0, 0] = 2.0 * n
    assert elimination.elimination_cost(csc_array(arrow), everything)[0] == 650  # the hub first: all fills
    assert elimination.elimination_cost(csc_array(arrow), everything[::-1])[0] == 11 * 4 + 1
    # a point that two views of six columns see has columns of 15, 14 and 13 numbers
    assert elimination.point_cost(np.array([2]), 6) == 225 + 196 + 169


def test_differences_agree_with_the_derivatives() -> None:
    config = counts.SparsityConfig(views=(10, 11, 12), points_per_view=4)
    problem = counts.walk(config, 10)
    J = elimination.analytic(problem).toarray()
    # central differences, steps of 1e-6 on 500 px: h^2 from the series, eps * 500 / h from rounding
    np.testing.assert_allclose(elimination.differenced(problem), J, atol=1e-5 * np.abs(J).max())
    zeros = elimination.differenced(problem) == 0.0
    assert (zeros | (J != 0.0)).all()


def test_the_walk_has_lost_its_order() -> None:
    config = counts.SparsityConfig()
    T = counts.walk(config, 30).scene.T_cam_world
    step = np.abs(np.diff(T[:, 0, 3]))
    assert np.median(step) > 2.0  # neighbours in the file are not neighbours on the way
    np.testing.assert_allclose(np.sort(-T[:, 0, 3]), 0.5 * np.arange(30))


@pytest.mark.parametrize(
    ("setting", "words"), [("views=60,30,15", "rising numbers"), ("reach=9", "1 <= reach <= 3")]
)
def test_what_cannot_be_counted_is_refused(setting: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load("bundle-sparsity").configure(overrides=[setting])

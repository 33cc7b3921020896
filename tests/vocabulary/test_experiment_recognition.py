"""orbslam-recognition: every claim is judged on a world where it is true and on one where it is false."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vslam_ref.datasets import catalogue
from vslam_ref.experiments.framework import Study, load
from vslam_ref.experiments.orbslam import corridor, lookalikes, recognition, recognition_walks
from vslam_ref.experiments.orbslam.lookalikes import SeenPictures
from vslam_ref.support.errors import InputError

K, REVISITS = 84, 44


def walk_of(found: int, wrong: int = 0, alone: int = 30) -> SeenPictures:
    """Of 84 pictures the last 44 are revisits; some are accepted, some wrongly, ``alone`` by their score."""
    rows = np.arange(K)
    revisit = rows >= K - REVISITS
    right = revisit & (rows < K - REVISITS + 43)
    accepted = right & (rows < K - REVISITS + found)
    accepted |= rows < wrong
    score = np.where(rows < K - REVISITS, 0.3, 0.2)
    score[K - REVISITS : K - REVISITS + alone] = 0.5
    return SeenPictures(np.full(K, 3), np.where(right, 40, 9), accepted, right, ~right, np.full(K, 3), score)


def drawn(
    found: int = 39, wrong: int = 0, alone: int = 30, first: tuple[int, ...] = (41, 42, 43, 44)
) -> Study:
    """A world in which all claims hold."""
    config = load("orbslam-recognition").default()
    seen = walk_of(found, wrong, alone)
    rows = np.arange(K)
    walked = recognition_walks.Walked(
        ["1000", "4000", "10000", "40000", "foreign"],
        [1000, 4000, 10000, 40000, 700],
        [seen] * 5,
        [(rows >= K - REVISITS) & (rows < K - REVISITS + n) for n in (*first, 9)],
        REVISITS,
    )
    shape = (config.runs, 90 + 45)  # a picture a metre, and every second one
    revisit = np.broadcast_to(np.r_[np.arange(90) >= 45, np.arange(45) >= 22], shape)
    data = recognition_walks.RecognitionRuns(
        np.full(shape, 2),
        np.where(revisit, 50, 12),
        revisit.copy(),
        revisit.copy(),
        ~revisit,
        np.full(shape, 2),
        np.where(revisit, 0.4, 0.1),
        revisit,
    )
    return Study(config, data, walked)


def lost(study: Study) -> set[str]:
    return {claim.id for claim in recognition.claims(study) if claim.verdict != "reproduced"}


def test_the_claims_hold_where_they_are_true() -> None:
    assert lost(drawn()) == set()
    assert len(recognition.claims(drawn())) == 4
    assert lost(drawn(found=37)) == set()
    assert lost(drawn(first=(42, 40, 42, 44))) == set()


def test_each_claim_fails_where_it_is_false() -> None:
    assert lost(drawn(found=36)) == {"corridor-is-recognised"}
    assert lost(drawn(wrong=1)) == {"corridor-is-recognised", "geometry-finds-more-than-words"}
    assert lost(drawn(found=39, alone=39)) == {"geometry-finds-more-than-words"}
    assert lost(drawn(first=(43, 40, 42, 44))) == {"ten-thousand-words-are-enough"}
    assert lost(drawn(first=(40, 40, 41, 44))) == {"ten-thousand-words-are-enough"}


def with_accepted(study: Study, run: int, places: int | slice, value: bool) -> Study:
    accepted = study.data.accepted.copy()
    accepted[run, places] = value
    return replace(study, data=study.data._replace(accepted=accepted))


def test_one_building_is_enough_to_lose_the_look_alikes() -> None:
    study = drawn()
    one = {"lookalikes-are-told-apart"}
    assert lost(with_accepted(study, 3, 10, True)) == one  # a picture of the first round: wrong
    assert lost(with_accepted(study, 3, 95, True)) == one  # at the other spacing
    few = with_accepted(study, 2, slice(45, 50), False)  # 40 of 45 are less than nine of ten
    assert lost(few) == one
    assert lost(with_accepted(few, 2, 45, True)) == set()
    assert lost(with_accepted(study, 2, slice(112, 130), False)) == set()  # told, and not asked for


def test_the_rates_of_the_look_alikes_have_intervals() -> None:
    """Two of 5 x (45 + 22) wrong candidates, in one of five buildings; Wilson's ends by hand.

    335 tries, 2 hits, z^2 = 3.8415: (2 + 1.9207 -+ 1.96 sqrt(2 * 333 / 335 + 0.9604)) / 338.8415.
    """
    study = with_accepted(drawn(), 3, slice(10, 12), True)
    (claim,) = (c for c in recognition.claims(study) if c.id == "lookalikes-are-told-apart")
    rates = claim.measured["rates"]
    assert rates["wrong"][:2] == (2, 335)
    assert rates["wrong"][2:] == pytest.approx([0.00164, 0.02150], abs=1e-5)
    assert rates["buildings"][:2] == (1, 5)
    assert rates["buildings"][2:] == pytest.approx([0.0362, 0.6245], abs=1e-4)  # published tables of Wilson's
    assert rates["found"][:2] == (225, 225)
    assert rates["found_sparse"][:2] == (115, 115)


def test_precision_and_recall_end_with_all_pictures() -> None:
    value = np.array([3.0, 1.0, 3.0, 2.0])
    right = np.array([True, False, False, True])
    precision, recall = recognition.precision_recall(value, right, 5)
    assert precision.tolist() == [0.5, 2 / 3, 0.5]  # equal values together
    assert recall.tolist() == [0.2, 0.4, 0.4]
    assert recognition.without_error(value, right) == 0  # a tie with a wrong one is no victory


def test_the_rule_of_the_thresholds() -> None:
    """A tenth above the wrong candidates' most, rounded up; after a sure place near it, and half at least."""
    flags = np.zeros(6, np.bool_)
    right = np.array([True, False, False, False, True, False])
    seen = SeenPictures(
        np.array([1, 2, 40, 41, 7, 20]),
        np.array([99, 18, 19, 30, 60, 29]),
        flags,
        right,
        ~right,
        flags,
        flags,
    )
    # most of wrong: 30, so sure 33; near after a sure one: 18 after 99; 30 follows 19; 29 after 60 is far off
    assert lookalikes.choose([seen], 3) == (33, 20)
    apart = seen._replace(entry=np.array([1, 9, 40, 41, 7, 20]))
    assert lookalikes.choose([apart], 3) == (33, 17)  # half of 33
    assert lookalikes.choose([apart, seen], 3) == (33, 20)


def test_decided_is_what_the_recogniser_decides() -> None:
    """Chains go on from an accepted place, and end at a gap, in place or in support."""
    flags = np.zeros(7, np.bool_)
    seen = SeenPictures(
        np.array([3, 4, 5, 6, 30, 31, 32]), np.array([12, 20, 12, 12, 12, 9, 12]), *[flags] * 5
    )
    expected = [False, True, True, True, False, False, False]
    assert lookalikes.decided(seen, (20, 11), 3).tolist() == expected
    assert lookalikes.decided(seen, (20, 20), 3).tolist() == [False, True, *[False] * 5]


def test_revisits_are_of_the_second_round_and_not_just_before() -> None:
    right = np.zeros((8, 8), np.bool_)
    right[3, 0] = right[5, 1] = right[6, 4] = right[7, 4] = True
    assert np.flatnonzero(lookalikes.revisits(right, 2)).tolist() == [5, 7]


def test_the_buildings_that_chose_are_not_judged() -> None:
    with pytest.raises(InputError, match="those below chose"):
        load("orbslam-recognition").configure(seed=21)
    assert max(lookalikes.CHOOSING) < 100


def test_without_the_data_nothing_is_run(monkeypatch: pytest.MonkeyPatch) -> None:
    experiment = load("orbslam-recognition")
    monkeypatch.setenv("VSLAM_REF_DATA", "")
    assert "rtabmap_loop_samples" in experiment.missing(experiment.default())


@pytest.mark.filterwarnings("ignore:Glyph")
def test_the_figure_and_the_series_are_drawn_from_the_numbers() -> None:
    study = drawn()
    told = recognition.series(study)
    assert told["accepted_10000"] == [39, 0]
    figure = recognition.figure(study)
    assert len(figure.axes) == 2
    assert len(figure.axes[0].lines) == 8


def test_the_corridor_has_its_revisits() -> None:
    folder = catalogue.find(corridor.NAME)
    if folder is None:
        pytest.skip(f"{corridor.NAME} is not installed")
    from vslam_ref.datasets.pictures import read_grey

    same = read_grey(folder / "samples_GT.bmp") > 127
    assert (same.shape, int(same.sum()), int(same.any(1).sum())) == ((84, 84), 228, 44)

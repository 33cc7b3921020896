"""orbslam-recognition: every claim is judged on a world where it is true and on one where it is false."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vslam_ref.datasets import catalogue
from vslam_ref.experiments.framework import Study, load
from vslam_ref.experiments.orbslam import corridor, lookalikes, recognition
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
    walked = recognition.Walked(
        [1000, 4000, 10000, 40000],
        [seen] * 4,
        [(rows >= K - REVISITS) & (rows < K - REVISITS + n) for n in first],
        REVISITS,
    )
    shape = (config.runs, 90)
    revisit = np.broadcast_to(np.arange(90) >= 45, shape)
    data = recognition.RecognitionRuns(
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


def test_one_building_is_enough_to_lose_the_look_alikes() -> None:
    study = drawn()
    accepted = study.data.accepted.copy()
    accepted[3, 10] = True  # a picture of the first round: wrong
    assert lost(replace(study, data=study.data._replace(accepted=accepted))) == {"lookalikes-are-told-apart"}
    accepted = study.data.accepted.copy()
    accepted[2, 45:50] = False  # 40 of 45 are less than nine of ten
    assert lost(replace(study, data=study.data._replace(accepted=accepted))) == {"lookalikes-are-told-apart"}
    accepted[2, 45] = True
    assert lost(replace(study, data=study.data._replace(accepted=accepted))) == set()


def test_precision_and_recall_end_with_all_pictures() -> None:
    value = np.array([3.0, 1.0, 3.0, 2.0])
    right = np.array([True, False, False, True])
    precision, recall = recognition.precision_recall(value, right, 5)
    assert precision.tolist() == [0.5, 2 / 3, 0.5]  # equal values together
    assert recall.tolist() == [0.2, 0.4, 0.4]
    assert recognition.without_error(value, right) == 0  # a tie with a wrong one is no victory


def test_the_rule_of_the_thresholds() -> None:
    """A tenth above the wrong candidates' most, rounded up; agreement needs neighbours, in time and place."""
    flags = np.zeros(5, np.bool_)
    seen = SeenPictures(
        np.array([1, 2, 40, 41, 7]),
        np.array([99, 18, 19, 30, 29]),
        flags,
        np.array([True, False, False, False, True]),
        np.array([False, True, True, True, False]),
        flags,
        flags,
    )
    # most of wrong: 30; of two together: (99, 18) near and (19, 30) near; (18, 19) and (30, 29) are far apart
    assert lookalikes.choose([seen], 3) == (33, 21)
    few = replace_support(seen, 10)
    assert lookalikes.choose([few, seen], 3) == (33, 21)


def replace_support(seen: SeenPictures, support: int) -> SeenPictures:
    return seen._replace(support=np.full(5, float(support)))


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

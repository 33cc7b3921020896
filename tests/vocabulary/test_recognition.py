"""Recognition: candidates by groups, pairs by geometry, acceptance by squares and by the picture before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vslam_ref.features.vocabulary import Bag, Database, Vocabulary, train
from vslam_ref.systems.orbslam import recognition
from vslam_ref.systems.orbslam.recognition import Recogniser
from vslam_ref.systems.orbslam.recognition_settings import RecognitionSettings

FOCAL, SIZE = 300.0, np.array([512, 384])


def place(rng: np.random.Generator, n: int = 150) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3) before the camera, metres, directions, and descriptors."""
    depth = rng.uniform(3, 8, n)
    uv = rng.uniform(0, SIZE, (n, 2))
    X = np.column_stack([(uv - SIZE / 2) / FOCAL * depth[:, None], depth])
    return X, rng.uniform(-np.pi, np.pi, n), rng.integers(0, 256, (n, 32), dtype=np.uint8)


def seen(
    where: tuple[np.ndarray, np.ndarray, np.ndarray],
    rng: np.random.Generator,
    shift: float,
    only: slice = slice(None),
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A picture from ``shift`` metres to the side: 0.5 px of noise, bits turned with a chance of 5 %."""
    X, angle, descriptor = (part[only] for part in where)
    Y = X - [shift, 0.0, 0.3 * shift]
    uv = FOCAL * Y[:, :2] / Y[:, 2:] + SIZE / 2 + rng.normal(0, 0.5, (len(X), 2))
    flips = np.packbits(rng.random((len(X), 256)) < 0.05, axis=1)
    return uv, angle + rng.normal(0, 0.03, len(X)), descriptor ^ flips


@pytest.fixture(scope="module")
def places() -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    return [place(np.random.default_rng(k)) for k in range(14)]


@pytest.fixture(scope="module")
def vocabulary(places: list[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> Vocabulary:
    return train([one[2] for one in places], np.random.default_rng(0), branching=8, levels=3)


def test_places_are_recognised_and_no_others(places, vocabulary: Vocabulary) -> None:
    """Fourteen places, then four of them again, and one that is new."""
    rng = np.random.default_rng(1)
    recogniser = Recogniser(vocabulary, rng)
    first = [recogniser.see(*seen(one, rng, 0.0)) for one in places]
    assert all(one.entry == -1 for one in first)
    for k in (0, 1, 2, 5):
        again = recogniser.see(*seen(places[k], rng, 0.4))
        assert again.entry == k
        assert (again.best.first == again.best.second).mean() > 0.95  # features keep their numbers here
        assert len(again.best.first) > 75
    assert recogniser.see(*seen(place(np.random.default_rng(99)), rng, 0.0)).entry == -1


def test_the_last_pictures_are_no_candidates(places, vocabulary: Vocabulary) -> None:
    rng = np.random.default_rng(2)
    recogniser = Recogniser(vocabulary, rng, RecognitionSettings(gap=3))
    for one in places[:4]:
        recogniser.see(*seen(one, rng, 0.0))
    assert recogniser.see(*seen(places[2], rng, 0.2)).entry == -1
    assert recogniser.see(*seen(places[0], rng, 0.2)).entry == 0


def test_pairs_that_crowd_on_one_thing_are_not_enough(places, vocabulary: Vocabulary) -> None:
    """A poster: sixty points of a place, in one part of the picture, among points of another place."""
    rng = np.random.default_rng(3)
    old, new = place(rng), place(rng)
    poster = place(rng, 60)
    poster[0][:, 2] = 4.0
    poster[0][:, :2] = rng.uniform(-0.5, 0.5, (60, 2))  # 75 pixels wide
    joined = [tuple(np.concatenate(parts) for parts in zip(one, poster, strict=True)) for one in (old, new)]
    recogniser = Recogniser(vocabulary, rng)
    recogniser.see(*seen(joined[0], rng, 0.0))
    for one in places:
        recogniser.see(*seen(one, rng, 0.0))
    found = recogniser.see(*seen(joined[1], rng, 0.3))
    assert found.best.entry == 0
    assert len(found.best.first) > 30  # many inliers
    assert found.best.squares <= 16  # 4 x 4 squares of 32 px cover 75 px, wherever it lies
    assert found.entry == -1


def test_support_counts_squares_by_the_share_of_pairs_that_agree(places, vocabulary: Vocabulary) -> None:
    """Ninety points of one place; sixty others have moved, each elsewhere: pairs that agree in nothing.

    By accident a moved one lies within 3 px of its epipolar line: of 384 px some 6, so one of sixty is
    expected, and a model that chases accidents may find some more.
    """
    rng = np.random.default_rng(8)
    uv, angle, bits = seen(places[0], rng, 0.0)
    there, turned, other = seen(places[0], rng, 0.3)
    there[90:] = rng.uniform(0, SIZE, (60, 2))
    settings = RecognitionSettings()
    a = recognition.described(vocabulary, uv, angle, bits, settings.level)
    b = recognition.described(vocabulary, there, turned, other, settings.level)
    found = recognition.verified(a, b, 0, rng, settings)
    assert 80 <= len(found.first) <= 100
    assert (found.first < 90).mean() > 0.9
    assert 0.5 * found.squares < found.support < 0.7 * found.squares  # 90 of 150 are 0.6


def doubtful(places, vocabulary: Vocabulary, sure: float) -> list[int]:
    """Of 14 places seen again: 1 whole, 2 and 3 in part, one elsewhere, the next to 3; what is recognised."""
    rng = np.random.default_rng(4)
    recogniser = Recogniser(vocabulary, rng, replace(RecognitionSettings(), sure=sure, likely=15))
    for one in places:
        recogniser.see(*seen(one, rng, 0.0))
    few, whole = slice(0, 60), slice(0, 150)
    again = [(1, whole), (2, few), (3, few), (0, slice(0, 8)), (4, few)]
    return [recogniser.see(*seen(places[k], rng, 0.3, part)).entry for k, part in again]


def test_less_is_enough_after_a_recognised_place_near_it(places, vocabulary: Vocabulary) -> None:
    """All 150 points hold some 85 squares or more of 192, 60 points some 40 to 50; a chain ends at a gap."""
    assert doubtful(places, vocabulary, 60) == [1, 2, 3, -1, -1]


def test_doubtful_pictures_are_no_more_certain_together(places, vocabulary: Vocabulary) -> None:
    """The same pictures, none of which is sure alone: nothing is accepted."""
    assert doubtful(places, vocabulary, 190) == [-1] * 5


def test_candidates_are_the_best_of_groups_of_neighbours() -> None:
    """Scores 0.2 0.3 0.2 beside each other are worth more than a 0.5 alone; words decide who is asked."""
    index = Database(10)
    for share in (0.2, 0.3, 0.2, 0.0, 0.0, 0.0, 0.5, 0.0, 0.01):
        index.add(
            Bag(np.array([0, 9]), np.array([share, 1 - share])) if share else Bag(np.array([8]), np.ones(1))
        )
    query = Bag(np.array([0]), np.ones(1))
    everyone = np.ones(len(index), np.bool_)
    settings = RecognitionSettings(reach=1, group=0.5)
    found = recognition.proposed(index, query, 0.05, everyone, settings)
    assert found.entry.tolist() == [1, 6]
    assert found.score == pytest.approx([0.7, 0.5])
    alone = recognition.proposed(index, query, 0.05, everyone, replace(settings, reach=0, candidates=1))
    assert alone.entry.tolist() == [6]
    strict = recognition.proposed(index, query, 0.6, everyone, settings)
    assert strict.entry.tolist() == []
    some = recognition.proposed(index, query, 0.05, np.arange(len(index)) >= 3, settings)
    assert some.entry.tolist() == [6]


def test_the_same_generator_gives_the_same_answer(places, vocabulary: Vocabulary) -> None:
    def run() -> list[tuple[int, int]]:
        rng = np.random.default_rng(5)
        recogniser = Recogniser(vocabulary, np.random.default_rng(6))
        found = [recogniser.see(*seen(places[k % 14], rng, 0.1)) for k in range(18)]
        return [(one.entry, one.best.squares) for one in found]

    assert run() == run()


def test_a_picture_without_features_is_nothing(places, vocabulary: Vocabulary) -> None:
    recogniser = Recogniser(vocabulary, np.random.default_rng(0), RecognitionSettings(gap=0))
    nothing = (np.zeros((0, 2)), np.zeros(0), np.zeros((0, 32), np.uint8))
    for _ in range(3):
        assert recogniser.see(*nothing).entry == -1
    recogniser.see(*seen(places[0], np.random.default_rng(0), 0.0))
    assert recogniser.see(*nothing).entry == -1


@pytest.mark.parametrize(
    "wrong",
    [{"relative": 2.0}, {"gap": -1}, {"candidates": 0}, {"pixels": 0.0}, {"likely": 40}, {"square": -1.0}],
)
def test_settings_that_mean_nothing_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="need"):
        RecognitionSettings(**wrong)  # type: ignore[arg-type]

"""Weights and scores by hand, by the relation of L1 and the minimum, and by DBoW2's own pictures."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vslam_ref.datasets import catalogue
from vslam_ref.datasets.vocabulary_files import read_vocabulary, shipped_vocabulary
from vslam_ref.features.orb import OrbSettings, extract
from vslam_ref.features.vocabulary import Bag, Database, Vocabulary, bag, best, score, words
from vslam_ref.worlds.rendered import scene

EMPTY = Bag(np.zeros(0, np.int64), np.zeros(0))
EPS = float(np.finfo(float).eps)


def flat(weight: list[float]) -> Vocabulary:
    n = len(weight)
    return Vocabulary(np.array([n] + [0] * n), np.zeros((n + 1, 32), np.uint8), np.array(weight))


def test_weights_by_hand() -> None:
    """Weights 1, 2, 0, 4; words 0 0 1 2 2 3: 2 of 1, 1 of 2, none of 0, 1 of 4, together 8."""
    found = bag(flat([1.0, 2.0, 0.0, 4.0]), [3, 2, 0, 1, 0, 2])
    assert found.word.tolist() == [0, 1, 3]
    assert found.value.tolist() == [0.25, 0.25, 0.5]


def test_score_by_hand() -> None:
    a = Bag(np.array([1, 3, 4]), np.array([0.5, 0.3, 0.2]))
    b = Bag(np.array([0, 3, 4]), np.array([0.1, 0.1, 0.8]))
    assert score(a, b) == pytest.approx(0.3, rel=2 * EPS)  # min(0.3, 0.1) + min(0.2, 0.8)
    assert score(a, Bag(np.array([0]), np.ones(1))) == 0.0


def test_a_picture_without_words_scores_nothing() -> None:
    """Not one half, as 1 - |a - b| / 2 would say."""
    silent = bag(flat([0.0, 1.0]), [0, 0])
    assert len(silent.word) == 0
    assert score(silent, Bag(np.array([1]), np.ones(1))) == 0.0
    assert score(EMPTY, EMPTY) == 0.0
    index = Database(2)
    index.add(silent)
    assert len(index.query(Bag(np.array([1]), np.ones(1))).entry) == 0
    assert len(index.query(EMPTY).entry) == 0


@st.composite
def bags(draw: st.DrawFn) -> Bag:
    """Some of twenty words; weights from 0.01 to 1, normalised."""
    word = draw(st.lists(st.integers(0, 19), min_size=1, max_size=15, unique=True))
    value = np.array(draw(st.lists(st.floats(0.01, 1.0), min_size=len(word), max_size=len(word))))
    return Bag(np.sort(np.array(word)), value / value.sum())


@given(bags(), bags())
def test_the_minimum_is_one_less_half_the_distance(a: Bag, b: Bag) -> None:
    """The published relation for vectors that sum to 1; 20 terms, each rounded a few times."""
    dense = np.zeros((2, 20))
    for row, one in zip(dense, (a, b), strict=True):
        row[one.word] = one.value
    assert abs(score(a, b) - (1 - 0.5 * np.abs(dense[0] - dense[1]).sum())) < 60 * EPS
    assert score(a, b) == score(b, a)
    assert score(a, a) == pytest.approx(1.0, abs=20 * EPS)


@given(st.lists(bags(), min_size=1, max_size=6), bags())
def test_the_index_scores_as_pair_by_pair(pictures: list[Bag], query: Bag) -> None:
    index = Database(20)
    for one in pictures:
        index.add(one)
    found = index.query(query)
    common = [len(np.intersect1d(one.word, query.word)) for one in pictures]
    assert found.entry.tolist() == [k for k, n in enumerate(common) if n]
    assert found.common.tolist() == [n for n in common if n]
    for entry, value in zip(found.entry, found.score, strict=True):
        assert abs(value - score(pictures[entry], query)) < 20 * EPS
    top = best(found, 2)
    assert (np.diff(top.score) <= 0).all()
    assert len(top.entry) == min(2, len(found.entry))
    assert top.score[:1].tolist() == ([found.score.max()] if len(found.score) else [])


def test_a_removed_picture_is_not_found() -> None:
    index = Database(3)
    one = Bag(np.array([0, 2]), np.array([0.5, 0.5]))
    for _ in range(3):
        index.add(one)
    index.remove(1)
    assert index.query(one).entry.tolist() == [0, 2]
    assert index.query(one, np.array([False, True, True])).entry.tolist() == [2]
    assert index.add(one) == 3
    for entry in (1, 4, -1):
        with pytest.raises(ValueError, match=f"entry {entry}"):
            index.remove(entry)
    with pytest.raises(ValueError, match="allowed has shape"):
        index.query(one, np.array([True]))


def test_a_word_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match="words from 0 to 2"):
        bag(flat([1.0, 1.0]), [0, 2])


NUMBERS = {
    "kimera_small_voc": (692, 0.2331, 0.1795),
    "slambook2_vocabulary": (4983, 0.2629, 0.2346),
}
"""Words, score of pictures 1 and 3 of DBoW2's demo, and the next best of all pairs."""


@pytest.mark.parametrize("name", NUMBERS)
def test_scores_of_dbow2s_demo(name: str) -> None:
    """Four digits, with OpenCV's ORB; another OpenCV may find other corners."""
    folder, demo = catalogue.find("dbow2_vocab_small"), catalogue.find("dbow2_demo")
    if folder is None or demo is None:
        pytest.skip("dbow2_vocab_small or dbow2_demo is not installed")
    count, expected, following = NUMBERS[name]
    v = read_vocabulary(folder / f"{name}.yml.gz").vocabulary
    assert v.words == count
    orb = cv2.ORB_create(500)
    pictures = [cv2.imread(str(demo / f"image{k}.png"), cv2.IMREAD_GRAYSCALE) for k in range(4)]
    seen = [bag(v, words(v, orb.detectAndCompute(one, None)[1])) for one in pictures]
    scores = sorted((score(seen[a], seen[b]), (a, b)) for a in range(4) for b in range(a))
    assert scores[-1][1] == (3, 1)
    assert [round(value, 4) for value, _ in scores[-2:]] == [following, expected]


def test_the_shipped_vocabulary_puts_the_same_place_first() -> None:
    v = shipped_vocabulary()
    assert 9000 <= v.words <= 10_000
    assert Path(read_vocabulary.__code__.co_filename).with_name("orb_words.npz").stat().st_size < 400_000
    made = [scene("desk", 7), scene("corridor", 7)]  # seeds that were not trained on
    frames = [one.frame(k) for one in made for k in (0, 6)]
    few = OrbSettings(features=300)
    seen = [bag(v, words(v, extract(frame, few).descriptor)) for frame in frames]
    for a, other in ((0, 1), (1, 0), (2, 3), (3, 2)):
        rest = [score(seen[a], seen[k]) for k in range(4) if k not in (a, other)]
        assert score(seen[a], seen[other]) > max(rest)

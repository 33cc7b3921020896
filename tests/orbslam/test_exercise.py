"""Exercise 14.1: recognition by words that a reader has written."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from vslam_ref.features import vocabulary

EXERCISE = "14_words"


def some(seed: int, n: int) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, (n, 32), dtype=np.uint8)


def test_bits_are_counted(answer: ModuleType) -> None:
    a = np.array([[0b0, 0b0], [0b1111, 0b1]], np.uint8)
    b = np.array([[0b1, 0b0], [0b1111, 0b1], [0xFF, 0xFF]], np.uint8)
    found = np.asarray(answer.bits_that_differ(a, b))
    np.testing.assert_array_equal(found, [[1, 5, 16], [4, 0, 11]], err_msg="not the bits that differ")
    a, b = some(1, 5), some(2, 7)
    expected = [[sum(int(x ^ y).bit_count() for x, y in zip(p, q, strict=True)) for q in b] for p in a]
    np.testing.assert_array_equal(answer.bits_that_differ(a, b), expected, err_msg="32 bytes each")


TREE = [[1, 2], [3, 4, 5], [6, 7], [], [], [], [], []]


def test_the_way_down_goes_to_the_nearest_child(answer: ModuleType) -> None:
    node, features = some(3, 8), some(4, 60)
    tree = vocabulary.Vocabulary(np.array([2, 3, 2, 0, 0, 0, 0, 0]), node, np.ones(5))
    found = np.asarray(answer.words(TREE, node, features))
    expected = vocabulary.descend(tree, features).node
    np.testing.assert_array_equal(found, expected, err_msg="a feature does not end in its leaf")


def test_of_equally_near_children_the_first_is_taken(answer: ModuleType) -> None:
    node = np.zeros((8, 32), np.uint8)
    node[1, 0], node[2, 1] = 1, 1  # one bit each: both are one bit from nothing
    found = answer.words(TREE, node, np.zeros((1, 32), np.uint8))
    assert list(found) == [3], "children are equally near: take the first of them"


def test_weights_sum_to_one(answer: ModuleType) -> None:
    idf = {3: 1.0, 4: 2.0, 5: 0.0, 6: 0.5}
    found = answer.bag(np.array([3, 4, 3, 5, 5]), idf)
    assert set(found) == {3, 4}, "only words that occur and say something have a weight"
    assert found[3] == pytest.approx(0.5), "word 3: twice, idf 1, of 4 in all"
    assert found[4] == pytest.approx(0.5), "word 4: once, idf 2, of 4 in all"


def test_a_picture_without_words_has_none(answer: ModuleType) -> None:
    assert answer.bag(np.array([5, 5]), {5: 0.0}) == {}, "words that say nothing are none"
    assert answer.bag(np.zeros(0, int), {5: 1.0}) == {}, "no feature, no word"
    assert answer.score({}, {3: 1.0}) == 0, "a picture without words is like no other: not one half"
    assert answer.score({}, {}) == 0, "two pictures without words have nothing in common"


def test_scores(answer: ModuleType) -> None:
    v, w = {0: 0.25, 4: 0.75}, {3: 0.6, 4: 0.4}
    assert answer.score(v, w) == pytest.approx(0.4), "the common word 4: the smaller of 0.75 and 0.4"
    assert answer.score(v, v) == pytest.approx(1.0), "a picture and itself"
    assert answer.score(v, {7: 1.0}) == 0, "no common word"


def test_all_together(answer: ModuleType) -> None:
    node, leaves = some(5, 8), [3, 4, 5, 6, 7]
    weight = np.array([0.3, 1.1, 0.0, 2.0, 0.7])
    tree = vocabulary.Vocabulary(np.array([2, 3, 2, 0, 0, 0, 0, 0]), node, weight)
    a, b = some(6, 40), some(7, 30)
    expected = vocabulary.score(*(vocabulary.bag(tree, vocabulary.words(tree, f)) for f in (a, b)))
    idf = dict(zip(leaves, weight.tolist(), strict=True))
    bags = [answer.bag(np.asarray(answer.words(TREE, node, f)), idf) for f in (a, b)]
    assert answer.score(*bags) == pytest.approx(expected, rel=1e-12), "the score of two pictures"

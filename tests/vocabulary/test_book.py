"""The plain loops and the fast forms give the same tree, words, weights and scores."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from vslam_ref.features import vocabulary
from vslam_ref.features.vocabulary import book, training


def bits(descriptor: np.ndarray) -> list[book.Bits]:
    return [tuple(row) for row in np.unpackbits(descriptor, axis=1).tolist()]


def drawn(seed: int, n: int) -> np.ndarray:
    """Few different bytes: distances are often equal."""
    rng = np.random.default_rng(seed)
    return np.repeat(rng.integers(0, 256, (n, 4), dtype=np.uint8), 8, 1)


def nested(v: vocabulary.Vocabulary) -> book.TreeNode:
    nodes = [book.TreeNode(tuple(b)) for b in np.unpackbits(v.descriptor, axis=1).tolist()]
    for k, node in enumerate(nodes):
        first = int(v.first[k])
        node.children, node.word = nodes[first : first + int(v.children[k])], int(v.word[k])
    return nodes[0]


def test_one_level_is_parted_alike() -> None:
    for seed in range(6):
        descriptor = drawn(seed, 40)
        fast = training.part(descriptor, np.random.default_rng(seed), 5)
        centres, label = book.k_medians(bits(descriptor), 5, np.random.default_rng(seed))
        assert fast.label.tolist() == label
        assert bits(fast.centre) == centres


def test_words_weights_and_scores_are_those_of_the_loops() -> None:
    pictures = [drawn(seed, 30) for seed in range(4)]
    v = vocabulary.train(pictures, np.random.default_rng(0), branching=4, levels=3)
    root = nested(v)
    words = [[book.descend(root, one) for one in bits(picture)] for picture in pictures]
    for own, picture in zip(words, pictures, strict=True):
        assert vocabulary.words(v, picture).tolist() == own
    weight = [book.idf(words, w) for w in range(v.words)]
    # a logarithm and a quotient: both round by half a unit in the last place
    np.testing.assert_allclose(v.weight, weight, rtol=0, atol=1e-15)
    bags = [vocabulary.bag(v, own) for own in words]
    plain = [book.weigh(own, weight) for own in words]
    index: dict[int, list[tuple[int, float]]] = defaultdict(list)
    database = vocabulary.Database(v.words)
    for k, (bag, words_of) in enumerate(zip(bags, plain, strict=True)):
        assert dict(zip(bag.word.tolist(), bag.value.round(14).tolist(), strict=True)) == {
            w: round(x, 14) for w, x in sorted(words_of.items())
        }
        database.add(bag)
        for w, x in words_of.items():
            index[w].append((k, x))
    for a, b in ((0, 1), (2, 2), (3, 0)):
        # at most 30 terms of at most 1
        assert abs(vocabulary.score(bags[a], bags[b]) - book.score(plain[a], plain[b])) < 30 * 2.3e-16
    asked = book.ask(index, plain[1])
    found = database.query(bags[1])
    assert found.entry.tolist() == sorted(asked)
    np.testing.assert_allclose(found.score, [asked[k] for k in sorted(asked)], rtol=0, atol=1e-14)

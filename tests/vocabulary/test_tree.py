"""The tree: levels, parents, descent, ancestors; what is no tree is refused."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.features.vocabulary import Vocabulary, descend, from_parents, nodes_at_level, words

CHILDREN = np.array([2, 3, 2, 0, 0, 0, 0, 0])


def made(seed: int = 0, children: np.ndarray = CHILDREN) -> Vocabulary:
    rng = np.random.default_rng(seed)
    leaves = int((children == 0).sum())
    return Vocabulary(
        children, rng.integers(0, 256, (len(children), 32), dtype=np.uint8), rng.uniform(0, 2, leaves)
    )


def test_levels_parents_and_words() -> None:
    v = made()
    assert v.parent.tolist() == [-1, 0, 0, 1, 1, 1, 2, 2]
    assert v.level.tolist() == [0, 1, 1, 2, 2, 2, 2, 2]
    assert v.word.tolist() == [-1, -1, -1, 0, 1, 2, 3, 4]
    assert (v.words, v.levels, v.branching) == (5, 2, 3)


def test_leaves_of_different_levels() -> None:
    v = made(children=np.array([3, 0, 2, 0, 0, 1, 0]))
    assert v.level.tolist() == [0, 1, 1, 1, 2, 2, 3]
    assert v.node.tolist() == [1, 3, 4, 6]


def brute(v: Vocabulary, descriptor: np.ndarray) -> int:
    node = 0
    while v.children[node]:
        below = [k for k in range(len(v.parent)) if v.parent[k] == node]
        differing = [int(np.unpackbits(v.descriptor[k] ^ descriptor).sum()) for k in below]
        node = below[int(np.argmin(differing))]
    return node


def test_descent_follows_the_nearest_child() -> None:
    v = made(3)
    descriptor = np.random.default_rng(4).integers(0, 256, (60, 32), dtype=np.uint8)
    found = descend(v, descriptor)
    assert found.node.tolist() == [brute(v, one) for one in descriptor]
    own = np.unpackbits(v.descriptor[found.node] ^ descriptor, axis=1).sum(1)
    assert found.distance.tolist() == own.tolist()
    assert words(v, descriptor).tolist() == v.word[found.node].tolist()


def test_of_equally_near_children_the_first_is_taken() -> None:
    v = Vocabulary(np.array([3, 0, 0, 0]), np.zeros((4, 32), np.uint8), np.ones(3))
    assert words(v, np.full((2, 32), 255, np.uint8)).tolist() == [0, 0]


def test_no_feature_is_no_word() -> None:
    assert words(made(), np.zeros((0, 32), np.uint8)).shape == (0,)


def test_ancestors_on_a_level() -> None:
    v = made(children=np.array([3, 0, 2, 0, 0, 1, 0]))
    assert nodes_at_level(v, v.node, 0).tolist() == [0, 0, 0, 0]
    assert nodes_at_level(v, v.node, 1).tolist() == [1, 3, 2, 2]
    assert nodes_at_level(v, v.node, 2).tolist() == [1, 3, 4, 5]
    assert nodes_at_level(v, v.node, 9).tolist() == v.node.tolist()
    with pytest.raises(ValueError, match="level -1"):
        nodes_at_level(v, v.node, -1)


def test_nodes_in_any_order_become_the_same_tree() -> None:
    v = made(5)
    rng = np.random.default_rng(6)
    # children of a node keep their order, whatever stands between them
    order = np.concatenate([[0], 1 + np.argsort(rng.random(7) + np.repeat([0, 9], [2, 5]), kind="stable")])
    order[1:3] = np.sort(order[1:3])
    order[3:] = np.sort(order[3:])[[0, 3, 1, 4, 2]]
    place = np.argsort(order)
    parent = np.where(v.parent[order] < 0, -1, place[v.parent[order]])
    back = from_parents(parent, v.descriptor[order], v.weight, place[v.node])
    assert back.children.tolist() == v.children.tolist()
    assert (back.descriptor == v.descriptor).all()
    assert back.node.tolist() == v.node.tolist()
    assert (back.weight == v.weight).all()


@pytest.mark.parametrize(
    ("children", "what"),
    [
        ([2, 0], "add up"),
        ([2, 0, 0, 0], "add up"),
        ([0, 1, 0], "add up|level by level"),
        ([1, 0, 1, 0], "level by level"),
        ([-1, 3, 0, 0], "counts"),
        ([0], "two nodes"),
    ],
)
def test_what_is_no_tree_is_refused(children: list[int], what: str) -> None:
    with pytest.raises(ValueError, match=what):
        Vocabulary(np.array(children), np.zeros((len(children), 32), np.uint8), np.ones(children.count(0)))


def test_wrong_words_and_weights_are_refused() -> None:
    v = made()
    for weight, what in (
        (np.ones(4), "weight has shape"),
        (-np.ones(5), "negative"),
        (np.full(5, np.nan), "finite"),
    ):
        with pytest.raises(ValueError, match=what):
            Vocabulary(v.children, v.descriptor, weight)
    for node in ([3, 4, 5, 6, 6], [2, 4, 5, 6, 7], [3, 4, 5, 6]):
        with pytest.raises(ValueError, match="each leaf once"):
            Vocabulary(v.children, v.descriptor, np.ones(5), np.array(node))
    with pytest.raises(ValueError, match="need bytes"):
        Vocabulary(v.children, v.descriptor[:, :31], v.weight)
    with pytest.raises(ValueError, match="need bytes"):
        descend(v, np.zeros((2, 32)))
    for parent in ([-1, 2, 1], [-1, 0, 5], [0, 0, 0]):
        with pytest.raises(ValueError, match=r"cycle|parent"):
            from_parents(parent, np.zeros((3, 32), np.uint8), [1.0], [2])

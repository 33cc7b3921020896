"""A vocabulary in plain loops: train one level, descend, weigh, score, and ask an inverted index.

Descriptors are lists of bits, 0 and 1; a tree is nested lists.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np

Bits = tuple[int, ...]
Words = dict[int, float]


def hamming(a: Bits, b: Bits) -> int:
    """Bits in which two descriptors differ."""
    return sum(x != y for x, y in zip(a, b, strict=True))


def median(members: list[Bits]) -> Bits:
    """Bit by bit what most members have; a draw becomes 1."""
    return tuple(int(2 * sum(bits) >= len(members)) for bits in zip(*members, strict=True))  # eq-word-median


def nearest(descriptor: Bits, centres: list[Bits]) -> int:
    """Number of the nearest centre, the first one of equals."""
    distance = [hamming(descriptor, centre) for centre in centres]
    return distance.index(min(distance))


def first_centres(descriptors: list[Bits], k: int, rng: np.random.Generator) -> list[Bits]:
    """Some of the descriptors, each drawn with the distance to the nearest one before as its share."""
    centres = [descriptors[int(rng.integers(len(descriptors)))]]
    while len(centres) < k:
        total, until = 0, []
        for d in descriptors:
            total += min(hamming(d, centre) for centre in centres)
            until.append(total)
        if total == 0:  # all are centres
            break
        drawn = rng.uniform(0.0, total)
        centres.append(next(d for d, u in zip(descriptors, until, strict=True) if u > drawn))
    return centres


def k_medians(descriptors: list[Bits], k: int, rng: np.random.Generator) -> tuple[list[Bits], list[int]]:
    """Centres of one level, and which each descriptor has: assign, take medians, until nothing changes."""
    centres, before = first_centres(descriptors, k, rng), [-1] * len(descriptors)
    while True:
        label = [nearest(d, centres) for d in descriptors]
        used = sorted(set(label))
        label = [used.index(one) for one in label]  # centres without a member are left out
        if label == before:
            return centres, label
        before = label
        centres = [
            median([d for d, one in zip(descriptors, label, strict=True) if one == c])
            for c in range(len(used))
        ]


@dataclass
class TreeNode:
    """A centre with what is below it; a leaf has the number of its word."""

    centre: Bits = ()
    children: list[TreeNode] = field(default_factory=list)
    word: int = -1


def descend(root: TreeNode, descriptor: Bits) -> int:
    """Word of a descriptor: at each node on to the nearest child."""
    node = root
    while node.children:
        node = node.children[nearest(descriptor, [child.centre for child in node.children])]
    return node.word


def idf(pictures: list[list[int]], word: int) -> float:
    """How much a word says, no unit: log of all pictures over those that have it, 0 if none has."""
    having = sum(word in words for words in pictures)
    return math.log(len(pictures) / having) if having else 0.0  # eq-idf


def weigh(words: list[int], weight: list[float]) -> Words:
    """Weights of a picture's words, no unit: sum of their idf over that of all; without those of weight 0."""
    value: Words = defaultdict(float)
    for word in words:
        if weight[word] > 0:
            value[word] += weight[word]
    total = sum(value.values())
    return {word: one / total for word, one in value.items()}  # eq-bag


def score(a: Words, b: Words) -> float:
    """How alike two pictures are, a ratio; without a common word 0, not one half."""
    return sum(min(a[word], b[word]) for word in a if word in b)  # eq-bag-score


def ask(index: dict[int, list[tuple[int, float]]], query: Words) -> dict[int, float]:
    """Scores of all pictures that share a word: the inverted index has (picture, weight) for each word."""
    scores: dict[int, float] = defaultdict(float)
    for word, value in query.items():
        for picture, other in index.get(word, []):
            scores[picture] += min(value, other)
    return dict(scores)

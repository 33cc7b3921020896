"""Chapter 14: directions and descriptors, words of a vocabulary, and what closes a loop."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.features.hamming import distances
from vslam_ref.features.orb.description import describe, smooth
from vslam_ref.features.orb.direction import moments, towards
from vslam_ref.features.vocabulary.bags import Bag, bag, score
from vslam_ref.features.vocabulary.training import inverse_document_frequency
from vslam_ref.features.vocabulary.tree import Vocabulary, descend
from vslam_ref.geometry.alignment import align_triples
from vslam_ref.systems.orbslam.essential_graph import essential_edges

Array = NDArray[Any]
BYTES = 32


def _bytes(given: Array) -> NDArray[np.uint8]:
    return np.asarray(given).astype(np.uint8)


def _angle(image: Array) -> float:
    x, y = towards(moments(_bytes(image), [[15, 15]]))[0]
    return float(np.arctan2(y, x))


def _descriptor(image: Array, pairs: Array, angle: float) -> Array:
    middle = np.array([[image.shape[1] // 2, image.shape[0] // 2]])
    direction = [[np.cos(angle), np.sin(angle)]]
    found: Array = describe(smooth(_bytes(image)), middle, direction, pairs.astype(np.int64))[0]
    return found


def _idf(picture: Array, word: Array, pictures: float, words: float) -> Array:
    return inverse_document_frequency([word[picture == k] for k in range(int(pictures))], int(words))


def _bag(weight: Array, word: Array) -> Array:
    n = len(weight)
    flat = Vocabulary(np.array([n] + [0] * n), np.zeros((n + 1, BYTES), np.uint8), weight)
    found, whole = bag(flat, word), np.zeros(n)
    whole[found.word] = found.value
    return whole


def _sparse(v: Array) -> Bag:
    word = np.flatnonzero(v)
    return Bag(word, v[word])


def _descend(children: Array, descriptor: Array, feature: Array) -> Array:
    words = np.ones(int((children == 0).sum()))
    return descend(Vocabulary(children.astype(np.int64), _bytes(descriptor), words), _bytes(feature)).node


def _three_points(source: Array, target: Array) -> Array:
    found = align_triples(source, target)
    if not found.valid:
        raise ValueError(f"the corners lie at {found.reason}")
    return found.S_target_source


def _essential(shared: Array, parent: Array, loops: Array, theta_min: float) -> Array:
    edges = essential_edges(shared, parent, loops, theta_min=theta_min)
    return np.stack([edges.tail, edges.head], 1)


TABLE: Answers = {
    "orb.moments": lambda image: moments(_bytes(image), [[15, 15]])[0],
    "orb.angle": _angle,
    "orb.smooth": lambda image: smooth(_bytes(image)),
    "orb.descriptor": _descriptor,
    "orb.hamming": lambda a, b: int(distances(_bytes(a)[None], _bytes(b)[None])[0, 0]),
    "vocabulary.idf": _idf,
    "vocabulary.bag": _bag,
    "vocabulary.score": lambda v, w: score(_sparse(v), _sparse(w)),
    "vocabulary.descend": _descend,
    "loops.three_points": _three_points,
    "loops.essential_edges": _essential,
}

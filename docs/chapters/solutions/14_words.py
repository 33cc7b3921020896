"""Solution of exercise 14.1."""

import numpy as np


def bits_that_differ(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Exclusive or, and count the ones."""
    return np.unpackbits(a[:, None] ^ b[None], axis=2).sum(2, dtype=int)


def words(children: list[list[int]], node: np.ndarray, descriptor: np.ndarray) -> np.ndarray:
    """One feature after another; argmin takes the first of equals."""
    found = np.zeros(len(descriptor), dtype=int)
    for i, feature in enumerate(descriptor):
        at = 0
        while below := children[at]:
            at = below[int(np.argmin(bits_that_differ(feature[None], node[below])))]
        found[i] = at
    return found


def bag(word: np.ndarray, idf: dict[int, float]) -> dict[int, float]:
    """Count, weigh, and divide by the sum."""
    found, count = np.unique(word, return_counts=True)
    weight = {int(w): int(n) * idf[int(w)] for w, n in zip(found, count, strict=True) if idf[int(w)] > 0}
    total = sum(weight.values())
    return {w: value / total for w, value in weight.items()}


def score(v: dict[int, float], w: dict[int, float]) -> float:
    """Common weights: 0 where there are none, also for a picture without words."""
    return sum(min(v[word], w[word]) for word in v.keys() & w.keys())

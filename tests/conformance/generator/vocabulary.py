"""A vocabulary: weights of words, bags, scores in fractions of logarithms, and the way down a small tree."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.draws import digits
from generator.exact import vector
from generator.features import _case as case

TOPIC, CHAPTER = "vocabulary", 14

NOTES = {
    "idf-inverted": ("your weight is turned over: common words weigh less than nothing", "log(N_i / N)"),
    "occurrences-counted": (
        "you count how often a word occurs; pictures that have it count",
        "log(N / n_i), n_i occurrences",
    ),
    "occurrences-only": ("you count features, not pictures", "log(sum n / n_i)"),
    "base-two": ("your logarithm is that of base 2; the natural one was asked for", "log2(N / N_i)"),
    "smoothed": ("you add one to the pictures that have a word", "log(N / (1 + N_i))"),
    "unseen-once": ("a word that no picture has weighs 0; you count it as seen once", "log(N / 1)"),
    "not-normalised": ("your bag does not add up to 1", "n_i idf_i"),
    "idf-forgotten": ("your bag counts words, whatever they say", "n_i / n"),
    "once-each": ("you count each word of a picture once", "idf_i / sum_j idf_j"),
    "over-all-features": (
        "you divide by the number of features, not by the sum of the weights",
        "n_i idf_i / n",
    ),
    "unit-length": ("your bag has length 1; its weights must add up to 1", "v / |v|_2"),
    "blank-is-half": (
        "a picture without words is half as good as everything for you; it scores 0",
        "1 - |v - w|_1 / 2",
    ),
    "distance": ("your score is a distance: 0 for equal pictures", "|v - w|_1 / 2"),
    "norm-not-halved": ("you take the whole norm from 1", "1 - |v - w|_1"),
    "product": ("your score is the scalar product", "v . w"),
    "larger-of-two": ("you add up the larger of two weights", "sum max(v_i, w_i)"),
    "last-of-equals": ("of equally near children you take the last; the first was asked for", "<= for <"),
    "nearest-of-all": ("you search all leaves; the way goes down the tree", "arg min over the leaves"),
    "farthest": ("you go to the farthest child", "arg max d"),
    "one-level": ("you stop after one level", "a child of the root"),
    "bytes-counted": ("you count bytes that differ; bits count", "sum [a_k != b_k] of bytes"),
}
OF_IDF = ("idf-inverted", "occurrences-counted", "occurrences-only", "base-two", "smoothed", "unseen-once")
OF_BAG = ("not-normalised", "idf-forgotten", "once-each", "over-all-features", "unit-length")
OF_SCORE = ("blank-is-half", "distance", "norm-not-halved", "product", "larger-of-two")
OF_TREE = ("last-of-equals", "nearest-of-all", "farthest", "one-level", "bytes-counted")
WORDS = 6


def build(rng: np.random.Generator) -> Topic:
    """All groups of words."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    fine = tolerance(1e-14, "a logarithm, and sums of a few positive numbers: some eps", absolute=1e-15)
    logs, sums = "logarithms in 50 digits", "sums in 50 digits"
    cases = [_idf(rng, pictures) for pictures in (4, 7, 9, 12)]
    topic.group("vocabulary.idf", "eq-idf", logs, fine, cases)
    cases = [_bag(rng, n) for n in (5, 9, 14, 20)]
    topic.group("vocabulary.bag", "eq-bag", sums, fine, cases)
    cases = [_bag_of(weight, word) for weight, word in (([0.5, 2.0, 0.0], []), ([0.5, 2.0, 0.0], [2, 2]))]
    topic.group("vocabulary.bag", "eq-bag", sums, fine, cases, flags="blank")
    cases = [_score(_drawn(rng), _drawn(rng)) for _ in range(5)]
    topic.group("vocabulary.score", "eq-bag-score", sums, fine, cases)
    blank = np.zeros(WORDS)
    cases = [_score(_drawn(rng), blank), _score(blank, _drawn(rng))]
    topic.group("vocabulary.score", "eq-bag-score", sums, fine, cases, flags="blank")
    exact = tolerance(1e-15, "whole numbers", float32=1e-6)
    for flag, count in (("", 2), ("equals", 2)):
        cases = [_tree(rng, flag) for _ in range(count)]
        oracle = "bits counted one by one"
        topic.group("vocabulary.descend", "eq-hamming", oracle, exact, cases, flags=flag)
    return topic


def _idf(rng: np.random.Generator, N: int) -> dict[str, Any]:
    """Features of N pictures, each with its picture and its word; the last word is nobody's."""
    picture = np.sort(np.concatenate([np.arange(N), rng.integers(0, N, 3 * N)]))
    word = rng.choice(WORDS - 1, 4 * N, p=[0.45, 0.25, 0.15, 0.1, 0.05])
    rows = list(zip(picture.tolist(), word.tolist(), strict=True))
    inputs = {"picture": picture, "word": word, "pictures": N, "words": WORDS}
    wrong = {note: _weights(rows, N, note) for note in OF_IDF}
    return case(inputs, "weight", _weights(rows, N), wrong)


def _weights(rows: list[tuple[int, int]], N: int, wrong: str = "") -> list[float]:
    found = []
    for i in range(WORDS):
        occurrences = sum(w == i for _, w in rows)
        having = len({p for p, w in rows if w == i})
        if not having:
            found.append(float(mpmath.log(N)) if wrong == "unseen-once" else 0.0)
            continue
        ratio = {
            "idf-inverted": mpf(having) / N,
            "occurrences-counted": mpf(N) / occurrences,
            "occurrences-only": mpf(len(rows)) / occurrences,
            "smoothed": mpf(N) / (1 + having),
        }.get(wrong, mpf(N) / having)
        found.append(float(mpmath.log(ratio, 2) if wrong == "base-two" else mpmath.log(ratio)))
    return found


def _bag(rng: np.random.Generator, n: int) -> dict[str, Any]:
    weight = digits(rng.uniform(0.2, 3.0, WORDS))
    weight[2] = 0.0
    return _bag_of(weight.tolist(), [0, 0, 3, 2, *rng.integers(0, WORDS, n - 4).tolist()])


def _bag_of(weight: list[float], word: list[int]) -> dict[str, Any]:
    wrong = {note: _bagged(weight, word, note) for note in OF_BAG} if any(weight[w] for w in word) else {}
    return case({"weight": weight, "word": word}, "value", _bagged(weight, word), wrong)


def _bagged(weight: list[float], word: list[int], wrong: str = "") -> list[float]:
    idf = [mpf(1)] * len(weight) if wrong == "idf-forgotten" else vector(weight)
    count = [word.count(i) for i in range(len(weight))]
    if wrong == "once-each":
        count = [min(n, 1) for n in count]
    value = [n * w for n, w in zip(count, idf, strict=True)]
    total = sum(value)
    if wrong == "unit-length":
        total = mpmath.sqrt(sum(v * v for v in value))
    if wrong == "over-all-features":
        total = mpf(len(word))
    if wrong == "not-normalised" or not total:
        total = mpf(1)
    return [float(v / total) for v in value]


def _drawn(rng: np.random.Generator) -> Any:
    """Weights of a picture in 64ths, so that their doubles add up to 1 exactly; some are 0."""
    share = rng.multinomial(64, [0.3, 0.25, 0.2, 0.15, 0.1, 0.0])
    gone = int(rng.integers(1, WORDS - 1))
    share[0] += share[gone]
    share[gone] = 0
    return share / 64


def _score(v: Any, w: Any) -> dict[str, Any]:
    wrong = {note: _scored(v, w, note) for note in OF_SCORE}
    return case({"v": v, "w": w}, "score", _scored(v, w), wrong)


def _scored(v: Any, w: Any, wrong: str = "") -> float:
    pairs = list(zip(vector(v), vector(w), strict=True))
    norm = sum(abs(a - b) for a, b in pairs)
    return float(
        {
            "blank-is-half": 1 - norm / 2,
            "distance": norm / 2,
            "norm-not-halved": 1 - norm,
            "product": sum(a * b for a, b in pairs),
            "larger-of-two": sum(max(a, b) for a, b in pairs),
        }.get(wrong, sum(min(a, b) for a, b in pairs))
    )


def _tree(rng: np.random.Generator, flag: str) -> dict[str, Any]:
    """Three children, of which two have three and two children; some features are as near to two."""
    children = [3, 3, 0, 2, 0, 0, 0, 0, 0]
    node = rng.integers(0, 256, (len(children), 32))
    node[0] = 0
    features = rng.integers(0, 256, (6, 32))
    if flag == "equals":
        # one bit of each byte more: the first and the third child are as far from what is like node 4
        node[1], node[3], node[5] = node[4] ^ 64, node[4] ^ 128, node[4]
        features[:4] = node[4] ^ rng.integers(0, 8, (4, 32))
    descriptor, asked = node.tolist(), features.tolist()
    inputs = {"children": children, "descriptor": descriptor, "feature": asked}
    wrong = {note: [_descended(children, descriptor, f, note) for f in asked] for note in OF_TREE}
    return case(inputs, "node", [_descended(children, descriptor, f) for f in asked], wrong)


def _far(a: list[int], b: list[int], wrong: str) -> int:
    if wrong == "bytes-counted":
        return sum(p != q for p, q in zip(a, b, strict=True))
    return sum((p ^ q).bit_count() for p, q in zip(a, b, strict=True))


def _descended(children: list[int], node: list[list[int]], feature: list[int], wrong: str = "") -> int:
    at = 0
    while children[at]:
        first = 1 + sum(children[:at])
        below = list(range(first, first + children[at]))
        if wrong == "nearest-of-all":
            below = [k for k, n in enumerate(children) if n == 0]
        if wrong == "last-of-equals":
            below.reverse()
        far = [_far(node[k], feature, wrong) for k in below]
        at = below[far.index(max(far) if wrong == "farthest" else min(far))]
        if wrong == "one-level":
            break
    return at

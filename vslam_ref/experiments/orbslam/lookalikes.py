"""Recognition in rendered look-alikes, and how its two thresholds are chosen there.

    python -m vslam_ref.experiments.orbslam.lookalikes        # print the choice, and what it rests on

The rule: ``sure`` is a tenth more than the most support of a wrong candidate, one whose picture shares no
scene point with the query; ``likely`` is a tenth more than the most support of a wrong candidate that
follows a sure one near it, and at least half of ``sure``; both rounded up.  Each building is walked with a
picture a metre and with one every two metres.  The seeds here are for choosing only.
"""

from __future__ import annotations

import math
import sys
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.datasets.vocabulary_files import shipped_vocabulary
from vslam_ref.features.orb import OrbSettings, extract
from vslam_ref.features.vocabulary import Vocabulary
from vslam_ref.systems.orbslam.recognition import Recogniser, Recognition
from vslam_ref.systems.orbslam.recognition_settings import RecognitionSettings
from vslam_ref.worlds.rendered import Effects
from vslam_ref.worlds.rendered.lookalikes import lookalikes, overlap
from vslam_ref.worlds.rendered.record import RenderedScene

CHOOSING = (51, 52, 53, 54)
EFFECTS = Effects(noise=3.0, exposure=0.15, shutter=0.01, blur_samples=3)
PICTURES = 90
"""Of two rounds, a picture a metre."""
STEPS = (1, 2)
"""All pictures, and every second of them."""
FEATURES = OrbSettings(features=1000)
MARGIN = 1.1
FLOOR = 0.5
"""Least share of ``sure`` that ``likely`` is: few wrong candidates follow an accepted one, perhaps none."""
SEEN = 0.2
"""Share of a picture that an earlier one must show, too, for the place to count as seen before."""
Bytes = NDArray[np.uint8]


class SeenPictures(NamedTuple):
    """Pictures one after the other, what was best in each, and whether it was right.

    Attributes
    ----------
    entry : ndarray of int, shape (K,)
        The best candidate of each picture, -1 without one.
    support : ndarray, shape (K,)
        Of its pairs, squares.
    accepted : ndarray of bool, shape (K,)
    right, wrong : ndarray of bool, shape (K,)
        Whether it shows the same place; whether it shares no scene point.  Some do neither.
    first : ndarray of int, shape (K,)
        The picture with the highest score of the words, -1 without one.
    score : ndarray, shape (K,)
        Its score.
    """

    entry: IntArray
    support: Array
    accepted: BoolArray
    right: BoolArray
    wrong: BoolArray
    first: IntArray
    score: Array


class PictureFeatures(NamedTuple):
    """Of a picture: pixels (N, 2), angles (N,), radians, and descriptors (N, 32)."""

    uv: Array
    angle: Array
    descriptor: Bytes


def features(image: Bytes) -> PictureFeatures:
    """Features of a picture (H, W)."""
    found = extract(image, FEATURES)
    return PictureFeatures(found.uv, found.angle, found.descriptor)


def world(seed: int, pictures: int = PICTURES) -> RenderedScene:
    """The look-alikes of a seed."""
    return lookalikes(seed, pictures=pictures, effects=EFFECTS)


def recognised(
    given: list[PictureFeatures], vocabulary: Vocabulary, settings: RecognitionSettings, seed: int
) -> tuple[list[Recognition], IntArray, Array]:
    """Recognise pictures in their order; with them the first by score of each, and its score."""
    recogniser = Recogniser(vocabulary, np.random.default_rng(seed), settings)
    found, first, score = [], np.full(len(given), -1), np.zeros(len(given))
    for k, one in enumerate(given):
        found.append(recogniser.see(*one))
        allowed = np.arange(k + 1) < k - settings.gap
        by_score = recogniser.index.query(recogniser.pictures[k].bag, allowed)
        if len(by_score.entry):
            best = int(np.argmax(by_score.score))
            first[k], score[k] = by_score.entry[best], by_score.score[best]
    return found, first, score


def judged_by(
    recognitions: tuple[list[Recognition], IntArray, Array], right: BoolArray, wrong: BoolArray
) -> SeenPictures:
    """What was recognised, beside the truth: ``right`` and ``wrong`` (K, K), picture and candidate."""
    found, first, score = recognitions
    entry = np.array([one.best.entry for one in found])
    rows, there = np.arange(len(found)), entry >= 0
    return SeenPictures(
        entry,
        np.array([one.best.support for one in found]),
        np.array([one.entry >= 0 for one in found]),
        there & right[rows, entry],
        there & wrong[rows, entry],
        first,
        score,
    )


def truth(shared: Array) -> tuple[BoolArray, BoolArray]:
    """Pairs (K, K) of one place, and pairs without a common scene point, from shares (K, K)."""
    most = np.maximum(shared, shared.T)
    return most >= SEEN, most == 0.0


def choose(worlds: list[SeenPictures], near: int) -> tuple[int, int]:
    """The two thresholds, by the rule above, from the best candidates of worlds.

    Examples
    --------
    >>> none, good = np.zeros(4, bool), np.array([True, False, False, True])
    >>> one = SeenPictures(np.array([5, 7, 10, 5]), np.array([60, 12, 19, 50]), none, good, ~good, none, none)
    >>> choose([one], 3)
    (21, 14)
    """
    sure = math.ceil(MARGIN * max(float(one.support[one.wrong].max(initial=0)) for one in worlds))
    after = 0.0
    for one in worlds:
        follows = (one.support[:-1] >= sure) & (np.abs(np.diff(one.entry)) <= near)
        after = max(after, float(one.support[1:][one.wrong[1:] & follows].max(initial=0)))
    return sure, math.ceil(max(MARGIN * after, FLOOR * sure))


def decided(seen: SeenPictures, thresholds: tuple[float, float], near: int) -> BoolArray:
    """Which pictures (K,) of a walk the thresholds ``sure`` and ``likely`` accept.

    Examples
    --------
    >>> flags = np.zeros(4, bool)
    >>> seen = SeenPictures(np.array([5, 6, 7, 40]), np.array([30, 12, 12, 12]), *[flags] * 5)
    >>> decided(seen, (20, 11), 3).tolist()
    [True, True, True, False]
    """
    accepted = np.zeros(len(seen.entry), np.bool_)
    for k, (entry, support) in enumerate(zip(seen.entry, seen.support, strict=True)):
        follows = k > 0 and accepted[k - 1] and abs(entry - seen.entry[k - 1]) <= near
        accepted[k] = support >= thresholds[0] or (follows and support >= thresholds[1])
    return accepted


def spaced(
    seed: int, vocabulary: Vocabulary, pictures: int = PICTURES
) -> list[tuple[SeenPictures, BoolArray]]:
    """One building, all its pictures and every second of them; with both, which (K,) are revisits."""
    made = world(seed, pictures)
    given, shared = [features(made.frame(k)) for k in range(len(made))], overlap(made)
    told = []
    for step in STEPS:
        settings = RecognitionSettings(gap=RecognitionSettings().gap // step)
        right, wrong = truth(shared[::step, ::step])
        seen = judged_by(recognised(given[::step], vocabulary, settings, seed), right, wrong)
        told.append((seen, revisits(right, settings.gap)))
    return told


def revisits(right: BoolArray, gap: int) -> BoolArray:
    """Pictures (K,) of the second round whose place one shows that counts; of pairs (K, K) of one place.

    In the first round, one end of a corridor sees the other.
    """
    return np.tril(right, -gap - 1).any(1) & (np.arange(len(right)) >= len(right) // 2)


def main() -> int:
    """Print the choice."""
    near, vocabulary = RecognitionSettings().near, shipped_vocabulary()
    walks: list[tuple[SeenPictures, BoolArray]] = []
    for seed in CHOOSING:
        for step, (seen, back) in zip(STEPS, spaced(seed, vocabulary), strict=True):
            walks.append((seen, back))
            most = np.sort(seen.support[seen.wrong])[:-4:-1].round(1).tolist()
            low = np.percentile(seen.support[seen.right & back], [0, 10, 50]).round(1).tolist()
            print(
                f"building {seed}, a picture every {step} m: {back.sum()} revisits, right candidates "
                f"{(seen.right & back).sum()}, support least, tenth, half {low}; "
                f"wrong candidates {seen.wrong.sum()}, most support {most}",
                flush=True,
            )
    chosen = choose([seen for seen, _ in walks], near)
    print(f"sure {chosen[0]}, likely {chosen[1]}")
    for step in STEPS:
        some = walks[STEPS.index(step) :: len(STEPS)]
        taken = [(decided(seen, chosen, near), seen, back) for seen, back in some]
        found = sum(int((accepted & seen.right & back).sum()) for accepted, seen, back in taken)
        wrong = sum(int((accepted & seen.wrong).sum()) for accepted, seen, _ in taken)
        asked = sum(int(back.sum()) for _, back in some)
        print(f"a picture every {step} m: {found} of {asked} revisits accepted, {wrong} wrong places")
    return 0


if __name__ == "__main__":
    sys.exit(main())

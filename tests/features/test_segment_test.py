"""FAST by brute force at every pixel, and OpenCV's FAST-9, recorded and live: the same pixels, or not."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from vslam_ref.datasets import catalogue
from vslam_ref.features.corners import detect, in_rows, is_peak
from vslam_ref.features.fast import corner_score, segment_test

Bytes = NDArray[np.uint8]
REFERENCE = catalogue.find("opencv_reference")
RECORDED = {
    "box": ("opencv_samples", "planar/box.png"),
    "kitti": ("kitti07_head", "image_0/000000.png"),
    "euroc": ("euroc_calib", "cam0.png"),
}
pytestmark = pytest.mark.usefixtures("backend")


def plain_score(image: Bytes, x: int, y: int, arc: int) -> int:
    """Every threshold from the largest on, every start of an arc; the circle from its equation.

    The 16 pixels are those whose distance from the centre rounds to 3, in the order of their angles.
    """
    ring = [(dx, dy) for dx in range(-3, 4) for dy in range(-3, 4) if round(float(np.hypot(dx, dy))) == 3]
    ring.sort(key=lambda p: np.arctan2(p[1], p[0]))
    assert len(ring) == 16
    difference = [int(image[y + dy, x + dx]) - int(image[y, x]) for dx, dy in ring]
    for threshold in range(254, -1, -1):
        for sign in (1, -1):
            runs = [sign * d > threshold for d in difference] * 2
            if any(all(runs[k : k + arc]) for k in range(16)):
                return threshold
    return -1


def images() -> list[Bytes]:
    """Noise, plateaus of few grey levels, extremes, and single pixels on a flat ground."""
    rng = np.random.default_rng(3)
    noise = rng.integers(0, 256, (14, 17), dtype=np.uint8)
    few = rng.choice(np.array([0, 1, 2], np.uint8), (15, 13))
    extremes = rng.choice(np.array([0, 255], np.uint8), (13, 15), p=[0.15, 0.85])
    blocks = np.kron(rng.integers(0, 256, (3, 3)), np.ones((6, 6))).astype(np.uint8)
    single = np.full((9, 9), 7, np.uint8)
    single[4, 4] = 8
    return [noise, few, extremes, 255 - extremes, blocks, single]


@pytest.mark.parametrize("arc", [9, 10, 11, 12])
@pytest.mark.parametrize("image", images(), ids=["noise", "few", "extremes", "inverse", "blocks", "single"])
def test_every_pixel_of_small_images(image: Bytes, arc: int) -> None:
    height, width = image.shape
    inner = [(x, y) for y in range(3, height - 3) for x in range(3, width - 3)]
    score = np.array([plain_score(image, x, y, arc) for x, y in inner])
    np.testing.assert_array_equal(corner_score(image, inner, arc), score)
    for threshold in (0, 1, 10, 60, 254):
        expected = [p for p, s in zip(inner, score, strict=True) if s >= threshold]
        assert segment_test(image, threshold, arc).tolist() == [list(p) for p in expected]


@pytest.mark.parametrize("arc", [9, 10, 11, 12])
@pytest.mark.parametrize("start", range(16))
def test_an_arc_one_short_is_no_corner(arc: int, start: int) -> None:
    """Arcs of every length that begin anywhere on the circle: only those of N pixels or more count."""
    circle = [(0, 3), (1, 3), (2, 2), (3, 1), (3, 0), (3, -1), (2, -2), (1, -3)]
    circle += [(-x, -y) for x, y in circle]
    for length in (arc - 1, arc):
        for grey in (0, 200):
            image = np.full((7, 7), 100, np.uint8)
            for k in range(length):
                dx, dy = circle[(start + k) % 16]
                image[3 + dy, 3 + dx] = grey
            assert len(segment_test(image, 50, arc)) == (length == arc)


@pytest.mark.parametrize("size", [(1, 1), (6, 9), (7, 6), (7, 7), (8, 200), (130, 7), (40, 134), (40, 135)])
def test_images_of_all_sizes_have_corners_in_the_same_places(size: tuple[int, int]) -> None:
    """OpenCV's FAST-9 beside it, at widths on both sides of the tiles of 128 columns."""
    image = np.random.default_rng(size[1]).integers(0, 256, size, dtype=np.uint8)
    assert segment_test(image, 30, 9).tolist() == opencv(image, 30, False).tolist()


def opencv(image: Bytes, threshold: int, suppress: bool) -> NDArray[np.int64]:
    if min(image.shape) < 7:
        return np.zeros((0, 2), np.int64)
    detector = cv2.FastFeatureDetector_create(threshold, suppress, cv2.FAST_FEATURE_DETECTOR_TYPE_9_16)
    return np.array([p.pt for p in detector.detect(image)]).reshape(-1, 2).astype(np.int64)


@pytest.mark.parametrize("threshold", [5, 20, 60])
def test_fast_9_is_opencvs(wall: Bytes, threshold: int) -> None:
    np.testing.assert_array_equal(detect(wall, threshold, 9).xy, opencv(wall, threshold, False))
    peaks = detect(wall, threshold, 9, suppress=True)
    np.testing.assert_array_equal(peaks.xy, opencv(wall, threshold, True))


@pytest.mark.skipif(REFERENCE is None, reason="opencv_reference is not in VSLAM_REF_DATA")
@pytest.mark.parametrize("name", RECORDED)
@pytest.mark.parametrize("threshold", [20, 40])
def test_fast_9_is_what_opencv_was_recorded_to_find(name: str, threshold: int) -> None:
    folder, file = catalogue.find(RECORDED[name][0]), RECORDED[name][1]
    if folder is None:
        pytest.skip(f"{RECORDED[name][0]} is not in VSLAM_REF_DATA")
    image = cv2.imread(str(folder / file), cv2.IMREAD_GRAYSCALE)
    recorded = np.load(REFERENCE / f"{name}_features.npz")
    everything, peaks = (recorded[f"fast_9_16_t{threshold}_nms{k}"] for k in (0, 1))
    found = detect(image, threshold, 9)
    np.testing.assert_array_equal(found.xy, everything[:, :2])
    score = corner_score(image, found.xy, 9)
    keep = is_peak(found, score)
    np.testing.assert_array_equal(np.column_stack([found.xy, score])[keep], peaks)  # OpenCV's response


def test_peaks_are_above_all_eight_neighbours(wall: Bytes) -> None:
    found = detect(wall, 5)
    score = corner_score(wall, found.xy)
    of = {(x, y): s for (x, y), s in zip(found.xy.tolist(), score.tolist(), strict=True)}
    around = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]
    expected = [all(s > of.get((x + i, y + j), -1) for i, j in around) for (x, y), s in of.items()]
    assert is_peak(found, score).tolist() == expected


def test_rows_begin_where_they_begin(wall: Bytes) -> None:
    found = detect(wall, 10)
    for y in range(len(wall)):
        row = found.xy[found.row_start[y] : found.row_start[y + 1]]
        np.testing.assert_array_equal(row, found.xy[found.xy[:, 1] == y])
    with pytest.raises(ValueError, match="row order"):
        in_rows(found.xy[::-1], wall.shape)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda image: segment_test(image, 10, 8), "arc is 8"),
        (lambda image: segment_test(image, 255), "threshold is 255"),
        (lambda image: corner_score(image, [[2, 5]]), r"pixel \(2, 5\) of an image of 320 x 240"),
        (lambda image: corner_score(image, [[3.5, 5]]), "need whole pixels"),
    ],
)
def test_bad_questions_are_refused(call: object, told: str, wall: Bytes) -> None:
    with pytest.raises(ValueError, match=told):
        call(wall)  # type: ignore[operator]

"""The measure of precision on cases with a known answer; and, slow, the comparison with OpenCV's ORB."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from vslam_ref.datasets import catalogue
from vslam_ref.features.orb import OrbSettings, extract


@pytest.fixture(scope="module")
def precision() -> ModuleType:
    """The command beside this file; folders of tests are no packages."""
    name = "orb_precision"
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name("precision.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def test_area_by_hand(precision: ModuleType) -> None:
    """Right at 1, wrong at 2, right and right at 3, of four: 1/4 at precision 1, then 2/4 at 3/4."""
    right = np.array([True, False, True, True])
    assert precision.area(np.array([1, 2, 3, 3]), right) == pytest.approx(1 / 4 + 2 / 4 * 3 / 4, abs=1e-15)


def test_a_picture_matches_itself_and_not_another_place(precision: ModuleType, wall: np.ndarray) -> None:
    """With the identity as truth each feature finds itself; with a shift of 30 pixels, none does."""
    found = extract(wall, OrbSettings(features=200, octaves=4))
    same = precision.score(found, found, precision.Warp("", wall, wall, np.eye(3)))
    assert same.repeated == 1.0
    assert same.precision == 1.0
    away = np.array([[1.0, 0, 30], [0, 1, 0], [0, 0, 1]])
    assert precision.score(found, found, precision.Warp("", wall, wall, away)).precision < 0.01


def test_warps_have_the_truth_that_they_say(precision: ModuleType, wall: np.ndarray) -> None:
    """Turned by 90 degrees about its middle, a picture is a turned array; samples of 3 x 3 only smooth it."""
    H = precision.about(wall.shape, turn=90.0)
    turned = precision.seen(wall, H)
    expected = precision.seen(np.ascontiguousarray(np.rot90(wall, -1)), np.eye(3))
    np.testing.assert_allclose(turned, expected, atol=1e-9 * 255)


def test_opencvs_bits_at_our_places_are_those_of_the_place(precision: ModuleType, wall: np.ndarray) -> None:
    """OpenCV's program takes our places, octaves and angles as they are: its bits find the same partners.

    On a picture turned by 90 degrees, an array turned, its bits at our places agree as ours do: a place or an
    angle that it takes otherwise would leave descriptors half of whose bits differ.
    """
    H = precision.about(wall.shape, turn=90.0)
    turned = np.ascontiguousarray(np.rot90(wall, -1))
    warp = precision.Warp("", wall, turned, H)
    for method in (precision.ours, precision.described_by_opencv):
        assert precision.score(method(wall), method(turned), warp).precision > 0.9


def test_the_tree_spreads_opencvs_features_as_ours(precision: ModuleType, wall: np.ndarray) -> None:
    """As many of each octave, all of them OpenCV's own."""
    kept, whole = precision.spread_by_us(wall), precision.opencv(wall, precision.EVERYTHING)
    wanted = precision.shares(OrbSettings(features=precision.FEATURES))
    count = np.bincount(kept.octave, minlength=8)
    assert (count <= np.minimum(wanted, np.bincount(whole.octave, minlength=8))).all()
    rows = {row.tobytes() for row in np.column_stack([whole.uv, whole.descriptor])}
    assert {row.tobytes() for row in np.column_stack([kept.uv, kept.descriptor])} <= rows


@pytest.mark.slow
def test_precision_is_at_least_opencvs(precision: ModuleType) -> None:
    """Like with like, over the warps and on graf1 to graf3: ``make orb-precision`` shows each warp."""
    if catalogue.find("opencv_samples") is None:
        pytest.skip("opencv_samples is not in VSLAM_REF_DATA")
    result = precision.study(precision.warps())[..., 0]
    assert len(result) - 1 >= 25
    names = list(precision.METHODS)
    for which in (result[:-1].mean(0), result[-1]):
        for what, (ours, opencv) in precision.FAIR.items():
            assert which[names.index(ours)] >= which[names.index(opencv)], what

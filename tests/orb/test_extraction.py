"""Whole pictures: what is promised of the features, and what turns with the picture."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from vslam_ref import _kernels
from vslam_ref.features import detect
from vslam_ref.features.fast import corner_score
from vslam_ref.features.orb import OrbFeatures, OrbSettings, extract
from vslam_ref.features.orb.candidates import candidates
from vslam_ref.features.orb.extraction import shares

Bytes = NDArray[np.uint8]
FOUR = OrbSettings(features=300, octaves=4)


@pytest.mark.usefixtures("backend")
def test_a_picture_turned_by_a_right_angle(wall: Bytes) -> None:
    """216 pixels make four octaves of whole sizes (216, 180, 150, 125), so that all turns with the picture.

    Positions and angles turn, descriptors are the same bits: directions are ratios of whole numbers, which
    turn exactly.  Cells and the tree do not turn, so one threshold is used, and all peaks are kept.
    """
    settings = OrbSettings(features=100_000, octaves=4, low_threshold=20, spread=False)
    turned = extract(np.ascontiguousarray(np.rot90(wall, -1)), settings)  # x' = H - 1 - y, y' = x
    found = extract(wall, settings)
    assert len(found.uv) > 300
    uv = np.stack([215 - found.uv[:, 1], found.uv[:, 0]], 1)
    here = np.lexsort([*np.round(uv, 6).T, found.octave])
    there = np.lexsort([*np.round(turned.uv, 6).T, turned.octave])
    np.testing.assert_allclose(turned.uv[there], uv[here], atol=1e-11)  # 200 pixels, some eps
    np.testing.assert_array_equal(turned.octave[there], found.octave[here])
    np.testing.assert_array_equal(turned.response[there], found.response[here])
    np.testing.assert_array_equal(turned.descriptor[there], found.descriptor[here])
    off = turned.angle[there] - found.angle[here] - np.pi / 2
    assert np.abs(np.angle(np.exp(1j * off))).max() < 1e-14


@pytest.mark.usefixtures("backend")
@pytest.mark.parametrize(("noise", "cell"), [(False, 20), (True, 5)])
def test_cells_without_a_bright_corner_take_the_faint_ones(wall: Bytes, noise: bool, cell: int) -> None:
    """Read off cell by cell from all peaks at the lower threshold; with noise, many neighbours lie in two."""
    image = np.random.default_rng(6).integers(60, 160, wall.shape, dtype=np.uint8) if noise else wall
    low = detect(image, 7, 9, suppress=True).xy
    score = corner_score(image, low, 9)
    inside = ((low >= 19) & (low < 216 - 19)).all(1)
    low, score = low[inside], score[inside]
    expected = []
    for (x, y), s in zip(low.tolist(), score.tolist(), strict=True):
        here = (low // cell == [x // cell, y // cell]).all(1)
        if s >= 60 or score[here].max() < 60:
            expected.append((x, y, s))
    found = candidates(image, 60, 7, cell)
    assert [(x, y, s) for (x, y), s in zip(found.xy.tolist(), found.score.tolist(), strict=True)] == expected
    assert (found.score < 60).any()
    assert (found.score >= 60).any()


def test_both_backends_give_the_same_bytes(wall: Bytes) -> None:
    pytest.importorskip("numba")
    both = []
    for name in ("numpy", "numba"):
        with _kernels.use_backend(name):
            both.append(extract(wall, FOUR))
    for a, b in zip(*both, strict=True):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)


@pytest.mark.usefixtures("backend")
@pytest.mark.parametrize("spread", [True, False])
def test_no_more_than_were_asked_for(wall: Bytes, spread: bool) -> None:
    settings = OrbSettings(features=90, octaves=4, spread=spread)
    found = extract(wall, settings)
    assert np.bincount(found.octave, minlength=4).tolist() == shares(settings)
    assert sum(shares(settings)) == 90
    assert np.diff(found.octave).min() >= 0


@pytest.mark.usefixtures("backend")
@pytest.mark.parametrize(
    "image",
    [
        np.full((480, 640), 77, np.uint8),
        np.zeros((1, 1), np.uint8),
        np.random.default_rng(0).integers(0, 256, (38, 200), dtype=np.uint8),
    ],
    ids=["flat", "a pixel", "38 rows"],
)
def test_pictures_without_features(image: Bytes) -> None:
    found = extract(image)
    assert [part.shape for part in found] == [(0, 2), (0,), (0,), (0,), (0, 32)]
    assert isinstance(found, OrbFeatures)
    assert found.descriptor.dtype == np.uint8


@pytest.mark.usefixtures("backend")
def test_39_rows_are_enough() -> None:
    image = np.zeros((39, 39), np.uint8)
    image[19, 19] = 255
    found = extract(image)
    assert found.uv.tolist() == [[19.0, 19.0]]
    assert found.response.tolist() == [254.0]


@pytest.mark.parametrize(
    "image", [np.zeros((50, 50)), np.zeros((50, 50, 3), np.uint8)], ids=["float", "colour"]
)
def test_other_pictures_are_refused(image: np.ndarray) -> None:
    with pytest.raises(ValueError, match="need uint8 of shape"):
        extract(image)


@pytest.mark.usefixtures("backend")
def test_a_feature_lies_where_the_thing_is() -> None:
    """A blob that grows with the octave's pixel is found at its middle, to half a pixel of the octave.

    Without the half pixels of :eq:`eq-orb-octave` it would be 1.3 pixels away on octave 7.
    """
    x, y = np.meshgrid(np.arange(640), np.arange(480))
    for octave in (0, 3, 7):
        wide = 1.2**octave
        middle = np.array([300.0, 250.0]) + wide / 3
        away = np.hypot(x - middle[0], y - middle[1]) / wide
        image = (250 * np.exp(-0.5 * (away / 1.2) ** 2)).astype(np.uint8)
        found = extract(image)
        at = found.uv[found.octave == octave]
        assert len(at) >= 1
        best = at[np.argmax(found.response[found.octave == octave])]
        assert np.abs(best - middle).max() <= 0.5 * wide + 1e-9

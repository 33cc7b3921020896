"""Sizes of pictures by their heads: OpenCV's encoders as oracle, and heads that lie."""

from __future__ import annotations

import struct
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

from vslam_ref.datasets.picture_size import picture_size, require_size
from vslam_ref.datasets.pictures import read_grey
from vslam_ref.datasets.text import FormatError

IMAGE = np.zeros((123, 457, 3), dtype=np.uint8)
SUFFIXES = (".png", ".jpg", ".bmp", ".pgm", ".ppm", ".tif", ".webp")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_the_head_tells_the_size(suffix: str, tmp_path: Path) -> None:
    image = IMAGE[..., 0] if suffix == ".pgm" else IMAGE
    data = cv2.imencode(suffix, image)[1].tobytes()
    assert picture_size(data) == (457, 123)
    path = tmp_path / f"a{suffix}"
    path.write_bytes(data)
    require_size(path, 457 * 123)
    with pytest.raises(FormatError, match="457x123 pixels; at most 56210 are read"):
        require_size(path, 457 * 123 - 1)
    for cut in range(30):  # a head that is cut off tells nothing, or the truth
        assert picture_size(data[:cut]) in (None, (457, 123))


def test_a_lossless_webp_too() -> None:
    data = cv2.imencode(".webp", IMAGE, [cv2.IMWRITE_WEBP_QUALITY, 101])[1].tobytes()
    assert data[12:16] == b"VP8L"
    assert picture_size(data) == (457, 123)


def test_other_bytes_have_no_size() -> None:
    for data in (b"", b"P5", b"\xff\xd8\xff", b"text of some kind", bytes(100)):
        assert picture_size(data) is None


def test_a_small_file_that_promises_gigabytes_is_refused_at_once(tmp_path: Path) -> None:
    """OpenCV alone makes the two gigabytes of the damaged chunk first, which takes seconds."""
    data = cv2.imencode(".png", IMAGE[..., 0])[1].tobytes()
    at = data.index(b"IDAT") - 4
    path = tmp_path / "a.png"
    begin = time.perf_counter()
    for damaged, words in (
        (data[:at] + struct.pack(">I", 0x7FFFFFFF) + data[at + 4 :], "chunk 'IDAT' of 2147483647 bytes"),
        (data[:-20], "the picture is cut off or damaged"),
        (data[:16] + struct.pack(">2I", 60000, 60000) + data[24:], "60000x60000 pixels; at most 100000000"),
        (b"P5 99999999 99999999 255\n", "pixels; at most"),
    ):
        path.write_bytes(damaged)
        with pytest.raises(FormatError, match=words):
            read_grey(path)
    assert time.perf_counter() - begin < 1.0

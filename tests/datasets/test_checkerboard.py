"""Corners of checkerboards: drawn ones whose corners are known, and OpenCV's pictures."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from vslam_ref.datasets import catalogue
from vslam_ref.datasets.checkerboard import find_corners
from vslam_ref.datasets.pictures import image_files, read_grey
from vslam_ref.datasets.text import FormatError
from vslam_ref.estimation.calibration import Board, apply_homography, calibrate, homography

H_IMAGE_BOARD = np.array([[40.0, 6.0, 110.0], [-3.0, 42.0, 120.0], [0.004, 0.012, 1.0]])
"""From the board, in squares, to pixels: tilted, about 40 px a square."""


@lru_cache
def drawn(columns: int = 7, rows: int = 5, oversampling: int = 4) -> np.ndarray:
    """A board as a camera with square pixels sees it: each pixel the mean of 16 points of its area."""
    n = oversampling
    sub = (np.arange(n) + 0.5) / n - 0.5
    v, u = np.meshgrid(
        (np.arange(400)[:, None] + sub).ravel(), (np.arange(520)[:, None] + sub).ravel(), indexing="ij"
    )
    X = apply_homography(np.linalg.inv(H_IMAGE_BOARD), np.stack([u.ravel(), v.ravel()], 1)).reshape(
        *u.shape, 2
    )
    square = np.floor(X).astype(int)
    on = ((square >= -1) & (square < [columns, rows])).all(-1)
    grey = np.where(on & (square.sum(-1) % 2 == 0), 30.0, 220.0)
    return grey.reshape(400, n, 520, n).mean(axis=(1, 3)).round().astype(np.uint8)


def test_corners_of_a_drawn_board() -> None:
    """Grey values are rounded and the corner is a saddle of a few pixels: 0.05 px, the detector's known
    size.
    """
    uv = find_corners(drawn(), 7, 5)
    assert uv is not None
    assert uv.shape == (35, 2)
    assert uv.dtype == np.float64
    X = Board(7, 5).points[:, :2]
    wanted = apply_homography(H_IMAGE_BOARD, X)
    if np.abs(uv - wanted).max() > 10:  # a board may be found from its other end
        wanted = wanted[::-1]
    assert np.abs(uv - wanted).max() < 0.1
    assert np.sqrt(((uv - wanted) ** 2).mean()) < 0.05
    # row by row in the order of Board.points: one homography fits all
    assert np.abs(apply_homography(homography(X, uv), X) - uv).max() < 0.1


def test_no_board_is_none_and_a_part_is_none() -> None:
    rng = np.random.default_rng(0)
    assert find_corners(rng.integers(0, 255, (240, 320)).astype(np.uint8), 7, 5) is None
    assert find_corners(drawn()[:, :250], 7, 5) is None
    for size in ((1, 1), (12, 400), (400, 31), (32, 32)):
        assert find_corners(np.zeros(size, np.uint8), 7, 5) is None


@pytest.mark.parametrize(
    ("image", "board", "message"),
    [
        (np.zeros((4, 4, 3), np.uint8), (7, 5), "need grey uint8"),
        (np.zeros((4, 4)), (7, 5), "need grey uint8"),
        (np.zeros((0, 4), np.uint8), (7, 5), "need grey uint8"),
        (np.zeros((4, 4), np.uint8), (2, 5), "at least 3 inner corners"),
    ],
)
def test_bad_input_is_refused(image: np.ndarray, board: tuple[int, int], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        find_corners(image, *board)


def test_files_and_folders(tmp_path: Path) -> None:
    for name in ("b.png", "a.JPG", "notes.txt"):
        (tmp_path / name).write_bytes(b"x")
    (tmp_path / "deeper.png").mkdir()
    assert [p.name for p in image_files([tmp_path])] == ["a.JPG", "b.png"]
    assert image_files([tmp_path / "notes.txt", tmp_path / "b.png"])[0].name == "notes.txt"
    with pytest.raises(FormatError, match="no such file or folder"):
        image_files([tmp_path / "c.png"])
    with pytest.raises(FormatError, match="an empty name"):
        image_files([""])
    with pytest.raises(FormatError, match=r"no image in this folder; expected \.bmp"):
        image_files([tmp_path / "deeper.png"])


def test_images_that_cannot_be_read(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    with pytest.raises(FormatError, match=r"a\.png: no such file"):
        read_grey(path)
    for data in (b"", b"hello", b"\x89PNG\r\n\x1a\n" + b"\0" * 40):
        path.write_bytes(data)
        with pytest.raises(FormatError, match=r"a\.png: "):
            read_grey(path)
    cv2.imwrite(str(path), drawn())
    assert np.array_equal(read_grey(path), drawn())


@pytest.mark.parametrize(
    ("name", "message"), [("a.png", "the picture is cut off"), ("a.jpg", "the picture is cut off")]
)
def test_pictures_that_are_cut_off(
    tmp_path: Path, name: str, message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """The decoder's own lines, which name no file, become part of the error and do not reach the terminal."""
    path = tmp_path / name
    cv2.imwrite(str(path), drawn())
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(FormatError, match=message) as told:
        read_grey(path)
    assert str(told.value).startswith(str(path))
    assert "\n" not in str(told.value)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.bmp", "a.tif"])
def test_damaged_bytes_end_in_an_image_or_in_one_line(
    tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path, rng = tmp_path / name, np.random.default_rng(0)
    cv2.imwrite(str(path), drawn()[::4, ::4])
    data, refused = path.read_bytes(), 0
    for _ in range(100):
        mutant = bytearray(data)
        for at in rng.integers(0, min(len(data), 400), 3):
            mutant[at] = rng.integers(256)
        path.write_bytes(mutant[: rng.integers(len(data) // 2, len(data) + 1)])
        told = ""
        try:
            assert read_grey(path).ndim == 2
        except FormatError as error:
            told = str(error)
        refused += bool(told)
        assert "\n" not in told
    assert refused > 10
    assert capfd.readouterr().err == ""


def test_a_huge_picture_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from vslam_ref.datasets import pictures

    monkeypatch.setattr(pictures, "MAX_PIXELS", 1000)
    cv2.imwrite(str(tmp_path / "a.png"), drawn())
    with pytest.raises(FormatError, match="520x400 pixels; at most 1000"):
        read_grey(tmp_path / "a.png")


def test_rotation_notes_are_not_followed(tmp_path: Path) -> None:
    """A JPEG with EXIF orientation 6, turn right: stored 520 wide, and read so."""
    path = tmp_path / "a.jpg"
    cv2.imwrite(str(path), drawn())
    data = path.read_bytes()
    tiff = b"MM\x00*\x00\x00\x00\x08\x00\x01\x01\x12\x00\x03\x00\x00\x00\x01\x00\x06\x00\x00\x00\x00\x00\x00"
    body = b"Exif\x00\x00" + tiff
    path.write_bytes(data[:2] + b"\xff\xe1" + (len(body) + 2).to_bytes(2, "big") + body + data[2:])
    assert cv2.imread(str(path), cv2.IMREAD_GRAYSCALE).shape == (520, 400)  # the note is there
    assert read_grey(path).shape == (400, 520)


@pytest.mark.parametrize(("side", "rms"), [("left", 0.1811), ("right", 0.1901)])
def test_real_boards_calibrate_to_a_fifth_of_a_pixel(side: str, rms: float) -> None:
    """With windows of 11 px the same pictures give 0.408 and 0.458: those measured the detector."""
    folder = catalogue.find("opencv_samples")
    if folder is None:
        pytest.skip("opencv_samples is not in VSLAM_REF_DATA")
    board = Board(9, 6, 0.025)
    images = [read_grey(path) for path in sorted((folder / "chessboard").glob(f"{side}*.jpg"))]
    corners = [find_corners(image, 9, 6) for image in images]
    assert len(images) == 13
    assert all(uv is not None for uv in corners)
    found = calibrate([(board.points, uv) for uv in corners if uv is not None], (640, 480))
    assert abs(found.rms_px - rms) < 0.01  # JPEG decoders differ by a grey level
    assert found.errors_px.max() < 0.6

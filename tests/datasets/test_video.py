"""Films: WebM with VP8, which OpenCV reads back and a browser plays; sizes; a clean error stream."""

from __future__ import annotations

import base64
import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cv2", reason="films need OpenCV")

import cv2

from vslam_ref.datasets import video

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "headless_shell")
BROWSER = next(filter(None, [os.environ.get("CHROMIUM"), *map(shutil.which, NAMES)]), None)
RED = (200, 40, 20)


def film(path: Path, frames: int = 5, shape: tuple[int, int] = (60, 480), **settings: object) -> Path:
    """A film whose left half is red; in OpenCV's order it would be blue."""
    picture = np.zeros((*shape, 3), np.uint8)
    picture[:, : shape[1] // 2] = RED
    with video.webm(path, **settings) as add:
        for _ in range(frames):
            add(picture)
    return path


def read(path: Path) -> list[np.ndarray]:
    reader, frames = cv2.VideoCapture(str(path)), []
    while (got := reader.read())[0]:
        frames.append(got[1])
    return frames


def test_a_film_is_a_webm_of_vp8_with_its_pictures(tmp_path: Path) -> None:
    """Matroska's EBML header (RFC 8794) with DocType webm, and the codec's name (webmproject.org).

    Colours survive to what a lossy codec of 8 bits does to flat areas: within 12 of 255.
    """
    path = film(tmp_path / "a.webm", 7)
    head = path.read_bytes()[:1000]
    assert head.startswith(bytes.fromhex("1a45dfa3"))
    assert b"webm" in head[:64]
    assert b"V_VP8" in head
    frames = read(path)
    assert len(frames) == 7
    assert frames[0].shape == (40, 320, 3)
    assert np.abs(frames[2][10, 80, ::-1].astype(int) - RED).max() <= 12
    assert frames[2][10, 240].max() <= 12


@pytest.mark.parametrize(
    ("size", "shape", "expected"),
    [
        ("small", (60, 480), (40, 320)),
        ("small", (33, 48), (220, 320)),
        ("half", (60, 481), (30, 240)),
        ("full", (33, 49), (34, 50)),
        ("half", (1, 2), (16, 16)),
    ],
)
def test_sizes_are_even(size: str, shape: tuple[int, int], expected: tuple[int, int], tmp_path: Path) -> None:
    """``small`` is 320 pixels wide; odd sides grow by a pixel, and a half of 481 is taken down to 240."""
    frames = read(film(tmp_path / "a.webm", 1, shape, size=size))
    assert frames[0].shape[:2] == expected


def test_nothing_is_written_to_the_error_stream(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """OpenCV's C code warns that it knows no tag VP80: that is hidden, what comes after is not."""
    film(tmp_path / "a.webm")
    os.write(2, b"after\n")
    assert capfd.readouterr().err == "after\n"


def test_pictures_of_another_size_and_unknown_sizes_are_refused(tmp_path: Path) -> None:
    with video.webm(tmp_path / "a.webm") as add:
        add(np.zeros((60, 480, 3), np.uint8))
        with pytest.raises(ValueError, match="all must have one size"):
            add(np.zeros((20, 480, 3), np.uint8))
    with (
        pytest.raises(ValueError, match="must be one of small, half, full"),
        video.webm(tmp_path / "b", "none"),
    ):
        pass
    with video.webm(tmp_path / "c.webm"):
        pass
    assert not (tmp_path / "c.webm").exists(), "no picture, no film"


PAGE = """<!DOCTYPE html><video src="a.webm" muted preload="auto"></video><script>
const film = document.querySelector("video");
function tell() {
  const mark = document.createElement("pre");
  mark.id = "report";
  mark.textContent = btoa([film.readyState, film.videoWidth, film.error ? film.error.code : 0].join(" "));
  document.body.append(mark);
}
film.addEventListener("loadeddata", tell, {once: true});
film.addEventListener("error", tell, {once: true});
</script>"""


@pytest.mark.skipif(BROWSER is None, reason="no Chromium or Chrome on this machine (or set CHROMIUM)")
def test_a_browser_plays_it(tmp_path: Path) -> None:
    """HAVE_CURRENT_DATA (2) or more: a picture was decoded; it is 320 pixels wide."""
    film(tmp_path / "a.webm", 20)
    (tmp_path / "page.html").write_text(PAGE)
    command = [
        str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
        f"--user-data-dir={tmp_path / 'profile'}", "--host-resolver-rules=MAP * ~NOTFOUND", "--timeout=20000",
        "--virtual-time-budget=20000", "--dump-dom", (tmp_path / "page.html").as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    match = re.search(r'<pre id="report">([^<]+)</pre>', done.stdout)
    assert match, f"the browser gave no report: {done.stderr[-500:]}"
    ready, width, error = map(int, base64.b64decode(match[1]).split())
    assert error == 0
    assert ready >= 2
    assert width == 320


def test_an_avi_has_its_pictures_and_the_same_bytes_each_time(tmp_path: Path) -> None:
    """RIFF with form AVI (Microsoft's definition), codec MJPG; JPEG keeps flat areas within 4 of 255."""
    ramp = np.tile(np.arange(64, dtype=np.uint8)[:, None] * 3, (48, 1, 3))
    for name in ("a.avi", "b.avi"):
        with video.avi(tmp_path / name) as add:
            for k in range(4):
                add(ramp + np.uint8(10 * k))
    data = (tmp_path / "a.avi").read_bytes()
    assert (data[:4], data[8:12]) == (b"RIFF", b"AVI ")
    assert b"MJPG" in data[:400]
    assert data == (tmp_path / "b.avi").read_bytes()
    frames = read(tmp_path / "a.avi")
    assert len(frames) == 4
    assert np.abs(frames[3].astype(int) - ramp - 30).mean() < 4

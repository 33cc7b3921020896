"""Maps of ROS' map_server: written and read, decided cells stay decided, damage is named; a video opens."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import yaml

pytest.importorskip("cv2", reason="pictures need OpenCV")

import cv2

from vslam_ref.datasets import grid_files
from vslam_ref.datasets.text import FormatError
from vslam_ref.grids.lattice import Lattice
from vslam_ref.grids.log_odds import LogOddsGrid, log_odds, states


@pytest.fixture
def grid() -> LogOddsGrid:
    p = np.linspace(0.001, 0.999, 60).reshape(6, 10)
    p[0, :4] = [0.0999, 0.1001, 0.8999, 0.9001]
    return LogOddsGrid(Lattice(0.1, (-7, 31), (6, 10)), log_odds(p))


def test_a_map_comes_back(tmp_path: Path, grid: LogOddsGrid) -> None:
    """Corner, resolution and decisions exactly; the greys to half a step, where they are asked for."""
    grid_files.write_ros_map(tmp_path, "static", grid)
    back = grid_files.read_ros_map(tmp_path / "static.yaml")
    assert back.grid.lattice == grid.lattice
    assert back.T_world_map.tolist() == [0, 0, 0]
    assert back.notes == ()
    np.testing.assert_array_equal(back.grid.states, states(grid.log_odds))
    assert set(np.unique(back.probability).round(3)) == {0.002, 0.5, 0.998}
    graded = grid_files.read_ros_map(tmp_path / "static.yaml", graded=True)
    assert np.abs(graded.probability - grid.probability).max() <= 0.5 / 255 + 1e-12
    np.testing.assert_array_equal(graded.grid.states, states(grid.log_odds))


def test_the_map_servers_rule_finds_the_decided_cells(tmp_path: Path, grid: LogOddsGrid) -> None:
    """Its documentation: p = (255 - x)/255; occupied above one threshold, free below another; rows down."""
    grid_files.write_ros_map(tmp_path, "m", grid)
    about = yaml.safe_load((tmp_path / "m.yaml").read_text())
    keys = {"image", "mode", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"}
    assert set(about) == keys
    pixels = cv2.imread(str(tmp_path / about["image"]), cv2.IMREAD_GRAYSCALE)
    p = (255 - pixels[::-1].astype(float)) / 255
    trinary = np.where(p > about["occupied_thresh"], 2, np.where(p < about["free_thresh"], 0, 1))
    np.testing.assert_array_equal(trinary, states(grid.log_odds))
    assert about["origin"] == pytest.approx([-0.7, 3.1, 0.0])
    assert pixels[-1, 0] == 230  # cell [0, 0] is the last row's first pixel


def test_negated_and_pgm_pictures_are_read(tmp_path: Path, grid: LogOddsGrid) -> None:
    grid_files.write_ros_map(tmp_path, "m", grid)
    cv2.imwrite(str(tmp_path / "n.pgm"), 255 - cv2.imread(str(tmp_path / "m.png"), cv2.IMREAD_GRAYSCALE))
    text = (tmp_path / "m.yaml").read_text().replace("m.png", "n.pgm").replace("negate: 0", "negate: 1")
    (tmp_path / "n.yaml").write_text(text)
    for graded in (False, True):
        back = grid_files.read_ros_map(tmp_path / "n.yaml", graded=graded)
        as_it_was = grid_files.read_ros_map(tmp_path / "m.yaml", graded=graded)
        np.testing.assert_allclose(back.grid.log_odds, as_it_was.grid.log_odds)


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("resolution: 0.1", "resolution: 0", "resolution is 0; expected more than 0"),
        ("resolution: 0.1", "resolution: .nan", "resolution is '.nan'; expected a number"),
        ("resolution: 0.1", "nothing: 1", "has no resolution"),
        ("0.0]", ".nan]", "origin[2] is '.nan'; expected a number"),
        ("origin: [", "origin: [1, ", "expected [x, y, turn]"),
        (", 0.0]", "]", "expected [x, y, turn]"),
        ("negate: 0", "negate: maybe", "negate is 'maybe'; expected one of 0, false"),
        ("mode: trinary", "mode: binary", "mode is 'binary'; expected one of trinary, scale, raw"),
        ("occupied_thresh: 0.9", "occupied_thresh: 65", "expected a probability: 0.65 for 65 %"),
        (
            "occupied_thresh: 0.9",
            "occupied_thresh: -1",
            "occupied_thresh is -1; expected a probability, 0 to 1",
        ),
        ("occupied_thresh: 0.9\n", "", "has no occupied_thresh"),
        ("free_thresh: 0.1\n", "free_thresh: 0.9\n", "expected the first below the second"),
        ("m.png", "/elsewhere/maps/m.png", "lies beside the YAML: write 'image: m.png'"),
        ("m.png", "C:\\maps\\m.png", "lies beside the YAML: write 'image: m.png'"),
        ("m.png", "other.png", "image is 'other.png'; expected a picture beside"),
        ("m.png", "m.yaml", "no image that can be read"),
    ],
)
def test_a_damaged_map_is_answered(tmp_path: Path, grid: LogOddsGrid, old: str, new: str, what: str) -> None:
    grid_files.write_ros_map(tmp_path, "m", grid)
    text = re.sub(r"origin: \[[^,]*,", "origin: [-0.7,", (tmp_path / "m.yaml").read_text())
    assert old in text
    (tmp_path / "m.yaml").write_text(text.replace(old, new))
    with pytest.raises(FormatError, match=re.escape(what)):
        grid_files.read_ros_map(tmp_path / "m.yaml")


@pytest.mark.parametrize(
    ("content", "what"),
    [(b"a: [", "expected YAML"), (b"- 1", "is a list; expected entries"), (b"#" * 2**21, "more than")],
)
def test_what_is_no_yaml_is_refused(tmp_path: Path, content: bytes, what: str) -> None:
    (tmp_path / "m.yaml").write_bytes(content)
    with pytest.raises(FormatError, match=what):
        grid_files.read_ros_map(tmp_path / "m.yaml")


# --- the map server's rule ---------------------------------------------------------------------------


def server(pixel: list[float], mode: str, negate: int, occupied: float, free: float) -> float | None:
    """One pixel (red, green, blue, opacity) in ROS 2's map_server, as per cent; None: unknown."""
    channels = pixel[:3]
    if mode == "trinary" and pixel[3] is not None:
        channels = pixel
    shade = sum(channels) / len(channels) / 255.0
    if mode == "raw":
        value = round(shade * 255)
        return value if 0 <= value <= 100 else None
    occ = shade if negate else 1.0 - shade
    if mode == "scale" and pixel[3] is not None and pixel[3] < 255:
        return None
    if occupied < occ:
        return 100
    if occ < free:
        return 0
    return None if mode == "trinary" else round((occ - free) / (occupied - free) * 100)


def put_map(folder: Path, pixels: np.ndarray, **more: object) -> Path:
    cv2.imwrite(str(folder / "map.png"), pixels)
    entries: dict[str, object] = {
        "image": "map.png",
        "resolution": 0.05,
        "origin": [-0.4, -0.3, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    } | more
    path = folder / "map.yaml"
    path.write_text("".join(f"{key}: {value}\n" for key, value in entries.items()))
    return path


@pytest.mark.parametrize(
    ("mode", "negate"),
    [(m, n) for m in ("trinary", "scale", None) for n in (0, 1, "false", "true")]
    + [("raw", 0), ("raw", "no")],
)
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_every_pixel_is_what_the_map_server_makes_of_it(
    tmp_path: Path, channels: int, mode: str | None, negate: object
) -> None:
    """All greys, colours and opacities; the rule once more, pixel by pixel."""
    white = negate in (1, "true")
    rng = np.random.default_rng(0)
    shape = (16, 16) if channels == 1 else (16, 16, channels)
    pixels = rng.integers(0, 256, shape, dtype=np.uint8)
    pixels[:, :8] = np.arange(128).reshape((16, 8) + (1,) * (channels > 1)) + 100
    if channels == 4:
        pixels[:4, :, 3] = 255
    more = {"negate": negate} | ({"mode": mode} if mode else {})
    found = grid_files.read_ros_map(put_map(tmp_path, pixels, **more))
    for row in range(16):
        for column in range(16):
            raw = np.atleast_1d(pixels[row, column]).astype(float).tolist()
            pixel = raw * 3 + [None] if channels == 1 else [*raw[:3], raw[3] if channels == 4 else None]
            value = server(pixel, mode or "trinary", int(white), 0.65, 0.196)
            p = 0.5 if value is None else min(max(value / 100, 0.5 / 255), 1 - 0.5 / 255)
            assert found.probability[15 - row, column] == pytest.approx(p, abs=1e-9), (row, column, pixel)


def test_what_map_saver_writes(tmp_path: Path) -> None:
    """0 occupied, 254 free, 205 unknown; a threshold that makes 205 free is told."""
    pixels = np.array([[0, 254, 205]], np.uint8)
    found = grid_files.read_ros_map(put_map(tmp_path, pixels))
    assert found.probability[0].round(2).tolist() == [1.0, 0.0, 0.5]
    assert found.notes == ()
    wide = grid_files.read_ros_map(put_map(tmp_path, pixels, free_thresh=0.25))
    assert wide.probability[0].round(2).tolist() == [1.0, 0.0, 0.0]
    assert "1 pixels of grey 205" in wide.notes[0]
    assert "0.196 keeps them unknown" in wide.notes[0]


def test_raw_maps_that_are_negated_are_told(tmp_path: Path) -> None:
    pixels = np.array([[255 - 40, 255 - 100, 0]], np.uint8)
    found = grid_files.read_ros_map(put_map(tmp_path, pixels, mode="raw", negate=1))
    assert found.probability[0].round(2).tolist() == [0.4, 1.0, 0.5]
    assert "raw with negate: 1" in found.notes[0]


@pytest.mark.parametrize("origin", [[-8.254003, -3.127719, 0.0], [-21.2, -14.9, 1.56], [3.0, 1.0, -2.5]])
def test_a_map_stands_where_its_origin_says(tmp_path: Path, origin: list[float]) -> None:
    """The lower left pixel's corner lies at the origin, columns run along its turned x axis."""
    pixels = np.full((6, 9), 254, np.uint8)
    pixels[1, 7] = 0  # column 7, row 4 from below
    found = grid_files.read_ros_map(put_map(tmp_path, pixels, origin=origin))
    assert found.origin_xy == pytest.approx(origin[:2], abs=1e-12)
    assert found.yaw == origin[2]
    assert found.grid.origin_xy == (0.0, 0.0)
    x, y, yaw = origin
    along, up = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
    centre = np.array([x, y]) + 0.05 * (7.5 * along + 4.5 * up)
    assert found.at(centre)[0] > 5
    assert found.at(centre + 0.05 * along)[0] < -5
    assert found.at(centre - 0.05 * up)[0] < -5
    assert found.at(np.array([x, y]) - 0.05 * along - 0.05 * up)[0] == 0.0
    assert found.world_from_cells([[4, 7]])[0] == pytest.approx(centre, abs=1e-12)


def test_pictures_elsewhere_and_of_other_depths(tmp_path: Path) -> None:
    """A folder below, an absolute path, 16 bits, and a PGM whose largest value is 100."""
    (tmp_path / "pictures").mkdir()
    greys = np.array([[0, 205, 254]], np.uint8)
    cv2.imwrite(str(tmp_path / "pictures" / "a.pgm"), greys)
    cv2.imwrite(str(tmp_path / "deep.png"), greys.astype(np.uint16) * 257)
    (tmp_path / "hundred.pgm").write_bytes(b"P5\n3 1\n100\n" + bytes([0, 80, 100]))
    for image in ("pictures/a.pgm", f"{tmp_path}/pictures/a.pgm", "./pictures/../deep.png", "hundred.pgm"):
        found = grid_files.read_ros_map(put_map(tmp_path, greys, image=image))
        assert found.probability[0].round(2).tolist() == [1.0, 0.5, 0.0], image

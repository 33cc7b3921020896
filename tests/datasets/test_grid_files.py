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
    """To half a grey step, 1/510; corner, resolution and decisions exactly."""
    grid_files.write_ros_map(tmp_path, "static", grid)
    back = grid_files.read_ros_map(tmp_path / "static.yaml")
    assert back.lattice == grid.lattice
    assert np.abs(back.probability - grid.probability).max() <= 0.5 / 255 + 1e-12
    np.testing.assert_array_equal(states(back.log_odds), states(grid.log_odds))


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
    back = grid_files.read_ros_map(tmp_path / "n.yaml")
    np.testing.assert_allclose(back.log_odds, grid_files.read_ros_map(tmp_path / "m.yaml").log_odds)


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("resolution: 0.1", "resolution: 0", "resolution is 0; expected more than 0"),
        ("resolution: 0.1", "resolution: .nan", "resolution is '.nan'; expected a number"),
        ("resolution: 0.1", "nothing: 1", "has no resolution"),
        ("0.0]", "0.5]", "expected [x, y, 0.0]"),
        ("origin: [", "origin: [1, ", "expected [x, y, 0.0]"),
        ("origin: [-0.7", "origin: [-0.73", "expected multiples of the resolution"),
        ("negate: 0", "negate: maybe", "negate is 'maybe'; expected one of 0, 1"),
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

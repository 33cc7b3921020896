"""Tiny sets in foreign formats, whole at first; a test damages one file and sees the reader's answer."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

HERE = str(Path(__file__).parent)
if HERE not in sys.path:
    sys.path.insert(0, HERE)

MRCLAM = {
    "Barcodes.dat": "# subject barcode\n1 5\n2 14\n6 63\n7 81\n8 7\n",
    "Robot1_Odometry.dat": "# t v w\n100.0 0.1 0.0\n100.5 0.1 0.2\n101.0 0.1 0.2\n101.5 0.0 0.0\n",
    "Robot1_Measurement.dat": (
        "# t code r b\n100.2 63 2.0 0.1\n100.2 5 1.0 0.0\n100.9 63 1.9 0.1\n100.9 81 3.0 -0.2\n"
    ),
    "Robot1_Groundtruth.dat": "# t x y th\n99.0 1 2 3.1\n99.1 1 2 3.2\n101.6 1.1 2 3.3\n",
    "Landmark_Groundtruth.dat": "# s x y sx sy\n6 1 2 0 0\n7 3 4 0 0\n8 0 0 0 0\n",
}
GRAPH = """ODOMETRY 0 1 0.5 0 0 1 0 0 1 0 1
LANDMARK 1 5 10 2 1 0 1
ODOMETRY 1 3 0.5 0 0 1 0 0 1 0 1
LANDMARK 3 5 9.5 2 1 0 1
LANDMARK 3 7 4 -3 1 0 1
"""


@pytest.fixture
def mrclam_folder(tmp_path: Path) -> Path:
    """Write an MRCLAM set of one robot, four controls and three sightings of landmarks."""
    for name, text in MRCLAM.items():
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.fixture
def park_folder(tmp_path: Path) -> Path:
    """Write a Victoria Park log: one second straight ahead at 1 m/s, two trees, six fixes."""
    scipy_io = pytest.importorskip("scipy.io", reason="writes MATLAB files")
    time = np.arange(0, 1001, 25, dtype=np.int32)[:, None]
    still = np.zeros(time.shape)
    scipy_io.savemat(tmp_path / "aa3_dr.mat", {"time": time, "speed": still + 1.0, "steering": still})
    (tmp_path / "victoria_park.txt").write_text(GRAPH)
    fixes = np.arange(0, 1001, 200, dtype=np.int32)[:, None]
    gps = {"timeGps": fixes, "Lo_m": fixes / 1e3, "La_m": fixes * 0.0}
    scipy_io.savemat(tmp_path / "aa3_gpsx.mat", gps)
    return tmp_path

"""Thousands of damaged trajectories through the whole command: numbers, or one line; never a traceback."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from vslam_ref import cli
from vslam_ref.datasets import trajectories
from vslam_ref.geometry import so3
from vslam_ref.metrics.trajectory import Trajectory

sys.path.insert(0, str(Path(__file__).parents[1] / "datasets"))
from damaging import mutate

pytestmark = pytest.mark.filterwarnings("error")
ALIGNMENTS = ("se3", "sim3", "none")


def moving(n: int = 25) -> Trajectory:
    a = np.linspace(0, 6, n)
    t = np.stack([np.cos(a), np.sin(2 * a), 0.3 * a], axis=1)
    R = so3.exp(np.stack([np.sin(a), 0.7 * a, np.cos(1.3 * a)], axis=1))
    return Trajectory(1.4e9 + a, t, R)


@pytest.mark.parametrize(
    ("format", "count"),
    [
        ("tum", 60),
        ("euroc", 60),
        ("kitti", 60),
        *(pytest.param(format, 3400, marks=pytest.mark.slow) for format in trajectories.FORMATS),
    ],
)
def test_a_damaged_estimate_gives_numbers_or_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], format: str, count: int
) -> None:
    """File k is made from (format, k) alone; what happens is asserted with k, so that each is found again."""
    path, truth = tmp_path / "e.txt", tmp_path / "t.txt"
    whole = trajectories.to_text(moving(), format).encode()
    truth.write_text(trajectories.to_text(moving(), "kitti" if format == "kitti" else "tum"))
    ends = {0: 0, 2: 0}
    for k in range(count):
        path.write_bytes(mutate(whole, np.random.default_rng([trajectories.FORMATS.index(format), k])).data)
        status = cli.main(["evaluate", str(path), str(truth), "--align", ALIGNMENTS[k % 3]])
        out, error = capsys.readouterr()
        assert status in ends, (k, status)
        assert error.count("\n") == (1 if status else 0), (k, error)
        assert "Traceback" not in out + error, k
        assert ("ATE, RMSE" in out) == (status == 0), (k, out)
        ends[status] += 1
    assert min(ends.values()) > count / 10, ends

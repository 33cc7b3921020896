"""One motion model: a changed line of ``vehicle.motion_model`` changes whatever NumPy computes with it.

A copy of the package is edited and run by another process; nothing of this process is touched.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import vslam_ref

PROGRAM = """
import json
import numpy as np
from vslam_ref.filters import vehicle
from vslam_ref.filters.ekf_slam import AnchoredEkf, EkfSlam, IdealEkf, Truth
from vslam_ref.worlds.circle import CircleConfig, make_circle

increment = vehicle.Increment(np.array([0.5]), np.array([0.2]), np.diag([0.01, 0.02])[None])
truth = Truth(np.array([[1.0, 2.0, 0.7], [1.38, 2.32, 0.9], [1.7, 2.7, 1.1]]), np.array([[3.0, 4.0]]))
answers = {"propagate": vehicle.propagate([1.0, 2.0, 0.7], [0.5, 0.2]).tolist()}
for name, slam in (
    ("ekf", EkfSlam([1.0, 2.0, 0.7], 0.1 * np.eye(3))),
    ("anchored", AnchoredEkf([1.0, 2.0, 0.7], 0.1 * np.eye(3))),
    ("ideal", IdealEkf([1.0, 2.0, 0.7], 0.1 * np.eye(3), truth)),
):
    slam.update([0], [[[2.0, 1.0]]], 0.01 * np.eye(2))
    slam.predict(increment)
    slam.predict(increment)
    mean, cov = slam.pose()
    answers[name] = [*mean[0].tolist(), *cov[0].ravel().tolist(), *slam.blocks.P_pm[0].ravel().tolist()]
answers["circle"] = make_circle(CircleConfig(steps=3)).T_world_vehicle.ravel().tolist()
print(json.dumps(answers))
"""
VALUE = ("value[..., 1] = y + left", "value[..., 1] = y - left")
SLOPE = ("F[..., 0, 2], F[..., 1, 2] = -left, ahead", "F[..., 0, 2], F[..., 1, 2] = left, ahead")


def answers(folder: Path) -> dict[str, np.ndarray]:
    environment = os.environ | {"PYTHONPATH": str(folder), "VSLAM_REF_BACKEND": "numpy"}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env=environment,
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    return {name: np.array(value) for name, value in json.loads(done.stdout).items()}


@pytest.fixture(scope="module")
def package() -> Path:
    return Path(vslam_ref.__file__).parent


@pytest.mark.parametrize(
    ("edit", "changed"),
    [
        pytest.param(VALUE, {"propagate", "ekf", "anchored", "ideal", "circle"}, id="value"),
        pytest.param(SLOPE, {"ekf", "anchored", "ideal"}, id="Jacobian"),
    ],
)
def test_an_edited_model_changes_the_filters(
    package: Path, tmp_path: Path, edit: tuple[str, str], changed: set[str]
) -> None:
    """Two steps: headings turn, so that every path leaves its axis; 1e-4 is far above rounding."""
    copy = tmp_path / "vslam_ref"
    shutil.copytree(package, copy, ignore=shutil.ignore_patterns("__pycache__", "experiments", "conformance"))
    before = answers(tmp_path)
    model = copy / "filters" / "vehicle.py"
    source = model.read_text()
    assert source.count(edit[0]) == 1
    model.write_text(source.replace(*edit))
    after = answers(tmp_path)
    assert {name for name in before if np.abs(before[name] - after[name]).max() > 1e-4} == changed

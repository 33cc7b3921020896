r"""GTSAM with its own stopping rules: ``triangulateNonlinear``, and the fisheye's inverse.

:mod:`.gtsam_adapter` asks for more.  The difference is what these defaults cost::

    vslam-ref verify --module tests/conformance/adapters/gtsam_usual.py --topic camera --topic multiview \
        --convention gtsam_convention.json
"""

from __future__ import annotations

import importlib.util
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers, answer_from

Array = NDArray[np.float64]


def answer(function: str, inputs: dict[str, Any]) -> Any:
    """Answer one question with GTSAM's defaults."""
    if importlib.util.find_spec("gtsam") is None:
        raise NotImplementedError("GTSAM is not installed")
    table: Answers = {"camera.unproject": _unproject, "multiview.triangulate_optimal": _optimal}
    return answer_from(table, function, inputs)


def _unproject(model: str, params: Array, uv: Array) -> dict[str, Any]:
    import gtsam

    if model != "fisheye":
        raise NotImplementedError(model)
    fx, fy, cx, cy, *k = map(float, params)
    ray = np.array([*gtsam.Cal3Fisheye(fx, fy, 0.0, cx, cy, *k).calibrate(uv), 1.0])
    return {"bearing": ray / np.linalg.norm(ray), "valid": True}


def _optimal(T_cams: Array, params: Array, uv: Array) -> dict[str, Any]:
    import gtsam

    fx, fy, cx, cy = map(float, params)
    poses, K = [gtsam.Pose3(T) for T in T_cams], gtsam.Cal3_S2(fx, fy, 0.0, cx, cy)
    start = gtsam.triangulatePoint3(poses, K, list(uv), 1e-9, False)
    X = gtsam.triangulateNonlinear(poses, K, list(uv), start)
    J = np.zeros((2 * len(poses), 3))
    for k, pose in enumerate(poses):
        parts = [np.zeros((2, n), order="F") for n in (6, 3, 5)]
        gtsam.PinholeCameraCal3_S2(pose, K).project(X, *parts)
        J[2 * k : 2 * k + 2] = parts[1]
    return {"X": X, "covariance": np.linalg.inv(J.T @ J)}

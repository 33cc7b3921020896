"""OpenCV as SLAM programs usually call it: ``undistortPoints`` with its own stopping rule, and EPnP alone.

:mod:`.opencv_adapter` asks for more.  The difference is what these defaults cost::

    vslam-ref verify --module tests/conformance/adapters/opencv_usual.py --topic camera --topic multiview
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from opencv_adapter import camera_matrix, cv2, motion

from vslam_ref.conformance.adapters.table import Answers, answer_from

Array = NDArray[np.float64]


def answer(function: str, inputs: dict[str, Any]) -> Any:
    """Answer one question with OpenCV's defaults."""
    return answer_from(TABLE, function, inputs)


def _unproject(model: str, params: Array, uv: Array) -> dict[str, Any]:
    K, k = camera_matrix(model, params)
    undistort = cv2.fisheye.undistortPoints if model == "fisheye" else cv2.undistortPoints
    ray = np.array([*np.ravel(undistort(uv.reshape(1, 1, 2), K, k)), 1.0])
    return {"bearing": ray / np.linalg.norm(ray), "valid": bool(np.isfinite(ray).all())}


def _pnp(params: Array, X_world: Array, uv: Array) -> Array:
    K, k = camera_matrix("pinhole", params)
    found, rvec, tvec = cv2.solvePnP(X_world, uv, K, k, flags=cv2.SOLVEPNP_EPNP)
    if not found:
        raise ValueError("solvePnP finds no pose")
    return motion(rvec, tvec)


TABLE: Answers = {"camera.unproject": _unproject, "multiview.pnp": _pnp}

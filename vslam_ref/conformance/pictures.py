"""Where a picture tells more than a list: the error of a function's answers over one number of its inputs.

======================  ========================================================================
functions               the number
======================  ========================================================================
of rotations, motions   the angle of the rotation; of two (``interpolate``), the angle between them
of cameras              the angle of the point from the optical axis
======================  ========================================================================
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.compare import numbers
from vslam_ref.conformance.regimes import place
from vslam_ref.conformance.results import Outcome

MOST_PICTURES = 12
FEWEST_POINTS = 4
GROUPS = ("so2", "se2", "so3", "quaternion", "se3", "sim3")


class ErrorPicture(NamedTuple):
    """Errors of one function's answers.

    Attributes
    ----------
    function, axis : str
        What the number is.
    at : list of float
        The number; 0 may be among them.
    errors : list of float
        Relative errors, 1e-16 to 1.
    verdicts : list of str
        "passed", "lost digits" or "failed".
    """

    function: str
    axis: str
    at: list[float]
    errors: list[float]
    verdicts: list[str]


def pictures(outcomes: Iterable[Outcome]) -> list[ErrorPicture]:
    """Pictures of the functions that have failures or lost digits, basic ones first."""
    groups: dict[str, list[Outcome]] = {}
    for o in outcomes:
        if o.status in ("passed", "lost digits", "failed") and not np.isnan(o.digits):
            groups.setdefault(o.case.function, []).append(o)
    wrong = [f for f, those in groups.items() if any(o.status != "passed" for o in those)]
    found = (_picture(function, groups[function]) for function in sorted(wrong, key=place))
    return [picture for picture in found if picture is not None]


def _picture(function: str, outcomes: list[Outcome]) -> ErrorPicture | None:
    axis, number = _number(function)
    if number is None:
        return None
    points = []
    for o in outcomes:
        try:
            at = number(o.case.inputs)
        except (KeyError, ValueError, IndexError, TypeError):
            continue  # a case without this number
        if np.isfinite(at):
            points.append((at, 10.0**-o.digits, o.status))
    if len(points) < FEWEST_POINTS:
        return None
    return ErrorPicture(function, axis, *(list(part) for part in zip(*points, strict=True)))


def _number(function: str) -> tuple[str, Callable[[dict[str, Any]], float] | None]:
    topic, _, name = function.partition(".")
    if topic in GROUPS:
        between = name == "interpolate"
        return (
            "angle between a and b (rad)" if between else "angle (rad)",
            angle_between if between else angle,
        )
    if topic == "camera":
        return "angle from the optical axis (rad)", off_axis
    return "", None


def angle(inputs: dict[str, Any]) -> float:
    """Angle of the rotation in a function's inputs.

    Examples
    --------
    >>> angle({"phi": [0.0, 3.0, 4.0]}), angle({"x": [1.0, 2.0, -0.5]})
    (5.0, 0.5)
    """
    if "angle" in inputs:
        return abs(float(inputs["angle"]))
    if "phi" in inputs:
        return float(np.linalg.norm(numbers(inputs["phi"])))
    if "xi" in inputs:
        xi = numbers(inputs["xi"])
        return float(np.linalg.norm(xi[2:] if len(xi) == 3 else xi[3:6]))
    if "q" in inputs:
        w, *v = numbers(inputs["q"])
        return float(2.0 * np.arctan2(np.linalg.norm(v), abs(w)))
    key = next(name for name in ("R", "T", "S", "M", "pose", "a", "x") if name in inputs)
    return _turn(numbers(inputs[key]))


def angle_between(inputs: dict[str, Any]) -> float:
    """Angle of the rotation from a to b."""
    a, b = (numbers(inputs[name])[:3, :3] for name in "ab")
    return _turn(a.T @ b)


def off_axis(inputs: dict[str, Any]) -> float:
    """Angle of a point from the camera's axis."""
    if "X_cam" in inputs:
        X = numbers(inputs["X_cam"])
    else:
        X = _moved(numbers(inputs["pose"]), numbers(inputs["X_world"]))
        X = _moved(numbers(inputs["T_cam_rig"]), X) if "T_cam_rig" in inputs else X
    return float(np.arctan2(np.hypot(X[0], X[1]), X[2]))


def _moved(T: Array, X: Array) -> Array:
    return np.asarray(T[:3, :3] @ X + T[:3, 3])


def _turn(x: Array) -> float:
    """Angle of a plane pose (x, y, angle), or of the rotation in a matrix, scaled or not."""
    if x.ndim == 1:
        return abs(float(x[2]))
    M = x[:3, :3]
    axis = np.array([M[2, 1] - M[1, 2], M[0, 2] - M[2, 0], M[1, 0] - M[0, 1]])
    scale = float(np.cbrt(np.linalg.det(M)))
    return float(np.arctan2(np.linalg.norm(axis), np.trace(M) - scale))

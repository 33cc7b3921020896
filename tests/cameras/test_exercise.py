"""Exercise 3.1: the FOV camera.  Oracle: the report's formula at 40 digits, one point at a time."""

from __future__ import annotations

from types import ModuleType

import mpmath
import numpy as np
import pytest

EXERCISE = "03_fov_camera"

PARAMS = np.array([446.9, 447.1, 319.5, 239.5, 0.9333])
PINHOLE = np.array([446.9, 447.1, 319.5, 239.5, 0.0])
X = np.array([[0.3, -0.2, 1.5], [1.0, 2.0, 0.5], [-4.0, 1.0, 2.0], [1e-6, 0.0, 1.0], [0.0, 0.0, 3.0]])


def wanted(params: np.ndarray, point: np.ndarray) -> np.ndarray:
    with mpmath.workdps(40):
        x, y, z, w = (mpmath.mpf(float(v)) for v in [*point, params[4]])
        r = mpmath.sqrt(x * x + y * y) / z
        factor = mpmath.atan(2 * r * mpmath.tan(w / 2)) / (w * r) if r and w else 1
        m = [x / z * factor, y / z * factor]
    return params[2:4] + params[:2] * [float(v) for v in m]


@pytest.mark.parametrize("params", [PARAMS, PINHOLE], ids=["fov", "omega = 0"])
def test_pixels(answer: ModuleType, params: np.ndarray) -> None:
    uv, valid = answer.project(params, X)
    assert np.shape(uv) == (5, 2), f"uv has shape {np.shape(uv)}, need (5, 2)"
    assert np.all(np.isfinite(uv)), (
        "a pixel is not a number: what happens on the axis, r = 0, and at omega = 0?"
    )
    assert np.all(valid), "all these points are in front of the camera"
    right = np.array([wanted(params, point) for point in X])
    assert np.allclose(uv, right, rtol=0, atol=1e-9), f"pixels\n{uv}\nmust be\n{right}"


def test_near_the_axis_the_factor_is_not_one(answer: ModuleType) -> None:
    r = 9e-4
    uv, _ = answer.project(PARAMS, np.array([[r, 0.0, 1.0]]))
    assert abs(uv[0, 0] - (PARAMS[0] * r + PARAMS[2])) > 0.01, (
        "the quotient r'/r tends to 2 tan(omega/2)/omega, not to 1, when r goes to 0"
    )
    assert np.allclose(uv[0], wanted(PARAMS, np.array([r, 0.0, 1.0])), rtol=0, atol=1e-10)


def test_behind_the_camera(answer: ModuleType) -> None:
    uv, valid = answer.project(PARAMS, np.array([[0.3, -0.2, -1.5], [1.0, 0.0, 0.0], [0.3, -0.2, 1.5]]))
    assert list(valid) == [False, False, True], (
        "only the last point has z > 0; a minus sign would mirror the first"
    )
    assert np.allclose(uv[:2], PARAMS[2:4]), "where not valid, answer with the principal point, not with NaN"


@pytest.mark.parametrize("params", [PARAMS, PINHOLE], ids=["fov", "omega = 0"])
def test_there_and_back(answer: ModuleType, params: np.ndarray) -> None:
    uv = np.array([wanted(params, point) for point in X])
    xn, valid = answer.unproject(params, uv)
    assert np.all(valid)
    assert np.allclose(xn, X[:, :2] / X[:, 2:], rtol=1e-9, atol=1e-13), "unproject does not undo project"


def test_pixels_that_nothing_in_front_reaches(answer: ModuleType) -> None:
    """The half-space in front fills the disc r' < pi/(2 omega), 752 px here."""
    uv = PARAMS[2:4] + np.array([[751.0, 0.0], [753.0, 0.0], [2000.0, 0.0]])
    xn, valid = answer.unproject(PARAMS, uv)
    assert list(valid) == [True, False, False], (
        "beyond r' omega = pi/2 the tangent comes back with another sign"
    )
    assert np.all(xn[1:] == 0.0), "where not valid, answer with zero"

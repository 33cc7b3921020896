"""Limits r -> 0 and omega -> 0: both sides of every threshold against 50 digits."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from vslam_ref.geometry.cameras import Fisheye, Fov
from vslam_ref.geometry.cameras._series import ARCTAN_SERIES, arctan_ratio, tan_ratio, tan_ratio_slope
from vslam_ref.geometry.coefficients import SMALL

EPS = float(np.finfo(float).eps)
mpmath.mp.dps = 50
SENSOR = {"fx": 500.0, "fy": 400.0, "cx": 320.0, "cy": 240.0}


def around(*thresholds: float) -> list[float]:
    return [v for t in thresholds for v in (np.nextafter(t, 0), t, np.nextafter(t, 9))]


QS = [0.0, 5e-324, 1e-300, 1e-20, 1e-8, 1e-3, 0.05, *around(ARCTAN_SERIES), 0.2, 1.0, 7.0, 1e6, 1e30]
OMEGAS = [0.0, 5e-324, 1e-200, *around(1e-8), 1e-4, 0.1, 0.5, *around(SMALL), 0.9332, 2.0, 3.0, 3.14]


def exact_arctan_ratio(q: float) -> tuple[mpmath.mpf, mpmath.mpf]:
    """S and S' at 50 digits; S' by its own integral, which has no cancellation."""
    p = mpmath.mpf(q)
    if p < mpmath.mpf("1e-10"):
        return 1 - p / 3 + p * p / 5, mpmath.mpf(-1) / 3 + 2 * p / 5 - 3 * p * p / 7
    t = mpmath.sqrt(p)
    S = mpmath.atan(t) / t
    return S, (1 / (1 + p) - S) / (2 * p)


@pytest.mark.parametrize("q", QS)
def test_arctan_ratio(q: float) -> None:
    S, slope = (float(v) for v in arctan_ratio(np.array(q)))
    exact, exact_slope = exact_arctan_ratio(q)
    assert abs(S / exact - 1) < 4 * EPS
    # above the threshold three roundings of numbers below 1 are divided by 2 q S' (2 q 0.28 at 0.1)
    lost = 8 if q < ARCTAN_SERIES else 8 + 3 / (2 * q * abs(float(exact_slope)))
    assert abs(slope / exact_slope - 1) < lost * EPS


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("omega", OMEGAS)
def test_tan_ratio(omega: float, sign: int) -> None:
    w = mpmath.mpf(omega) * sign
    A, slope = float(tan_ratio(np.array(sign * omega))), float(tan_ratio_slope(np.array(sign * omega)))
    half = w / 2
    exact = mpmath.tan(half) / half if omega > 0 else mpmath.mpf(1)
    exact_slope = (w - mpmath.sin(w)) / (w * mpmath.cos(half)) ** 2 if omega > 1e-12 else w / 6
    # tan near pi/2 multiplies the rounding of its argument by (w/2) / (cos sin) = w / sin w
    sharp = 1 + abs(float(w / mpmath.sin(w))) if omega > 0 else 1
    assert abs(A / exact - 1) < 4 * sharp * EPS
    lost = 8 if omega < SMALL else 8 + 6 / omega**2
    # 4e-324: the spacing of the smallest numbers, which w/6 may be
    assert abs(slope - exact_slope) <= (lost + 4 * sharp) * EPS * abs(exact_slope) + 5e-324


@pytest.mark.parametrize("omega", [0.0, 1e-9, 0.3, np.nextafter(0.5, 0), 0.5, 0.9332, 2.9])
@pytest.mark.parametrize("r", [0.0, 1e-300, 1e-9, 1e-3, 0.2, 0.9, 40.0])
def test_fov_jacobians_at_the_limits(omega: float, r: float) -> None:
    """J_point and J_omega against 50-digit derivatives, in the limits and beyond every threshold."""
    camera = Fov(**SENSOR, omega=omega)
    X = np.array([0.6 * r, 0.8 * r, 1.0]) * 2.0
    at = camera.project_with_jacobians(X)
    assert at.valid

    def pixel(x: mpmath.mpf, y: mpmath.mpf, z: mpmath.mpf, w: mpmath.mpf) -> list[mpmath.mpf]:
        rr = mpmath.sqrt(x * x + y * y) / z
        T = 2 * mpmath.tan(w / 2)
        factor = (mpmath.atan(T * rr) / (w * rr) if rr else T / w) if w else mpmath.mpf(1)
        return [camera.fx * x / z * factor, camera.fy * y / z * factor]

    base = [mpmath.mpf(float(v)) for v in X] + [mpmath.mpf(omega)]
    step = mpmath.mpf("1e-20")  # central difference: 1e-40 of truncation, 30 digits of rounding left
    J = np.concatenate([at.J_point, at.J_intrinsics[:, 4:]], 1)
    size = np.abs(J).max()
    for j in range(4):
        ahead, behind = ([b + s * step * (i == j) for i, b in enumerate(base)] for s in (1, -1))
        slope = [(a - b) / (2 * step) for a, b in zip(pixel(*ahead), pixel(*behind), strict=True)]
        if j == 3 and omega == 0.0:
            slope = [mpmath.mpf(0)] * 2  # even in omega
        error = max(abs(float(J[i, j] - slope[i])) for i in range(2))
        # roundings of arctan_ratio's slope (60), of tan near its pole at omega = 2.9 (12), of the sum
        assert error < 200 * EPS * size, (j, error / size / EPS)


@pytest.mark.parametrize(
    "t", [0.0, 1e-300, 1e-12, 1e-8, 1e-4, 0.1, *around(ARCTAN_SERIES**0.5), 0.5, 5.0, 1e4]
)
@pytest.mark.parametrize("z", [1.0, -1.0])
def test_fisheye_jacobians_at_the_limits(t: float, z: float) -> None:
    camera = Fisheye(**SENSOR, k1=-0.0137, k2=0.0207, k3=-0.0027, k4=0.0005)
    X = np.array([0.6 * t, -0.8 * t, z])
    at = camera.project_with_jacobians(X)
    if z < 0 and t < 1e-6:  # straight behind
        assert not at.valid
        return
    assert at.valid

    def pixel(x: mpmath.mpf, y: mpmath.mpf, depth: mpmath.mpf) -> list[mpmath.mpf]:
        rho = mpmath.sqrt(x * x + y * y)
        theta = mpmath.atan2(rho, depth)
        p = theta**2
        kappa = 1 + p * (camera.k1 + p * (camera.k2 + p * (camera.k3 + p * mpmath.mpf(camera.k4))))
        factor = theta * kappa / rho if rho else 1 / depth
        return [camera.fx * x * factor, camera.fy * y * factor]

    base = [mpmath.mpf(float(v)) for v in X]
    step = mpmath.mpf("1e-20") * max(mpmath.mpf(1), abs(base[0]))
    size = np.abs(at.J_point).max()
    for j in range(3):
        ahead, behind = ([b + s * step * (i == j) for i, b in enumerate(base)] for s in (1, -1))
        slope = [(a - b) / (2 * step) for a, b in zip(pixel(*ahead), pixel(*behind), strict=True)]
        error = max(abs(float(at.J_point[i, j] - slope[i])) for i in range(2))
        assert error < 200 * EPS * size, (j, error / size / EPS)

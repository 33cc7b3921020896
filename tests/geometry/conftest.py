"""An independent oracle for the groups: the exponential's own series, summed with 60 digits.

Nothing of the package is used: the generators and brackets are written out here.
"""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

DIGITS = 60
EPS = float(np.finfo(float).eps)
# both sides of the one threshold (1 rad), the ends, tiny, generic, near pi, beyond pi, near 2 pi
ANGLES = (
    0.0, 5e-324, 1e-200, 1e-160, 1e-12, 1e-8, 1e-4, 0.1, 0.5,
    1 - 3 * EPS, 1 - EPS / 2, 1.0, 1 + EPS, 1 + 4 * EPS, 1.2, 2.0, 3.0,
    np.pi - 1e-3, np.pi - 1e-9, np.nextafter(np.pi, 0), np.pi, np.nextafter(np.pi, 4), np.pi + 1e-6,
    4.0, 5.0, 6.0, 2 * np.pi - 1e-3, 2 * np.pi - 1e-9, 2 * np.pi,
)  # fmt: skip
AXES = (np.array([1.0, 0.0, 0.0]), np.array([0.36, -0.48, 0.8]), np.array([-0.6, 0.8, 1e-9]))
RHO = np.array([1.3, -2.1, 0.7])
LOG_SCALES = (0.0, 1e-300, -1e-12, 1e-8, -0.01, 0.5, -0.8, 1 - EPS / 2, 1.0, 1 + EPS, -3.0, 8.0)


class Exact:
    """Matrices of 60-digit numbers (object arrays)."""

    angles, axes, rho, log_scales = ANGLES, AXES, RHO, LOG_SCALES

    @staticmethod
    def of(values: Any) -> np.ndarray:
        """Floats as they are, without rounding."""
        flat = [mpmath.mpf(float(v)) for v in np.ravel(values)]
        return np.array(flat, dtype=object).reshape(np.shape(values))

    def cross(self, v: Any) -> np.ndarray:
        x, y, z = self.of(v)
        return np.array([[0 * x, -z, y], [z, 0 * x, -x], [-y, x, 0 * x]], dtype=object)

    def generator(self, xi: Any) -> np.ndarray:
        """phi (3,), (rho, phi) (6,) or (rho, phi, sigma) (7,) as a matrix of the Lie algebra."""
        if len(xi) == 3:
            return self.cross(xi)
        M = self.of(np.zeros((4, 4)))
        M[:3, :3], M[:3, 3] = self.cross(xi[3:6]), self.of(xi[:3])
        if len(xi) == 7:
            M[:3, :3] += self.of(xi[6] * np.eye(3))
        return M

    def bracket(self, xi: Any) -> np.ndarray:
        """Column j is the bracket of xi with the j-th unit vector, by matrix products."""
        A, columns = self.generator(xi), []
        for unit in np.eye(len(xi)):
            B = self.generator(unit)
            C = A.dot(B) - B.dot(A)
            rotation = [C[2, 1], C[0, 2], C[1, 0]]
            whole = rotation if len(xi) == 3 else [*C[:3, 3], *rotation]
            columns.append([*whole, C[0, 0]] if len(xi) == 7 else whole)
        return np.array(columns, dtype=object).T

    def series(self, A: np.ndarray, shift: int) -> np.ndarray:
        """Sum of A^n / (n + shift)!: the exponential for 0, its average over [0, 1] for 1."""
        with mpmath.workdps(DIGITS):
            power = self.of(np.eye(len(A)))
            total, n = power / mpmath.factorial(shift), 0
            while max(abs(v) for v in power.flat) > mpmath.mpf(10) ** -50:
                n += 1
                power = power.dot(A) / (n + shift)
                total = total + power / mpmath.factorial(shift) if shift == 0 else total + power
            return total

    def exp(self, xi: Any) -> np.ndarray:
        with mpmath.workdps(DIGITS):
            return self.series(self.generator(xi), 0)

    def left_jacobian(self, xi: Any) -> np.ndarray:
        with mpmath.workdps(DIGITS):
            return self.series(self.bracket(xi), 1)

    def inverse(self, A: np.ndarray) -> np.ndarray:
        with mpmath.workdps(DIGITS):
            inverse = mpmath.inverse(mpmath.matrix(A.tolist()))
            return np.array(inverse.tolist(), dtype=object).reshape(A.shape)

    def error(self, found: Any, exact: np.ndarray) -> float:
        """Relative error in the Frobenius norm."""
        with mpmath.workdps(DIGITS):
            off = self.of(found) - exact
            return float(mpmath.sqrt(sum(v * v for v in off.flat) / sum(v * v for v in exact.flat)))


@pytest.fixture(scope="session")
def exact() -> Exact:
    return Exact()

"""Matrix groups by their generators: everything follows from the matrix exponential.

A group is a function ``hat`` from tangent vectors to matrices and its inverse ``vee``.  The adjoint is what
conjugation does to the generators, ad what the bracket does, and the left Jacobian the sum of
ad^k / (k + 1)!: no closed form is used.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import mpmath
import numpy as np
from mpmath import mpf

from generator import exact
from generator.draws import rotation_vector
from generator.exact import Matrix, column, expm, floats, integrated, matrix, vector
from generator.so3 import log_of, polar
from vslam_ref.arrays import Array

Vector = list[Any]

REGIMES: dict[str, tuple[float, float]] = {
    "small_angle": (1e-10, 1e-3),
    "generic": (0.1, 3.0),
    "near_pi": (np.pi - 1e-3, np.pi - 1e-8),
    "beyond_pi": (3.3, 5.8),
}
"""Flag -> range of the angle, log-uniform."""


class Group(NamedTuple):
    """Length of a tangent vector, ``hat`` and ``vee``."""

    dof: int
    hat: Callable[[Sequence[Any]], Matrix]
    vee: Callable[[Matrix], Vector]

    def exp(self, xi: Sequence[Any]) -> Matrix:
        """Power series of the generator."""
        return expm(self.hat(xi))

    def ad(self, xi: Sequence[Any]) -> Matrix:
        """Columns are brackets with the generators."""
        X = self.hat(xi)
        return self._columns(lambda E: X * E - E * X)

    def adjoint(self, T: Matrix) -> Matrix:
        """Columns are conjugated generators."""
        back = T**-1
        return self._columns(lambda E: T * E * back)

    def left_jacobian(self, xi: Sequence[Any]) -> Matrix:
        """Sum of ad^k / (k + 1)!."""
        return integrated(self.ad(xi))

    def _columns(self, change: Callable[[Matrix], Matrix]) -> Matrix:
        units = [[mpf(int(i == j)) for i in range(self.dof)] for j in range(self.dof)]
        return mpmath.matrix([self.vee(change(self.hat(unit))) for unit in units]).T


def _hat_plane(xi: Sequence[Any]) -> Matrix:
    x, y, a = xi
    return mpmath.matrix([[0, -a, x], [a, 0, y], [0, 0, 0]])


def _vee_plane(M: Matrix) -> Vector:
    return [M[0, 2], M[1, 2], M[1, 0]]


def _hat_space(xi: Sequence[Any]) -> Matrix:
    M = mpmath.zeros(4, 4)
    M[0:3, 0:3] = exact.hat(xi[3:6])
    for i in range(3):
        M[i, 3] = xi[i]
    return M


def _vee_space(M: Matrix) -> Vector:
    return [M[0, 3], M[1, 3], M[2, 3], M[2, 1], M[0, 2], M[1, 0]]


def _hat_similar(xi: Sequence[Any]) -> Matrix:
    M = _hat_space(xi)
    for i in range(3):
        M[i, i] = xi[6]
    return M


def _vee_similar(M: Matrix) -> Vector:
    sigma = (M[0, 0] + M[1, 1] + M[2, 2]) / 3
    turns = [(M[2, 1] - M[1, 2]) / 2, (M[0, 2] - M[2, 0]) / 2, (M[1, 0] - M[0, 1]) / 2]
    return [M[0, 3], M[1, 3], M[2, 3], *turns, sigma]


SE2 = Group(3, _hat_plane, _vee_plane)
SE3 = Group(6, _hat_space, _vee_space)
SIM3 = Group(7, _hat_similar, _vee_similar)


def turn(rng: np.random.Generator, flag: str = "generic") -> Array:
    """Rotation vector of a regime."""
    return rotation_vector(rng, *REGIMES[flag])


def shift(rng: np.random.Generator, size: float = 2.0) -> Array:
    """Vector that is not near zero in any coordinate."""
    return np.asarray(size * rng.uniform(0.3, 1.5, 3) * rng.choice([-1.0, 1.0], 3))


def twist(rng: np.random.Generator, flag: str = "generic") -> Array:
    """Tangent vector of SE(3) with an angle of the regime and a translation of order 1."""
    return np.concatenate([shift(rng), turn(rng, flag)])


def motion(rng: np.random.Generator, flag: str = "generic") -> Array:
    """Rigid motion, rounded to doubles."""
    return np.array(floats(SE3.exp(vector(twist(rng, flag)))))


def product(*factors: Any) -> Matrix:
    """Exact product of matrices of doubles."""
    total = matrix(factors[0])
    for factor in factors[1:]:
        total = total * matrix(factor)
    return total


def turned(T: Any) -> tuple[Matrix, Vector]:
    """Rotation nearest to that of T, a rounded rigid motion, and T's translation."""
    M = T if isinstance(T, mpmath.matrix) else matrix(T)
    return polar(M[0:3, 0:3]), [M[i, 3] for i in range(3)]


def rigid_inverse(T: Any) -> Matrix:
    """Inverse of a rigid motion by its definition, T^-1 T = 1, its rounding included."""
    return matrix(T) ** -1


def log_rigid(T: Any, start: Array) -> Vector:
    """Tangent vector of a rounded rigid motion; ``start`` is a rotation vector close by."""
    M = T if isinstance(T, mpmath.matrix) else matrix(T)
    phi = log_of(np.array(floats(M[0:3, 0:3])), start)
    V = integrated(exact.hat(phi))
    rho = V**-1 * mpmath.matrix([M[i, 3] for i in range(3)])
    return [*column(rho), *phi]

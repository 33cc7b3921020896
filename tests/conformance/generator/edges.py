"""Errors of a pose graph's edges, and their Jacobians: matrices and series of brackets, in 50 digits."""

from __future__ import annotations

from typing import Any, NamedTuple

import mpmath
import numpy as np
from mpmath import mpf
from scipy.spatial.transform import Rotation

from generator import exact
from generator.exact import Matrix, column, floats, integrated
from generator.groups import SE2, SE3, SIM3, Group, Vector
from generator.so3 import log_of

GROUPS: dict[str, Group] = {"se2": SE2, "se3": SE3, "sim3": SIM3}


class Edge(NamedTuple):
    """Error and Jacobians in steps on the right, X <- X Exp(delta)."""

    e: Vector
    J_i: Matrix
    J_j: Matrix

    def doubles(self) -> dict[str, Any]:
        """Outputs of a case."""
        return {"e": floats(self.e), "J_i": floats(self.J_i), "J_j": floats(self.J_j)}


def logarithm(space: str, D: Matrix, turns: int = 0) -> Vector:
    """Tangent vector of a matrix of the group, rounded or not; in the plane some whole turns more."""
    if space == "se2":
        a = mpmath.atan2(D[1, 0], D[0, 0]) + 2 * mpmath.pi * turns
        V = integrated(mpmath.matrix([[0, -a], [a, 0]]))
        return [*column(V**-1 * D[0:2, 2]), a]
    s = mpmath.cbrt(mpmath.det(D[0:3, 0:3])) if space == "sim3" else mpf(1)
    R = np.array(floats(D[0:3, 0:3] / s))
    phi = log_of(R, Rotation.from_matrix(R).as_rotvec())
    W = integrated(exact.hat(phi) + mpmath.log(s) * mpmath.eye(3))
    found = [*column(W**-1 * D[0:3, 3]), *phi]
    return [*found, mpmath.log(s)] if space == "sim3" else found


def edge(space: str, convention: str, X: tuple[Matrix, Matrix, Matrix], wrong: str = "") -> Edge:
    """Error of Z^-1 X_i^-1 X_j; ``X`` holds X_i, X_j and Z."""
    group = GROUPS[space]
    X_i, X_j, Z = X
    M = X_i**-1 * X_j
    D = Z * M if wrong == "z-not-inverted" else Z**-1 * (M**-1 if wrong == "edge-reversed" else M)
    if wrong == "other-convention":
        convention = "g2o" if convention == "log" else "log"
    if convention == "log":
        e = logarithm(space, D, _turns(X) if wrong == "angle-not-wrapped" else 0)
        J_j = group.left_jacobian(e if wrong == "right-for-left" else [-v for v in e]) ** -1
    else:
        e, J_j = _g2o(space, D, wrong)
        if wrong == "angle-not-wrapped":
            e[2] += 2 * mpmath.pi * _turns(X)
    if wrong == "jacobian-forgotten":
        J_j = mpmath.eye(group.dof)
    J_i = -J_j * group.adjoint(M if wrong == "adjoint-of-the-inverse" else M**-1)
    if wrong == "left-steps":
        J_i, J_j = J_i * group.adjoint(X_i**-1), J_j * group.adjoint(X_j**-1)
    return Edge(e, J_i, J_j)


def _turns(X: tuple[Matrix, Matrix, Matrix]) -> int:
    """Whole turns by which the plain difference of three angles is off."""
    i, j, z = (float(mpmath.atan2(T[1, 0], T[0, 0])) for T in X)
    return round((j - i - z) / (2 * np.pi))


def _g2o(space: str, D: Matrix, wrong: str) -> tuple[Vector, Matrix]:
    """Translation and angle, or vector part of the quaternion, w >= 0."""
    n = 2 if space == "se2" else 3
    R, t = D[0:n, 0:n], column(D[0:n, n])
    J = mpmath.zeros(2 * n - 1 if n == 2 else 6)
    J[0:n, 0:n] = R
    if n == 2:
        J[2, 2] = mpf(1)
        return [*t, mpmath.atan2(R[1, 0], R[0, 0])], J
    w = mpmath.sqrt(1 + R[0, 0] + R[1, 1] + R[2, 2]) / 2
    v = [(R[2, 1] - R[1, 2]) / (4 * w), (R[0, 2] - R[2, 0]) / (4 * w), (R[1, 0] - R[0, 1]) / (4 * w)]
    turn = (w * mpmath.eye(3) + exact.hat(v)) / 2  # of v, when (w, v) is multiplied by (1, delta / 2)
    if wrong == "quaternion-order":
        v, turn = [w, *v[:2]], mpmath.matrix([[-x / 2 for x in v], *turn[0:2, 0:3].tolist()])
    if wrong == "whole-angle":
        v, turn = [2 * x for x in v], 2 * turn
    J[3:6, 3:6] = turn
    return [*t, *v], J

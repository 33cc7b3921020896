r"""What an edge says against two poses: its error, in two conventions, and how it changes with them.

::

    X_i                  X_j        Z      what the edge measured: X_i^-1 X_j as it should be
     o---------- Z ------o          D = Z^-1 X_i^-1 X_j: what is left, the identity if the edge agrees
       \________________/
         X_i^-1 X_j

===========  =============================================  ===========================================
convention   error e                                        Jacobian in X_j
===========  =============================================  ===========================================
``log``      Log(D), (translation, rotation, log-scale)     inverse right Jacobian of the group at e
``g2o``      2-D: translation and angle of D                [R_D, 0; 0, 1]
``g2o``      3-D: translation of D and the vector part      [R_D, 0; 0, (w I + hat(v)) / 2]
             v of its quaternion (w >= 0)
``g2o``      Sim(3): as ``log``                             as ``log``
===========  =============================================  ===========================================

Poses move on the right, X <- X Exp(delta), in the body's own frame: a step then looks the same wherever in
the world the body stands, and the columns of the Jacobian have no lever arms of the size of the map.  (The
rest of the house perturbs on the left; Exp(Ad_X delta) X = X Exp(delta).)  In both conventions
:math:`D \to \mathrm{Exp}(-\mathrm{Ad}_{M^{-1}}\delta_i)` on the right of D, with M = X_i^-1 X_j, so that
J_i = -J_j Ad(M^-1).
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from vslam_ref.arrays import Array, blocks
from vslam_ref.estimation.posegraph.spaces import GROUPS, Space, rotations, translations
from vslam_ref.geometry import quaternion, so2, so3

Convention = Literal["log", "g2o"]
CONVENTIONS: tuple[Convention, ...] = ("log", "g2o")


class EdgeErrors(NamedTuple):
    """Errors ``e (..., d)``, and their Jacobians in steps on the right, metres and radians.

    ``J_tail (..., d, d)`` is that of the first pose, ``J_head (..., d, d)`` that of the second.
    """

    e: Array
    J_tail: Array
    J_head: Array


def edge_error(tail: Array, head: Array, measured: Array, *, space: Space, convention: Convention) -> Array:
    """Error of edges, (..., d): what the poses say less what was measured.

    Implements :eq:`eq-edge-error`, and by option :eq:`eq-g2o-error`.

    Parameters
    ----------
    tail, head : ndarray, shape (..., 3) or (..., 4, 4)
        Poses T_world_i and T_world_j.
    measured : ndarray, shape (..., 3) or (..., 4, 4)
        T_i_j of the edge.
    space : {"se2", "se3", "sim3"}
    convention : {"log", "g2o"}

    Returns
    -------
    ndarray, shape (..., d)
        Metres, radians (halves of sines in g2o's 3-D form), log-scale.

    Examples
    --------
    >>> a, b, z = np.zeros(3), np.array([1.0, 0.0, 0.1]), np.array([1.0, 0.0, 0.0])
    >>> edge_error(a, b, z, space="se2", convention="g2o").tolist()
    [0.0, 0.0, 0.1]
    """
    group = GROUPS[space]
    return _value(group.between(measured, group.between(tail, head)), space, convention)


def edge_error_with_jacobians(
    tail: Array, head: Array, measured: Array, *, space: Space, convention: Convention
) -> EdgeErrors:
    """Error of edges and its Jacobians in steps on the right, X Exp(delta).

    Implements :eq:`eq-edge-jacobians`.

    Parameters
    ----------
    tail, head : ndarray, shape (..., 3) or (..., 4, 4)
        Poses T_world_i and T_world_j.
    measured : ndarray, shape (..., 3) or (..., 4, 4)
        T_i_j of the edge.
    space : {"se2", "se3", "sim3"}
    convention : {"log", "g2o"}

    Returns
    -------
    EdgeErrors
    """
    group = GROUPS[space]
    between = group.between(tail, head)
    left_over = group.between(measured, between)
    e = _value(left_over, space, convention)
    J_head = _slope(left_over, e, space, convention)
    return EdgeErrors(e, -J_head @ group.adjoint(group.inverse(between)), J_head)


def _value(left_over: Array, space: Space, convention: Convention) -> Array:
    """Error from D."""
    if convention == "log" or space == "sim3":
        return np.asarray(GROUPS[space].log(left_over))
    if space == "se2":
        return np.concatenate([left_over[..., :2], so2.wrap(left_over[..., 2:])], -1)
    return np.concatenate([translations(space, left_over), _quaternion(left_over)[..., 1:]], -1)


def _slope(left_over: Array, e: Array, space: Space, convention: Convention) -> Array:
    """Derivative of the error with respect to a step on the right of D, (..., d, d)."""
    if convention == "log" or space == "sim3":
        return np.asarray(GROUPS[space].left_jacobian_inverse(-e))  # the right Jacobian at e
    R = rotations(space, left_over)
    if space == "se2":
        return blocks([[R, 0.0], [0.0, np.ones((1, 1))]])
    q = _quaternion(left_over)
    turn = 0.5 * (q[..., 0, None, None] * np.eye(3) + so3.hat(q[..., 1:]))
    return blocks([[R, 0.0], [0.0, turn]])


def _quaternion(T: Array) -> Array:
    """Quaternion (w, x, y, z) with w >= 0 of a rigid motion."""
    return quaternion.from_matrix(T[..., :3, :3])

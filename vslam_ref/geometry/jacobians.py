"""What the functions ``*_with_jacobians`` of the groups return.

All Jacobians are with respect to small left perturbations: of an element that goes in, ``Exp(d) T``, and of
one that comes out; points are perturbed by addition.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array


class Acted(NamedTuple):
    """A moved point (..., n), its Jacobian in the element (..., n, k) and in the point (..., n, n).

    The value has the points' unit; J_pose is per metre and radian.
    """

    value: Array
    J_pose: Array
    J_point: Array


class Combined(NamedTuple):
    """An element made of a and b, ``value (..., m, m)``, and its Jacobians in both.

    ``J_a (..., k, k)`` and ``J_b (..., k, k)`` are of tangent vectors in metres and radians.
    """

    value: Array
    J_a: Array
    J_b: Array


class Unary(NamedTuple):
    """A function of one element, ``value (..., m, m)`` or a tangent vector (..., k), and its Jacobian.

    ``J_pose (..., k, k)`` is of tangent vectors in metres and radians.
    """

    value: Array
    J_pose: Array


def combined(value: Array, J_a: Array, J_b: Array, axes: int = 2) -> Combined:
    """Value and Jacobians of a product, the Jacobians over the value's whole batch.

    ``value (..., m, m)``, or (..., m) with one of ``axes``; ``J_a (..., k, k)`` and ``J_b (..., k, k)`` are
    of tangent vectors in metres and radians.
    """
    shape = (*value.shape[: value.ndim - axes], *J_b.shape[-2:])
    return Combined(value, np.broadcast_to(J_a, shape), np.broadcast_to(J_b, shape))

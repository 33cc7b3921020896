"""What the functions ``*_with_jacobians`` of the groups return.

All Jacobians are with respect to small left perturbations: of an element that goes in, ``Exp(d) T``, and of
one that comes out; points are perturbed by addition.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array


class Acted(NamedTuple):
    """A moved point (..., n), its Jacobian in the element (..., n, k) and in the point (..., n, n)."""

    value: Array
    J_pose: Array
    J_point: Array


class Combined(NamedTuple):
    """An element made of a and b, and its Jacobians (..., k, k) in both."""

    value: Array
    J_a: Array
    J_b: Array


class Unary(NamedTuple):
    """A function of one element, and its Jacobian (..., k, k)."""

    value: Array
    J_pose: Array


def combined(value: Array, J_a: Array, J_b: Array, axes: int = 2) -> Combined:
    """Value, an element of ``axes`` axes, and its Jacobians (k, k) or (..., k, k) over the value's batch."""
    shape = (*value.shape[: value.ndim - axes], *J_b.shape[-2:])
    return Combined(value, np.broadcast_to(J_a, shape), np.broadcast_to(J_b, shape))

"""The inverse of the radial-tangential lens, for flat batches of positions (N, 2); k is (n,) or (N, n)."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.geometry.cameras._batches import of
from vslam_ref.geometry.cameras._radtan_terms import coefficients, plane_jacobian, radial, tangential
from vslam_ref.geometry.cameras._roots import solve_increasing

ITERATIONS = 100
ROUNDINGS = 32
"""A position is found when its image is off by fewer roundings of its size than this."""


def may_have_a_ray(k: Array, xd: Array, radius: Array) -> BoolArray:
    """Whether xd is no farther out than any image of the field, D(R) + 3 hypot(p1, p2) R^2; no for NaN."""
    p = np.hypot(k[..., 2], k[..., 3])
    reach = radius * radial(k, radius**2).G + 3 * p * radius**2
    may: BoolArray = np.hypot(xd[..., 0], xd[..., 1]) <= reach * (1 + 1e-9)
    return may


def radial_start(k: Array, target: Array, radius: Array) -> Array:
    """Position whose radial part alone has the target's radius; the field's edge where there is none."""

    def grow(r: Array, at: IntArray) -> tuple[Array, Array]:
        terms = radial(of(k, at), r * r)
        return r * terms.G, terms.G + 2 * r * r * terms.slope

    size = np.hypot(target[..., 0], target[..., 1])
    edge = radius * (1 - 1e-9)
    farthest, _ = grow(edge, np.arange(len(edge)))
    r = solve_increasing(grow, np.minimum(size, farthest), edge)
    ratio = np.divide(r, size, out=np.ones_like(size), where=size > 0)
    return target * ratio[..., None]


def newton(k: Array, target: Array, xn: Array, radius: Array) -> tuple[Array, BoolArray]:
    """Damped Newton iteration from ``xn``; the positions, and which of them are solutions in the field."""
    tolerance = np.finfo(np.float64).eps * np.hypot(target[..., 0], target[..., 1])
    damping = np.ones(tolerance.shape)
    error, size, J = _image(k, xn, target)
    xn = xn.copy()
    for _ in range(ITERATIONS):
        # go on to the last rounding, but give up soon where only roundings are left
        least = np.where(size <= ROUNDINGS * tolerance, 0.9, 1e-6)
        at = np.flatnonzero((size > tolerance) & (damping > least))
        if len(at) == 0:
            break
        ahead = xn[at] - damping[at, None] * _solve_2x2(J[at], error[at])
        stays = np.hypot(ahead[:, 0], ahead[:, 1]) < radius[at]
        ahead = np.where(stays[:, None], ahead, xn[at])
        new_error, new_size, new_J = _image(of(k, at), ahead, target[at])
        better = stays & (new_size < size[at])
        damping[at] = np.where(better, 1.0, damping[at] / 2)
        at = at[better]
        xn[at], error[at], size[at], J[at] = ahead[better], new_error[better], new_size[better], new_J[better]
    inside = np.hypot(xn[..., 0], xn[..., 1]) < radius
    return xn, inside & (size <= ROUNDINGS * tolerance)


def _image(k: Array, xn: Array, target: Array) -> tuple[Array, Array, Array]:
    """Distance of the image of xn from the target, its size, and the Jacobian of the image."""
    q = (xn * xn).sum(-1)
    terms = radial(k, q)
    _, _, p = coefficients(k)
    error = xn * terms.G[..., None] + tangential(p, xn, q) - target
    return error, np.hypot(error[..., 0], error[..., 1]), plane_jacobian(terms, p, xn)


def _solve_2x2(J: Array, b: Array) -> Array:
    """J^-1 b by Cramer's rule; zero where J is singular."""
    determinant = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
    safe = np.where(determinant == 0.0, 1.0, determinant)
    x = (J[..., 1, 1] * b[..., 0] - J[..., 0, 1] * b[..., 1]) / safe
    y = (J[..., 0, 0] * b[..., 1] - J[..., 1, 0] * b[..., 0]) / safe
    return np.where(determinant[..., None] == 0.0, 0.0, np.stack([x, y], -1))

r"""The scalar functions behind every exponential of a rotation, exact to rounding for all angles.

Everything in this room is built from six functions of :math:`q = \theta^2`,

.. math:: c_k(q) = \sum_{n \ge 0} \frac{(-q)^n}{(2n + k)!}, \qquad k = 0 \ldots 5,

that is cos, sin / theta, (1 - cos) / theta^2, (theta - sin) / theta^3 and so on.  They obey
:math:`c_k = 1/k! - q\, c_{k+2}`: upwards this divides by q, which is good for large q; downwards it
multiplies, which is good for small q.  Nothing depends on the sign of theta.
"""

from __future__ import annotations

from math import factorial

import numpy as np

from vslam_ref.arrays import Array

SMALL = 1.0
"""Below this angle (radians), or length of (sigma, theta), the series are used.

At 1 the closed forms have lost less than one digit of what is multiplied by them; the series need eight
terms.
"""

LOST = 1e4 * float(np.finfo(np.float64).eps)
"""Length of an eigenvalue, relative to the largest, up to which its inverse has fewer than four digits."""

_TERMS = 8  # the first one left out is q^8 4! / 20! < 1e-17 of the sum
_INVERSE_FACTORIAL = tuple(1.0 / factorial(k) for k in range(2 * _TERMS + 4))
_POWERS = 19  # the first one left out is 190 / 21! < 4e-18, in C at theta = 0, sigma = 1


def rotation_coefficients(theta2: Array) -> Array:
    """c_0 ... c_5 of squared angles, rad^2, shape (...) -> (6, ...)."""
    small = theta2 < SMALL**2
    if small.all():
        return _by_series(theta2)
    large = _closed(np.where(small, 1.0, theta2))
    return np.where(small, _by_series(np.where(small, theta2, 0.0)), large) if small.any() else large


def _by_series(q: Array) -> Array:
    """Two series at the top, then downwards."""
    c = np.empty((6, *q.shape))
    for k in (5, 4):
        total = np.zeros_like(q)
        for n in range(_TERMS - 1, -1, -1):
            total = _INVERSE_FACTORIAL[2 * n + k] - q * total
        c[k] = total
    # eq-coefficients
    for k in (3, 2, 1, 0):
        c[k] = _INVERSE_FACTORIAL[k] - q * c[k + 2]
    return c


def _closed(q: Array) -> Array:
    """Closed forms at the bottom, then upwards; 1 - cos = 2 sin^2(theta / 2) loses nothing."""
    theta = np.sqrt(q)
    c = [np.cos(theta), np.sin(theta) / theta, 2.0 * np.sin(theta / 2) ** 2 / q]
    for k in (1, 2, 3):
        c.append((_INVERSE_FACTORIAL[k] - c[k]) / q)
    return np.stack(c)


def expm1_over(x: Array) -> Array:
    """(e^x - 1) / x, equal to 1 at 0; shape (...), no unit."""
    zero = x == 0.0
    return np.where(zero, 1.0, np.expm1(x) / np.where(zero, 1.0, x))


def similarity_coefficients(sigma: Array, theta2: Array) -> tuple[Array, Array, Array]:
    r"""A, B, C of W = A I + B Phi + C Phi^2, the sum of (sigma I + Phi)^n / (n + 1)!.

    Parameters
    ----------
    sigma, theta2 : ndarray, shape (...)
        Log-scale, and squared angle (rad^2), the squared length of the vector behind Phi.

    Returns
    -------
    tuple of ndarray, shape (...)

    Notes
    -----
    Far from the origin, with :math:`\kappa = \sigma^2 + \theta^2 \ge 1`,

    .. math::
        A = \frac{e^\sigma - 1}{\sigma}, \quad
        B = \frac{\sigma(e^\sigma c_1 - A c_0) + \theta^2 c_2}{\kappa}, \quad
        C = \frac{\sigma e^\sigma c_2 + A - e^\sigma c_1}{\kappa} .

    The only denominators are sigma (in A, by ``expm1``) and kappa, so theta may vanish while sigma does
    not, and the other way round.  Where both are small the powers of sigma I + Phi are summed in the basis
    I, Phi, Phi^2.
    """
    sigma, theta2 = np.broadcast_arrays(sigma, theta2)
    A = expm1_over(sigma)
    c = rotation_coefficients(theta2)
    kappa = sigma * sigma + theta2
    small = kappa < SMALL**2
    k = np.where(small, 1.0, kappa)
    e = np.exp(sigma)
    # eq-w-matrix
    B = (sigma * (e * c[1] - A * c[0]) + theta2 * c[2]) / k
    C = (sigma * e * c[2] + A - e * c[1]) / k
    B_small, C_small = _power_sums(np.where(small, sigma, 0.0), np.where(small, theta2, 0.0))
    return A, np.where(small, B_small, B), np.where(small, C_small, C)


def _power_sums(sigma: Array, theta2: Array) -> tuple[Array, Array]:
    """B and C by powers: (sigma I + Phi)^n = a I + b Phi + c Phi^2, and Phi^3 = -theta^2 Phi."""
    a, b, c = np.ones_like(sigma), np.zeros_like(sigma), np.zeros_like(sigma)
    B, C = np.zeros_like(sigma), np.zeros_like(sigma)
    for n in range(1, _POWERS + 1):
        # eq-cube
        a, b, c = sigma * a, a + sigma * b - theta2 * c, b + sigma * c
        B, C = B + b / factorial(n + 1), C + c / factorial(n + 1)
    return B, C


def inverse_coefficients(A: Array, B: Array, C: Array, theta2: Array) -> tuple[Array, Array, Array]:
    """Coefficients of (A I + B Phi + C Phi^2)^-1 in the same basis.

    ``A (...)``, ``B (...)``, ``C (...)``; ``theta2 (...)`` in rad^2.

    The matrix has the eigenvalues A and A - theta^2 C +- i theta B; D is the squared length of the latter.

    Raises
    ------
    ValueError
        Where D is so small that fewer than four digits are left: at a multiple of 2 pi, or less than 2e-12
        of the angle from it, if there is no scale.

    Notes
    -----
    For A = 1 the length of the latter is 2 sin(theta / 2) / theta, and p is found by taking numbers near 1
    from each other, which leaves an error of eps (and the angle itself is not known better).  So the
    inverse, 1 over that length, keeps four digits while the length is more than 1e4 eps.
    """
    p = A - theta2 * C
    D = p * p + theta2 * B * B
    require_no_pole(D, A, theta2)
    return 1.0 / A, -B / D, (B * B - C * p) / (A * D)


def require_no_pole(D: Array, A: Array, theta2: Array) -> None:
    """Raise ValueError where a squared eigenvalue ``D (...)`` has lost its digits beside ``A (...)``.

    ``theta2 (...)`` in rad^2, for the message.
    """
    poles = D <= (LOST * A) ** 2
    if poles.any():
        angle = float(np.sqrt(np.broadcast_to(theta2, poles.shape)[poles].flat[0]))
        off = angle - 2.0 * np.pi * round(angle / (2.0 * np.pi))
        raise ValueError(
            f"the left Jacobian has no inverse at multiples of 2 pi: the angle {angle!r} rad "
            f"is {off:.1g} rad off one"
        )


def rotation_polynomial(a: Array, b: Array, c: Array, Phi: Array) -> Array:
    """Sum a I + b Phi + c Phi^2 of ``a (...)``, ``b (...)``, ``c (...)`` and ``Phi (..., 3, 3)``."""
    M: Array = b[..., None, None] * Phi + c[..., None, None] * (Phi @ Phi)
    for i in range(3):
        M[..., i, i] += a
    return M

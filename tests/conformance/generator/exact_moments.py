"""Exact moments of products of Gaussian numbers and of sine and cosine of a Gaussian angle.

E[x^p y^q exp(i k theta)] is a derivative of the moment generating function at zero: computer algebra
differentiates, nothing is derived by hand.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import sympy
from mpmath import mpf

from generator.exact_arrays import Big, stack

A, B, S, C, E = sympy.symbols("a b s c e")
"""Two numbers, sine, cosine, and exp(i theta)."""
MEAN = sympy.symbols("m0 m1 m2")
COV = sympy.symbols("k00 k01 k02 k11 k12 k22")

POSE = (A, B, S, C)
LIFT = (A, B, S, C, S * S, C * C, A * S, A * C, B * S, B * C, S * C)
MONOMIALS = (A, S, C, S * S, S * C, C * C, A * S, A * C)
"""u1, u2, u3, u2 u2, u2 u3, u3 u3, u1 u2, u1 u3 of the control."""


@functools.cache
def _mean(p: int, q: int, k: int) -> Any:
    """E[a^p b^q e^k] as an expression of means and covariances."""
    t, u = sympy.symbols("t u")
    way = (t, u, sympy.I * k)
    K = sympy.Matrix(3, 3, lambda i, j: COV[[[0, 1, 2], [1, 3, 4], [2, 4, 5]][i][j]])
    v = sympy.Matrix(way)
    exponent = sum(m * w for m, w in zip(MEAN, way, strict=True)) + (v.T * K * v)[0] / 2
    generating = sympy.exp(exponent)
    for symbol, times in ((t, p), (u, q)):
        generating = generating.diff(symbol, times) if times else generating
    return generating.subs({t: 0, u: 0})


def _expected(expression: Any) -> Any:
    """Expectation of a polynomial in a, b, sine and cosine."""
    waves = {S: (E - 1 / E) / (2 * sympy.I), C: (E + 1 / E) / 2}
    shifted = sympy.expand(expression.subs(waves) * E**8)
    terms = sympy.Poly(shifted, A, B, E).terms()
    return sum(factor * _mean(p, q, k - 8) for (p, q, k), factor in terms)


@functools.cache
def _functions(which: Sequence[Any]) -> tuple[Callable[..., Any], Callable[..., Any]]:
    means = [_expected(f) for f in which]
    products = [_expected(f * g) for i, f in enumerate(which) for g in which[: i + 1]]
    of_means, of_products = (sympy.lambdify([*MEAN, *COV], v, "mpmath") for v in (means, products))
    return of_means, of_products


def moments(which: Sequence[Any], mean: Big, cov: Big) -> tuple[Big, Big]:
    """Mean and covariance of polynomials of a Gaussian (a, b, theta).

    Parameters
    ----------
    which : tuple
        Polynomials, as :data:`LIFT`.
    mean, cov : arrays, shapes (3,) and (3, 3)
    """
    of_means, of_products = _functions(tuple(which))
    numbers = [*mean, *(cov[i, j] for i in range(3) for j in range(i, 3))]
    first = stack([mpf(v.real) for v in of_means(*numbers)])
    second = np.empty((len(which), len(which)), dtype=object)
    values = iter(of_products(*numbers))
    for i in range(len(which)):
        for j in range(i + 1):
            second[i, j] = second[j, i] = next(values).real - first[i] * first[j]
    return first, second

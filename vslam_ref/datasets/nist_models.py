"""Model functions of NIST's nonlinear regressions, with Jacobians written out.

NIST publishes data, two starting points and parameters certified to eleven digits.  A model maps
parameters b (n,) and predictors x (m,), or (m, 2), to values (m,) and their Jacobian (m, n).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array


class ValueJacobian(NamedTuple):
    """Values (m,) and their Jacobian (m, n) with respect to the parameters."""

    value: Array
    jacobian: Array


Model = Callable[[Array, Array], ValueJacobian]


def _of(value: Array, *columns: Array) -> ValueJacobian:
    return ValueJacobian(value, np.stack(np.broadcast_arrays(*columns), axis=-1))


def misra1a(b: Array, x: Array) -> ValueJacobian:
    """b1 (1 - exp(-b2 x))."""
    e = np.exp(-b[1] * x)
    return _of(b[0] * (1 - e), 1 - e, b[0] * x * e)


def misra1b(b: Array, x: Array) -> ValueJacobian:
    """b1 (1 - (1 + b2 x/2)^-2)."""
    s = 1 + b[1] * x / 2
    return _of(b[0] * (1 - s**-2), 1 - s**-2, b[0] * x * s**-3)


def misra1c(b: Array, x: Array) -> ValueJacobian:
    """b1 (1 - (1 + 2 b2 x)^-1/2)."""
    s = 1 + 2 * b[1] * x
    return _of(b[0] * (1 - s**-0.5), 1 - s**-0.5, b[0] * x * s**-1.5)


def misra1d(b: Array, x: Array) -> ValueJacobian:
    """b1 b2 x / (1 + b2 x)."""
    s = 1 + b[1] * x
    return _of(b[0] * b[1] * x / s, b[1] * x / s, b[0] * x / s**2)


def chwirut(b: Array, x: Array) -> ValueJacobian:
    """exp(-b1 x) / (b2 + b3 x)."""
    s = b[1] + b[2] * x
    f = np.exp(-b[0] * x) / s
    return _of(f, -x * f, -f / s, -x * f / s)


def danwood(b: Array, x: Array) -> ValueJacobian:
    """b1 x^b2."""
    p = x ** b[1]
    return _of(b[0] * p, p, b[0] * p * np.log(x))


def gauss(b: Array, x: Array) -> ValueJacobian:
    """b1 exp(-b2 x) + b3 exp(-((x - b4)/b5)²) + b6 exp(-((x - b7)/b8)²)."""
    e = np.exp(-b[1] * x)
    value, columns = b[0] * e, [e, -b[0] * x * e]
    for height, middle, width in (b[2:5], b[5:8]):
        t = (x - middle) / width
        g = np.exp(-t * t)
        value = value + height * g
        columns += [g, height * g * 2 * t / width, height * g * 2 * t * t / width]
    return _of(value, *columns)


def rational(b: Array, x: Array) -> ValueJacobian:
    """Two polynomials of one degree: (b1 + b2 x + …) / (1 + b_k x + …), n odd."""
    top = (len(b) + 1) // 2
    powers = [x**k for k in range(top)]
    numerator = sum(c * p for c, p in zip(b[:top], powers, strict=True))
    denominator = 1 + sum(c * p for c, p in zip(b[top:], powers[1:], strict=True))
    f = numerator / denominator
    return _of(f, *[p / denominator for p in powers], *[-f * p / denominator for p in powers[1:]])


def lanczos(b: Array, x: Array) -> ValueJacobian:
    """Sum of three exponentials b1 exp(-b2 x)."""
    e = [np.exp(-rate * x) for rate in b[1::2]]
    value = sum(a * f for a, f in zip(b[::2], e, strict=True))
    columns = [c for a, f in zip(b[::2], e, strict=True) for c in (f, -a * x * f)]
    return _of(np.asarray(value), *columns)


def mgh17(b: Array, x: Array) -> ValueJacobian:
    """b1 + b2 exp(-b4 x) + b3 exp(-b5 x)."""
    e, f = np.exp(-b[3] * x), np.exp(-b[4] * x)
    return _of(b[0] + b[1] * e + b[2] * f, np.ones_like(x), e, f, -b[1] * x * e, -b[2] * x * f)


def nelson(b: Array, x: Array) -> ValueJacobian:
    """b1 - b2 x1 exp(-b3 x2), the model of log(y)."""
    e = x[:, 0] * np.exp(-b[2] * x[:, 1])
    return _of(b[0] - b[1] * e, np.ones(len(x)), -e, b[1] * x[:, 1] * e)


MODELS: dict[str, Model] = {
    "Chwirut1": chwirut,
    "Chwirut2": chwirut,
    "DanWood": danwood,
    "Gauss1": gauss,
    "Gauss2": gauss,
    "Hahn1": rational,
    "Kirby2": rational,
    "Lanczos1": lanczos,
    "Lanczos3": lanczos,
    "MGH17": mgh17,
    "Misra1a": misra1a,
    "Misra1b": misra1b,
    "Misra1c": misra1c,
    "Misra1d": misra1d,
    "Nelson": nelson,
}
"""By NIST's name of the data set.  Nelson's responses are logarithms: fit log(y)."""

"""Checks that a user of this package, or of any other, can put into a test.

============================  =====================================================================
function                      fails when
============================  =====================================================================
:func:`check_jacobian`        a Jacobian is not the derivative of its function
:func:`assert_consistent`     the mean NEES of honest runs would be so small or so large too rarely
:func:`assert_group_axioms`   a module of group functions is not a group of matrices
============================  =====================================================================

Tolerances are derived from rounding errors or from a stated false-alarm rate.  All three raise
``AssertionError`` with the worst case in words, and return what they measured.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.metrics.consistency.bands import mean_band

Difference = Callable[[Array, Array], Array]
Derivative = tuple[Array, Array, str]  # numeric Jacobian, tolerance of each entry, method

EPS = float(np.finfo(np.float64).eps)
_STEP = EPS ** (1 / 7)
"""Step of the sixth-order difference: truncation (step^6) and rounding (eps / step) are then alike."""


class JacobianCheck(NamedTuple):
    """What a comparison found.

    Attributes
    ----------
    numeric : ndarray, shape (m, n)
        Numeric Jacobian, in the units of the function's value over those of its argument.
    tolerance : ndarray, shape (m, n)
        What each entry may differ by.
    worst : float
        Largest error over tolerance.
    method : str
        Complex step or central differences.
    """

    numeric: Array
    tolerance: Array
    worst: float
    method: str


def check_jacobian(
    function: Callable[[Array], Any],
    at: ArrayLike,
    jacobian: ArrayLike,
    *,
    method: str = "auto",
    roundings: int = 100,
    difference: Difference | None = None,
) -> JacobianCheck:
    r"""Compare a Jacobian with a numeric derivative.

    Parameters
    ----------
    function : callable
        Maps an array of shape (n,) to one of shape (m,).
    at : array_like, shape (n,)
        Where to differentiate, in any unit.  Choose it away from identity and zeros, where mistakes hide.
    jacobian : array_like, shape (m, n)
        What is to be checked: column j is the derivative in ``at[j]``.
    method : {"auto", "complex", "central"}
        Complex step, where the function takes complex arrays and keeps them complex; else central
        differences.  ``auto`` tries the first.
    roundings : int
        How many rounding errors one evaluation may gather.
    difference : callable, optional
        Difference of two values (m,) for outputs that are not vectors, such as angles: ``difference(a, b)``
        is the small vector from b to a.  Central differences only.

    Returns
    -------
    JacobianCheck

    Raises
    ------
    AssertionError
        If an entry is off by more than its tolerance, or if no useful tolerance can be given (the
        function is not smooth here, or far too large for its slope).
    ValueError
        If shapes do not fit.

    Notes
    -----
    *Complex step:* :math:`J_j = \mathrm{Im} f(x + i h e_j) / h` with h = 1e-100 has no truncation and no
    cancellation; the tolerance is ``roundings`` eps times the largest entry.

    *Central differences:* D(h), D(h/2), D(h/4), extrapolated twice, are exact up to h^6.  The tolerance is
    what the last extrapolation changed, more than the error left, plus the rounding of the values over
    the smallest step, 4 ``roundings`` eps (max|f| + max |J| |x|) / h.

    Examples
    --------
    >>> check_jacobian(lambda x: [x[0] * x[1], x[0] ** 2], [2.0, 3.0], [[3.0, 2.0], [4.0, 0.0]]).method
    'complex'
    >>> check_jacobian(lambda x: x**2, [2.0], [[5.0]])
    Traceback (most recent call last):
    AssertionError: Jacobian entry [0, 0] is 5, numerically 4 (tolerance 8.88e-14, complex)
    """
    x, J = np.asarray(at, dtype=np.float64), np.asarray(jacobian, dtype=np.float64)
    if x.ndim != 1 or J.ndim != 2 or J.shape[1] != len(x):
        raise ValueError(f"point {x.shape} and Jacobian {J.shape}: need (n,) and (m, n)")
    if method not in ("auto", "complex", "central"):
        raise ValueError(f"method={method!r}: must be 'auto', 'complex' or 'central'")
    found = None
    if method != "central" and difference is None:
        found = _complex_step(function, x, roundings)
    if found is None and method == "complex":
        raise ValueError("method='complex': the function does not keep complex arrays complex")
    numeric, tolerance, used = found if found is not None else _central(function, x, roundings, difference)
    if numeric.shape != J.shape:
        raise ValueError(f"Jacobian {J.shape}: the function of {len(x)} numbers returns {len(numeric)}")
    if not tolerance.max() <= 1e-6 * max(np.abs(numeric).max(), np.abs(J).max(), EPS):
        raise AssertionError(f"no sharp numeric derivative here: its own error may be {tolerance.max():.3g}")
    ratio = np.abs(J - numeric) / tolerance
    if not ratio.max() <= 1.0:  # also when NaN
        i, j = np.unravel_index(int(np.argmax(np.where(np.isnan(ratio), np.inf, ratio))), ratio.shape)
        raise AssertionError(
            f"Jacobian entry [{i}, {j}] is {J[i, j]:.17g}, numerically {numeric[i, j]:.17g} "
            f"(tolerance {tolerance[i, j]:.3g}, {used})"
        )
    return JacobianCheck(numeric, tolerance, float(ratio.max()), used)


def _complex_step(function: Callable[[Array], Any], x: Array, roundings: int) -> Derivative | None:
    """Numeric Jacobian by complex step, or None when the function does not carry complex numbers."""
    h = 1e-100
    columns = []
    for j in range(len(x)):
        point = x.astype(np.complex128)
        point[j] += 1j * h
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                value = np.asarray(function(point))  # type: ignore[arg-type]
        except (TypeError, np.exceptions.ComplexWarning):
            return None
        if not np.iscomplexobj(value) and len(x) > 0:
            return None
        columns.append(value.imag / h)
    numeric = np.stack(columns, -1)
    return numeric, np.full(numeric.shape, roundings * EPS * max(np.abs(numeric).max(), EPS)), "complex"


def _central(
    function: Callable[[Array], Any], x: Array, roundings: int, difference: Difference | None
) -> Derivative:
    """Numeric Jacobian by central differences at h, h/2, h/4, extrapolated twice, and its tolerance."""
    subtract = difference if difference is not None else np.subtract
    steps = _STEP * np.maximum(1.0, np.abs(x))
    columns, truncation, size = [], [], 0.0
    for j, h in enumerate(steps):
        slopes = []
        for step in (h, h / 2, h / 4):
            ahead, behind = x.copy(), x.copy()
            ahead[j] += step
            behind[j] -= step
            f_ahead, f_behind = np.asarray(function(ahead), float), np.asarray(function(behind), float)
            size = max(size, np.abs(f_ahead).max(), np.abs(f_behind).max())
            # eq-difference-quotient
            slopes.append(subtract(f_ahead, f_behind) / (ahead[j] - behind[j]))
        once = [(4 * slopes[1] - slopes[0]) / 3, (4 * slopes[2] - slopes[1]) / 3]
        columns.append((16 * once[1] - once[0]) / 15)
        truncation.append(np.abs(columns[-1] - once[1]))
    numeric = np.stack(columns, -1)
    size += float((np.abs(numeric) @ np.abs(x)).max())
    return numeric, np.stack(truncation, -1) + 4 * roundings * EPS * size / steps, "central"


class ConsistencyCheck(NamedTuple):
    """Mean of the runs and the band it had to lie in; NEES is dimensionless."""

    mean: float
    lower: float
    upper: float


def assert_consistent(nees: ArrayLike, dof: int, *, false_alarm: float = 1e-3) -> ConsistencyCheck:
    r"""Fail when the mean NEES of M independent runs lies outside its two-sided band.

    For a consistent filter the sum of M values :math:`e^T P^{-1} e` is chi-squared with M ``dof`` degrees of
    freedom.  The band leaves out ``false_alarm`` / 2 on either side: too small is a failure as well.

    Parameters
    ----------
    nees : array_like, shape (M,)
        One value per independent run, all at *one* time chosen beforehand.
    dof : int
        Degrees of freedom of one value: the length of the error.
    false_alarm : float
        Probability that a perfect filter fails, in (0, 1).

    Returns
    -------
    ConsistencyCheck

    Raises
    ------
    AssertionError
        Outside the band, or a value that is not finite.
    ValueError
        If ``nees`` is not (M,) with M >= 1: points in time are not independent runs.

    Examples
    --------
    >>> errors = np.random.default_rng(1).standard_normal((200, 3))
    >>> assert_consistent(np.sum(errors**2, axis=1), dof=3).mean > 2.5
    True
    >>> assert_consistent(1.5 * np.sum(errors**2, axis=1), dof=3)
    Traceback (most recent call last):
    AssertionError: mean NEES 4.06 of 200 runs lies outside [2.463, 3.603] (3 dof, false alarms 0.001)
    """
    values = np.asarray(nees, dtype=np.float64)
    if values.ndim != 1 or values.size == 0:
        raise ValueError(f"nees {values.shape}: need (M,), one value per independent run")
    if not 0.0 < false_alarm < 1.0:
        raise ValueError(f"false_alarm={false_alarm!r}: must lie between 0 and 1")
    if not np.isfinite(values).all():
        bad = np.count_nonzero(~np.isfinite(values))
        raise AssertionError(f"{bad} of {values.size} NEES values are not finite")
    lower, upper = mean_band(values.size, dof, 1.0 - false_alarm)
    mean = float(values.mean())
    if not lower <= mean <= upper:
        raise AssertionError(
            f"mean NEES {mean:.4g} of {values.size} runs lies outside [{lower:.4g}, {upper:.4g}] "
            f"({dof} dof, false alarms {false_alarm:g})"
        )
    return ConsistencyCheck(mean, lower, upper)


def assert_group_axioms(group: Any, samples: ArrayLike, *, roundings: int = 64) -> float:
    r"""Fail when a module of functions on group elements is not a group of matrices.

    The module must have ``identity``, ``compose``, ``inverse`` and ``matrix``; ``exp`` and ``log``, and
    ``adjoint``, are checked where they exist.  Everything is compared as matrices, where the
    product is NumPy's: an error in ``compose`` cannot hide behind itself.

    ====================  ================================================
    checked               for all samples a, b
    ====================  ================================================
    identity              M(e) = I
    homomorphism          M(a b) = M(a) M(b), hence associativity
    inverse               M(a^-1) M(a) = I = M(a) M(a^-1)
    exp after log         M(Exp(Log a)) = M(a)
    adjoint               M(a) M(Exp xi) = M(Exp(Ad_a xi)) M(a), xi = Log b
    ====================  ================================================

    Parameters
    ----------
    group : module or object
        For example :mod:`vslam_ref.geometry.se2`.
    samples : array_like, shape (N, ...)
        Elements, of any unit: near the identity, generic, near every angle where a branch changes.
    roundings : int
        How many rounding errors one product of matrices may gather.

    Returns
    -------
    float
        The largest error over its tolerance, ``roundings`` eps times the sizes of the factors.

    Examples
    --------
    >>> from vslam_ref.geometry import se2
    >>> assert_group_axioms(se2, [[1.0, 2.0, 0.5], [-3.0, 0.1, 3.0]]) <= 1
    True
    """
    samples = np.asarray(samples, dtype=np.float64)
    a = np.repeat(samples, len(samples), axis=0)
    b = np.tile(samples, (len(samples),) + (1,) * (samples.ndim - 1))
    A, B = group.matrix(a), group.matrix(b)
    one = np.broadcast_to(np.eye(A.shape[-1]), A.shape)
    inverse = group.matrix(group.inverse(a))
    worst = [
        _off("identity", group.matrix(group.identity(a.shape[:1])), one, one, one, roundings),
        _off("homomorphism", group.matrix(group.compose(a, b)), A @ B, A, B, roundings),
        _off("left inverse", inverse @ A, one, inverse, A, roundings),
        _off("right inverse", A @ inverse, one, A, inverse, roundings),
    ]
    if hasattr(group, "exp") and hasattr(group, "log"):
        xi = group.log(b)
        worst.append(_off("exp after log", group.matrix(group.exp(xi)), B, B, one, roundings))
        if hasattr(group, "adjoint"):
            turned = np.einsum("...ij,...j->...i", group.adjoint(a), xi)
            E = group.matrix(group.exp(turned))
            worst.append(_off("adjoint", A @ B, E @ A, E, A, roundings))
    return max(worst)


def _off(name: str, left: Array, right: Array, factor: Array, other: Array, roundings: int) -> float:
    """Largest |left - right| over its tolerance; fail above 1."""
    size = np.linalg.norm(factor, axis=(-2, -1)) * np.linalg.norm(other, axis=(-2, -1))
    ratio = np.abs(left - right).max(axis=(-2, -1)) / (roundings * EPS * size)
    worst = int(np.argmax(np.where(np.isnan(ratio), np.inf, ratio)))
    if not ratio[worst] <= 1.0:
        raise AssertionError(
            f"{name} fails for pair {worst}: off by {np.abs(left - right)[worst].max():.3g}, "
            f"{ratio[worst]:.3g} times the tolerance"
        )
    return float(ratio[worst])

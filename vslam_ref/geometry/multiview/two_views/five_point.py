r"""Five pairs: every essential matrix that fits them, for many samples at once.

Five rows :math:`x_b \otimes x_a` leave a four-dimensional null space,
:math:`E = x X + y Y + z Z + w W`, and a matrix is essential if and only if

.. math:: 2 E E^T E - \operatorname{tr}(E E^T) E = 0, \qquad \det E = 0 .

With w = 1 these are ten polynomials of degree three in x, y, z, with twenty monomials: ten of degree three
and ten below.  Gauss-Jordan elimination writes every monomial of degree three by the ten below,
:math:`m_3 = -B\, m_2`.  So does multiplication by x: :math:`x\, m_2 = M m_2`, where six rows of M are rows of
-B and four pick the product out of :math:`m_2` itself.  At a solution x is therefore an *eigenvalue* of M
and :math:`m_2` its eigenvector: ten solutions, complex ones among them, without one long polynomial.

Two Newton steps on the ten equations restore the last digits of each real one.
"""

from __future__ import annotations

from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, transpose
from vslam_ref.geometry.multiview.two_views._pairs import checked_pairs
from vslam_ref.geometry.multiview.two_views.eight_point import epipolar_rows

REAL = 1e-5
"""Imaginary part, relative to the eigenvalue's size, that may be the rounding of a double root."""
SOLVED = 1e-9
"""Largest error in the ten equations of a solution, for matrices of norm 1."""
RANK = 1e-9
"""Smallest over largest singular value of the five rows below which two pairs say the same."""
STEPS = 3
_LINEAR = ((1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0))
_BELOW = ((2, 0, 0), (1, 1, 0), (0, 2, 0), (1, 0, 1), (0, 1, 1), (0, 0, 2), *_LINEAR)
_THIRD = ((3, 0, 0), (2, 1, 0), (1, 2, 0), (0, 3, 0), (2, 0, 1), (1, 1, 1), (0, 2, 1), (1, 0, 2), (0, 1, 2))
_ALL = (*_THIRD, (0, 0, 3), *_BELOW)
"""Exponents of x, y, z: the ten monomials of degree three, then the ten below, the basis of M."""


class FivePointEssentials(NamedTuple):
    """Up to ten essential matrices of each of S samples.

    Attributes
    ----------
    E : ndarray, shape (S, 10, 3, 3)
        Norm sqrt(2), so that the singular values are 1, 1, 0; zero where not ``valid``.
    valid : ndarray of bool, shape (S, 10)
        Which of them are real solutions.
    rank : ndarray, shape (S,)
        Smallest over largest singular value of the five equations, a ratio; where it is below ``RANK``
        nothing is valid: two pairs are the same.
    """

    E: Array
    valid: BoolArray
    rank: Array


def five_point_essentials(xn_a: ArrayLike, xn_b: ArrayLike) -> FivePointEssentials:
    """All real essential matrices of samples of five pairs.

    Implements :eq:`eq-action-matrix`.

    Parameters
    ----------
    xn_a, xn_b : array_like, shape (S, 5, 2)
        Normalised image positions: five points of each sample, in both pictures.

    Returns
    -------
    FivePointEssentials

    Raises
    ------
    ValueError
        If shapes differ from (S, 5, 2), or a number is not finite.

    Notes
    -----
    The pairs must be normalised with the known intrinsics of the camera: five pairs say nothing about those.
    Points of a plane are no special case.

    Examples
    --------
    >>> X = np.array([[0, 0, 4], [1, 0, 5], [0, 2, 6], [-1, 1, 5], [1, 1, 7.0]])
    >>> Y = X + [-1.0, 0, 0]  # camera b stands one to the right
    >>> found = five_point_essentials([X[:, :2] / X[:, 2:]], [Y[:, :2] / Y[:, 2:]])
    >>> E = found.E[found.valid]
    >>> truth = np.array([[0, 0, 0], [0, 0, -1], [0, 1, 0.0]])
    >>> bool((np.abs(np.abs(np.sum(E * truth, axis=(1, 2))) - 2) < 1e-9).any())
    True
    """
    a, b = checked_pairs(xn_a, xn_b, 5, exact=True)
    if a.ndim != 3:
        raise ValueError(f"xn_a has shape {a.shape}: need (S, 5, 2)")
    if len(a) == 0:
        return FivePointEssentials(np.zeros((0, 10, 3, 3)), np.zeros((0, 10), dtype=bool), np.zeros(0))
    _, s, Vt = np.linalg.svd(epipolar_rows(a, b), full_matrices=True)
    rank = s[:, 4] / s[:, 0]
    basis = (_TURN @ Vt[:, 5:]).reshape(-1, 4, 3, 3)
    M, solvable = action_matrix(basis)
    values, vectors = np.linalg.eig(M)
    size = 1.0 + np.abs(values)
    real = (np.abs(values.imag) <= REAL * size) & (solvable & (rank > RANK))[:, None]
    w = np.real(np.swapaxes(vectors * _phase(vectors), 1, 2)[..., 6:])  # (S, 10, 4), up to size
    length = np.linalg.norm(w, axis=-1)
    real &= length > 0
    sample, place = np.nonzero(real)
    E, left = _polished(w[sample, place] / length[sample, place, None], basis[sample])
    all_E, valid = np.zeros((*real.shape, 3, 3)), np.zeros_like(real)
    valid[sample, place] = left <= SOLVED
    all_E[sample, place] = np.sqrt(2.0) * np.where((left <= SOLVED)[:, None, None], E, 0.0)
    return FivePointEssentials(all_E, valid, rank)


def action_matrix(basis: Array) -> tuple[Array, BoolArray]:
    """Matrix M (S, 10, 10) of the multiplication by x, and whether it exists (S,).

    Implements :eq:`eq-action-matrix`: x m_2 = M m_2 for the monomials x2, xy, y2, xz, yz, z2, x, y, z, 1.
    ``basis (S, 4, 3, 3)`` spans the null space; no unit.
    """
    A = constraint_coefficients(basis)
    third, below = A[:, :, :10], A[:, :, 10:]
    solvable = np.abs(np.linalg.det(third)) > 0.0
    B = np.linalg.solve(np.where(solvable[:, None, None], third, np.eye(10)), below)
    M = np.zeros_like(B)
    M[:, :6] = -B[:, _TIMES_X]
    M[:, [6, 7, 8, 9], [0, 1, 3, 6]] = 1.0  # x x, x y, x z, x 1
    return M, solvable & np.isfinite(B).all(axis=(1, 2))


def constraint_coefficients(basis: Array) -> Array:
    """Ten polynomials (S, 10, 20) in x, y, z: nine of the trace condition, and the determinant.

    Implements :eq:`eq-essential-manifold`.  ``basis (S, 4, 3, 3)``: X, Y, Z, W; no unit.
    """
    E = np.moveaxis(basis, 1, -1)  # (S, 3, 3, 4): each entry a linear polynomial
    outer = np.einsum("sikp,sjkq->sijpq", E, E, optimize=True)
    EEt = outer.reshape(*outer.shape[:3], 16) @ _LINEAR_TIMES_LINEAR
    half = np.trace(EEt, axis1=1, axis2=2)[:, None, None] / 2
    L = EEt - np.eye(3)[None, :, :, None] * half
    cubic = np.einsum("sijm,sjkl->sikml", L, E, optimize=True)
    nine = cubic.reshape(len(basis), 9, 40) @ _BELOW_TIMES_LINEAR
    crossed = np.stack([_minor(E, 1, 2), _minor(E, 2, 0), _minor(E, 0, 1)], axis=1)
    det = np.einsum("sjm,sjl->sml", crossed, E[:, 0])
    return np.concatenate([nine, det.reshape(len(basis), 1, 40) @ _BELOW_TIMES_LINEAR], axis=1)


def _minor(E: Array, i: int, j: int) -> Array:
    """Quadratic polynomial E_1i E_2j - E_1j E_2i, (S, 10)."""
    product = E[:, 1, i, :, None] * E[:, 2, j, None, :] - E[:, 1, j, :, None] * E[:, 2, i, None, :]
    return np.asarray(product.reshape(len(E), 16) @ _LINEAR_TIMES_LINEAR)


def _phase(vectors: Array) -> Array:
    """Factors (S, 1, 10) that make the largest of x, y, z, 1 in each eigenvector real."""
    last = vectors[:, 6:]
    at = np.argmax(np.abs(last), axis=1)[:, None]
    largest = np.take_along_axis(last, at, axis=1)
    size = np.abs(largest)
    return np.asarray(np.conj(largest) / np.where(size > 0, size, 1.0))


def _polished(w: Array, basis: Array) -> tuple[Array, Array]:
    """Matrices (K, 3, 3) of norm 1 after Newton steps in w (K, 4), and their largest error (K,)."""
    for _ in range(STEPS):
        error, J = _equations(w, basis)
        normal = transpose(J) @ J + w[:, :, None] * w[:, None, :] + 1e-15 * np.eye(4)
        w = w - np.linalg.solve(normal, transpose(J) @ error[..., None])[..., 0]
        w = w / np.linalg.norm(w, axis=-1, keepdims=True)
    error, _ = _equations(w, basis)
    return np.einsum("kp,kpij->kij", w, basis), np.abs(error).max(axis=-1, initial=0.0)


def _equations(w: Array, basis: Array) -> tuple[Array, Array]:
    """Errors (K, 10) of 2 E E' E - tr(E E') E and det E, and their derivatives (K, 10, 4) in w."""
    E = np.einsum("kp,kpij->kij", w, basis)
    Et, trace = transpose(E), np.sum(E**2, axis=(1, 2))
    EEt, EtE = E @ Et, Et @ E
    adjugate = np.stack([np.cross(E[:, (i + 1) % 3], E[:, (i + 2) % 3]) for i in range(3)], axis=1)
    nine = 2.0 * EEt @ E - trace[:, None, None] * E
    det = np.sum(adjugate[:, 0] * E[:, 0], axis=-1)
    E1, Et1 = E[:, None], Et[:, None]
    d = 2.0 * (basis @ EtE[:, None] + E1 @ transpose(basis) @ E1 + E1 @ Et1 @ basis)
    d -= 2.0 * np.sum(E1 * basis, axis=(2, 3))[..., None, None] * E1 + trace[:, None, None, None] * basis
    d_det = np.sum(adjugate[:, None] * basis, axis=(2, 3))
    J = np.concatenate([d.reshape(len(w), 4, 9), d_det[..., None]], axis=-1)
    return np.concatenate([nine.reshape(len(w), 9), det[:, None]], axis=-1), transpose(J)


def _products(first: tuple[tuple[int, ...], ...], into: tuple[tuple[int, ...], ...]) -> Array:
    """Table (len(first) * 4, len(into)) that adds up the products of monomials with x, y, z, 1."""
    table = np.zeros((len(first), 4, len(into)))
    for i, p in enumerate(first):
        for j, q in enumerate(_LINEAR):
            table[i, j, into.index(tuple(m + n for m, n in zip(p, q, strict=True)))] = 1.0
    return table.reshape(-1, len(into))


_LINEAR_TIMES_LINEAR = _products(_LINEAR, _BELOW)
_BELOW_TIMES_LINEAR = _products(_BELOW, _ALL)
_TIMES_X = [_ALL.index((p + 1, q, r)) for p, q, r in _BELOW[:6]]
_TURN = np.linalg.qr(np.array([[p + 2.0 * q for q in range(4)] for p in range(4)]) ** 2 + np.eye(4))[0]
"""Turns the basis, so that no scene with symmetries has w = 0, or one x for two solutions."""
assert len({*combinations_with_replacement("xyz1", 3)}) == len(_ALL)

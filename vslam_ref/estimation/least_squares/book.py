"""Levenberg-Marquardt as the chapter derives it: full matrices, the text's letters, one loop.

::

    linearise        r, J at x                     what is measured, and how it changes with x
    weigh            W = diag w(r)                 1 for squares
    damped step      (J' W J + lambda D^2) delta = -J' W r
    gain             what the step won over what the model promised
    good: go there, damp less.   bad: stay, damp more.

It solves the normal equations, which lose twice the digits of J's condition; the fast form solves the same
problem by QR.  A test asserts that both take the same steps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.robust import L2, Loss


class BookFit(NamedTuple):
    """Where it ended, x (n,), and the cost at the start and after every step that was tried."""

    x: Array
    costs: list[float]


def levenberg_marquardt(
    f: Callable[[Array], tuple[Array, Array]], x: Array, loss: Loss | None = None, iterations: int = 50
) -> BookFit:
    """Minimise sum rho(r_i(x)), half the sum of squares without a loss.

    Implements :eq:`eq-squares`.

    Parameters
    ----------
    f : callable
        Maps x (n,) to the residual r (m,), predicted minus measured, and its Jacobian J (m, n).
    x : ndarray, shape (n,)
        Start.
    loss : Loss, optional
        Of single residuals; half a square by default.
    iterations : int
        Steps to try at most.

    Returns
    -------
    BookFit
    """
    loss = loss or L2()
    r, J = f(x)  # eq-linearised
    F = float(loss.cost(r).sum())  # eq-m-estimator
    lam, nu, D, costs = 1e-3, 2.0, np.zeros(len(x)), [F]
    for _ in range(iterations):
        W = np.diag(loss.weight(r))  # eq-robust-weight
        A, g = J.T @ W @ J, J.T @ W @ r  # eq-normal, eq-irls
        lengths = np.sqrt(np.diag(A))
        cosines = np.abs(g) / np.where(lengths > 0, lengths * np.sqrt(r @ W @ r) + 1e-300, 1.0)
        if cosines.max() <= 1e-8:
            break
        D = np.maximum(D, np.where(lengths > 0, lengths, 1.0))  # the largest that each column has had
        delta = np.linalg.solve(A + lam * np.diag(D**2), -g)  # eq-damped, eq-reweighted
        promised = float(0.5 * delta @ A @ delta + lam * (D * delta) @ (D * delta))
        r_new, J_new = f(x + delta)
        F_new = float(loss.cost(r_new).sum())
        gain = (F - F_new) / promised  # eq-gain-ratio
        if gain > 1e-4:
            x, r, J, F = x + delta, r_new, J_new, F_new
            lam, nu = lam * max(1 / 3, 1 - (2 * min(gain, 1.0) - 1) ** 3), 2.0  # eq-nielsen
        else:
            lam, nu = lam * nu, 2.0 * nu
        costs.append(F)
    return BookFit(x, costs)

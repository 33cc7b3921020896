"""One cycle of the reduced filter on plain arrays: k predictions at once, then an update.

::

    x_p (B, 4)        x, y, sin, cos
    x_m (B, M)        rho of every landmark: b numbers each, rho first
    P_a (B, 8, 8)     covariance of the pose states and of the noise (Re A, Im A, Re g, Im g) still pending
    frame (B, 4)      complex: c and tau;  and what is pending: D and e with p <- p + D h, h <- e h

    reduced_predict   k controls at once: x_p, P_a and frame; no landmark is touched        O(k)
    reduced_apply     what is pending goes into the map: P_pm <- Phi P_pm + N_pg E, P_mm += E^T N_gg E
    reduced_update    the same, then a measurement                                          O(m n^2)

These work in place on a batch of B runs, as their names say.  The formulas are those at the head of
:mod:`vslam_ref.filters.carleman_ekf.reduced`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray, transpose
from vslam_ref.filters.block_covariance import (
    Expected,
    State,
    diagonal_blocks,
    kalman_update_in_place,
    map_columns,
)
from vslam_ref.filters.carleman_ekf.reduced_moments import control_first_order
from vslam_ref.filters.vehicle import Increment

Complex = NDArray[np.complex128]

_I = np.array([-1j, 1j, 1j, 1j])
"""What a noise in Im m does to p, i conj(h), A and g, over what one in Re m does."""


def _predict(x_p: Array, P_a: Array, frame: Complex, control: Array, cov: Array) -> None:
    """K controls from their moments; see :func:`reduced_predict_in_place`."""
    ds, m, t = control[..., 0], control[..., 1] + 1j * control[..., 2], control[..., 3] + 1j * control[..., 4]
    h = x_p[:, 3:] + 1j * x_p[:, 2:3]
    # after control j: c = turned c_0, tau_j = m_j tau_{j-1} + t_j, h_j = e h_0, p_j = p_0 + D h_0
    # eq-complex-filter, eq-reduced-filter: all controls at once
    turned = m.cumprod(1)
    c, tau = turned * frame[:, :1], turned * (frame[:, 1:2] + (t / turned).cumsum(1))
    e = turned.conj()
    e_before, tau_before = np.ones_like(e), np.empty_like(tau)
    e_before[:, 1:] = e[:, :-1]
    tau_before[:, :1], tau_before[:, 1:] = frame[:, 1:2], tau[:, :-1]
    D = (ds * e_before).cumsum(1)

    # what unit noises in ds, Re m, Im m, Re t, Im t of control j do to p, i conj(h) = sin + i cos, A and g;
    # to p and h as if at the start, so that the transition of all controls takes them to the end
    J = np.zeros((*m.shape, 4, 5), dtype=np.complex128)
    J[..., 0, 0], J[..., 0, 1] = e_before * h, -D * h / m.conj()
    J[..., 1, 1], J[..., 2, 1] = 1j * h.conj() / m, 1 / m
    J[..., 3, 1], J[..., 3, 3] = -tau_before / c, -1 / c
    J[..., 2], J[..., 4] = _I * J[..., 1], _I * J[..., 3]
    G = np.stack([J.real, J.imag], 3).reshape(*m.shape, 8, 5)

    phi = _transition(D[:, -1], e[:, -1])
    x_p[:] = (phi @ x_p[:, :, None])[:, :, 0]
    P_a += (G @ cov @ G.swapaxes(2, 3)).sum(1)
    P_a[:, :4] = phi @ P_a[:, :4]
    P_a[:, :, :4] = P_a[:, :, :4] @ phi.swapaxes(1, 2)
    frame[:, 0], frame[:, 1] = c[:, -1], tau[:, -1]
    frame[:, 2] += D[:, -1] * frame[:, 3]
    frame[:, 3] *= e[:, -1]


def _transition(D: Complex, e: Complex) -> Array:
    """Matrix (B, 4, 4) of p <- p + D h, h <- e h in (x, y, sin, cos)."""
    phi = np.zeros((len(D), 4, 4))
    phi[:, 0, 0] = phi[:, 1, 1] = 1.0
    phi[:, 0, 3], phi[:, 0, 2], phi[:, 1, 3], phi[:, 1, 2] = D.real, -D.imag, D.imag, D.real
    phi[:, 3, 3], phi[:, 3, 2], phi[:, 2, 3], phi[:, 2, 2] = e.real, -e.imag, e.imag, e.real
    return phi


@accelerated("reduced:reduced_predict_in_place")
def reduced_predict_in_place(x_p: Array, P_a: Array, frame: Complex, control: Array, cov: Array) -> None:
    """Predict k controls, one after the other, without touching a landmark.

    Implements :eq:`eq-b7`, :eq:`eq-b8`, :eq:`eq-b9`, :eq:`eq-b10` and :eq:`eq-b11` (B7-B11), chained: A is
    the matrix of p <- p + D h, h <- e h of all controls, and each control's noise is taken along.

    Parameters
    ----------
    x_p : ndarray, shape (B, 4)
        (x, y, sin, cos).
    P_a : ndarray, shape (B, 8, 8)
        Covariance of the pose states and of the noise (Re A, Im A, Re g, Im g) accumulated since the
        last measurement.
    frame : ndarray of complex, shape (B, 4)
        c and tau; and, since the last measurement, D and e with p <- p + D h, h <- e h.
    control, cov : ndarray, shapes (B, k, 5), (B, k, 5, 5)
        Moments of (ds, Re m, Im m, Re t, Im t) of each control; the noises of two controls are independent.
    """
    _predict(x_p, P_a, frame, control, cov)


@accelerated("reduced:reduced_predict_first_order_in_place")
def reduced_predict_first_order_in_place(
    x_p: Array, P_a: Array, frame: Complex, ds: Array, dalpha: Array, cov: Array
) -> None:
    """:func:`reduced_predict_in_place` with first-order moments of increments.

    ``ds (B, k)``, ``dalpha (B, k)``, ``cov (B, k, 2, 2)``: those of k increments, one after the other.
    """
    mean, noise = control_first_order(Increment(ds.ravel(), dalpha.ravel(), cov.reshape(-1, 2, 2)))
    _predict(x_p, P_a, frame, mean.reshape(*ds.shape, 5), noise.reshape(*ds.shape, 5, 5))


def _noise_rows(x_m: Array, b: int) -> Array:
    """E (B, 4, M): its columns for a landmark rho say d rho = A rho + g; other map states gain no noise."""
    E = np.zeros((len(x_m), 4, x_m.shape[1]))
    re, im = x_m[:, 0::b], x_m[:, 1::b]
    E[:, 0, 0::b], E[:, 1, 0::b], E[:, 2, 0::b] = re, -im, 1.0
    E[:, 0, 1::b], E[:, 1, 1::b], E[:, 3, 1::b] = im, re, 1.0
    return E


def _apply(state: State, b: int, P_a: Array, frame: Complex) -> None:
    """Body of :func:`reduced_apply_in_place`."""
    E, N_gg = _noise_rows(state.x_m, b), P_a[:, 4:, 4:].copy()
    state.P_pm[:] = _transition(frame[:, 2], frame[:, 3]) @ state.P_pm + P_a[:, :4, 4:] @ E  # eq-lazy-noise
    state.P_mm[:] += transpose(E) @ (N_gg @ E)
    P_a[:, 4:, :] = 0.0
    P_a[:, :, 4:] = 0.0
    frame[:, 2], frame[:, 3] = 0.0, 1.0


@accelerated("reduced:reduced_apply_in_place")
def reduced_apply_in_place(state: State, b: int, P_a: Array, frame: Complex) -> None:
    """Apply the accumulated transition and noise to the map blocks, and begin to accumulate afresh.

    Implements :eq:`eq-lazy-noise`: P_pm <- Phi P_pm + N_pg E and P_mm <- P_mm + E^T N_gg E, where Phi is the
    pose transition of D and e, and N_pg and N_gg are blocks of P_a.

    Parameters
    ----------
    state : State
        ``P_pm`` and ``P_mm`` are changed in place.
    b : int
        States per landmark, rho first.
    P_a, frame : ndarray
        As for :func:`reduced_predict_in_place`; changed in place.
    """
    _apply(state, b, P_a, frame)


@accelerated("reduced:reduced_update_in_place")
def reduced_update_in_place(
    state: State,
    b: int,
    P_a: Array,
    frame: Complex,
    columns: IntArray,
    z: Array,
    cov_z: Array,
    gate: float,
) -> tuple[Array, Array]:
    """:func:`reduced_apply_in_place`, then use z = c rho - tau + noise of m landmarks.

    Implements the reduced :eq:`eq-b22` (B22) and :eq:`eq-gain`.

    Parameters
    ----------
    state : State
        Changed in place, but for ``P_pp``: the pose's covariance is the first block of ``P_a``.
    b, P_a, frame : int, ndarray, ndarray
        As for :func:`reduced_apply_in_place`; changed in place.
    columns : ndarray of int, shape (m,)
        First map column of each landmark seen.
    z : ndarray, shape (B, m, 2)
        Relative Cartesian measurements, metres, vehicle frame.
    cov_z : ndarray, shape (m, 2, 2)
        Their covariances, m^2.
    gate : float
        Runs whose normalised innovation squared is larger do not use the measurement.

    Returns
    -------
    innovation : ndarray, shape (B, 2 m)
        measured - predicted.
    S : ndarray, shape (B, 2 m, 2 m)
        Its covariance.
    """
    _apply(state, b, P_a, frame)
    seen = reduced_expected(state, frame, columns, z, cov_z)
    kalman_update_in_place(state._replace(P_pp=P_a[:, :4, :4]), seen, gate)
    return seen.innovation, seen.S


def reduced_expected(state: State, frame: Complex, columns: IntArray, z: Array, cov_z: Array) -> Expected:
    """Innovation, S and H P of landmarks of the map, when no noise is pending; nothing is changed.

    Implements the reduced :eq:`eq-b22` (B22).  H is the real matrix of c at each landmark seen, and zero
    elsewhere.  Parameters as for :func:`reduced_update_in_place`.
    """
    (B, m, _), pairs = z.shape, map_columns(columns)
    c, tau = frame[:, :1], frame[:, 1:2]
    r = c * (state.x_m[:, columns] + 1j * state.x_m[:, columns + 1]) - tau  # eq-b22, reduced
    innovation = (z - np.stack([r.real, r.imag], -1)).reshape(B, 2 * m)
    H = as_matrix(c)  # (B, 1, 2, 2)
    rows = np.concatenate([transpose(state.P_pm.take(pairs, 2)), state.P_mm.take(pairs, 1)], 2)
    HP = (H @ rows.reshape(B, m, 2, -1)).reshape(rows.shape)
    S = (HP.take(4 + pairs, 2).reshape(B, 2 * m, m, 2) @ transpose(H)).reshape(B, 2 * m, 2 * m)
    diagonal_blocks(S)[...] += cov_z
    return Expected(innovation, S, HP)


def as_matrix(c: Complex) -> Array:
    """Multiplication by c (...) as a real matrix (..., 2, 2)."""
    matrix = np.empty((*c.shape, 2, 2))
    matrix[..., 0, 0] = matrix[..., 1, 1] = c.real
    matrix[..., 0, 1], matrix[..., 1, 0] = -c.imag, c.imag
    return matrix

"""Landmarks composed from the vehicle's pose and from r_i, the landmark in the vehicle frame.

Every sighting of a landmark corrects r_i, the pose states do not forget it, and p + R(theta) r_i puts the two
together when the map is asked for.  :func:`vslam_ref.filters.carleman_ekf.book.composed` is the same for one
landmark in plain loops.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, transpose

Complex = NDArray[np.complex128]


def compose_first_order(pose: Array, P: Array, r: Array) -> tuple[Array, Array]:
    """Mean and covariance of p + R(theta) r to first order.

    Implements :eq:`eq-composed` and :eq:`eq-composed-covariance`.

    Parameters
    ----------
    pose : ndarray, shape (..., 3)
        (x, y, theta) in the world, metres and radians.
    P : ndarray, shape (..., 5, 5)
        Joint covariance of (x, y, theta, r_1, r_2).
    r : ndarray, shape (..., 2)
        Landmark in the vehicle frame, metres.

    Returns
    -------
    mean : ndarray, shape (..., 2)
        Landmark in the world, metres.
    cov : ndarray, shape (..., 2, 2)
        Its covariance, m^2.

    Examples
    --------
    >>> import numpy as np
    >>> P = np.diag([0.0, 0.0, 0.01, 0.0, 0.0])
    >>> mean, cov = compose_first_order(np.array([1.0, 2.0, np.pi / 2]), P, np.array([3.0, 0.0]))
    >>> print(mean, cov.diagonal().round(12))
    [1. 5.] [0.09 0.  ]
    """
    s, c = np.sin(pose[..., 2]), np.cos(pose[..., 2])
    J = np.zeros((*r.shape, 5))
    J[..., 0, 0] = J[..., 1, 1] = 1.0
    J[..., 0, 3] = J[..., 1, 4] = c
    J[..., 0, 4], J[..., 1, 3] = -s, s
    turned = (J[..., 3:] @ r[..., None])[..., 0]
    J[..., 0, 2], J[..., 1, 2] = -turned[..., 1], turned[..., 0]
    return pose[..., :2] + turned, J @ P @ transpose(J)  # eq-composed, eq-composed-covariance


def compose_gaussian(pose: Array, P: Array, r: Array) -> tuple[Array, Array]:
    """As :func:`compose_first_order`, with the exact mean and covariance for a Gaussian (x, y, theta, r).

    Implements :eq:`eq-composed-gaussian`.  A factor e^{i theta} under the expectation shifts every other
    variable by i times its covariance with theta, and leaves e^{i theta - v/2}.

    Examples
    --------
    >>> import numpy as np
    >>> P = np.diag([0.0, 0.0, 0.01, 0.0, 0.0])
    >>> mean, _ = compose_gaussian(np.array([1.0, 2.0, 0.0]), P, np.array([3.0, 0.0]))
    >>> print(mean.round(6), round(1 + 3 * np.exp(-0.005), 6))
    [3.985037 2.      ] 3.985037
    """
    theta, v = pose[..., 2], P[..., 2, 2]
    r_hat = r[..., 0] + 1j * r[..., 1]
    k_p, k_r = P[..., 0, 2] + 1j * P[..., 1, 2], P[..., 3, 2] + 1j * P[..., 4, 2]
    pp, pp_conj = _complex_covariance(P[..., :2, :2])
    pr, pr_conj = _complex_covariance(P[..., :2, 3:])
    rr, rr_conj = _complex_covariance(P[..., 3:, 3:])
    q, q2 = np.exp(1j * theta - v / 2), np.exp(2j * theta - 2 * v)
    w = q * (r_hat + 1j * k_r)  # E[e^{i theta} r]
    pw = q * (pr + 1j * k_p * (r_hat + 1j * k_r))  # cov(p, e^{i theta} r), and with its conjugate
    pw_conj = q.conj() * (pr_conj - 1j * k_p * (r_hat + 1j * k_r).conj())
    plain = pp + 2 * pw + q2 * ((r_hat + 2j * k_r) ** 2 + rr) - w**2
    conj = (pp_conj + 2 * pw_conj + abs(r_hat) ** 2 + rr_conj - abs(w) ** 2).real
    cov = np.empty((*r.shape, 2))
    cov[..., 0, 0], cov[..., 1, 1] = (conj + plain.real) / 2, (conj - plain.real) / 2
    cov[..., 0, 1] = cov[..., 1, 0] = plain.imag / 2
    return pose[..., :2] + np.stack([w.real, w.imag], -1), cov  # eq-composed-gaussian


def _complex_covariance(C: Array) -> tuple[Complex, Complex]:
    """cov(f, g) = E[df dg] and cov(f, conj g) from the real covariance (..., 2, 2) of f with g."""
    across, turn = C[..., 0, 1] + C[..., 1, 0], C[..., 1, 0] - C[..., 0, 1]
    return C[..., 0, 0] - C[..., 1, 1] + 1j * across, C[..., 0, 0] + C[..., 1, 1] + 1j * turn

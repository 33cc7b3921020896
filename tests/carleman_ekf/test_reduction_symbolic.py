"""The reduction theorem, as identities of polynomials.

With T the linear map from the lifted states to (x, y, s, c, w, r_1, ...), w = z5 + z6 and
r_i = (zi4 + zi5 - z8 - z9, zi6 - zi3 + z7 - z10), 5 + 2 n states::

    T Phi(U) = Phi_r(U) T        H = H_r T        T J_U(z) = J_r(T z)        T G = G_r T

for *every* state z, on the manifold of lifted poses or not, and every U, on the circle or not.  By
induction K_r = T K: the two filters have the same poses, covariances, innovations and S.  The nine
control monomials are independent symbols here, so the mean of u2 u3 need not be a product of means.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from vslam_ref.filters.carleman_ekf import lift

N = 2
D = 11 + 6 * N
Z = sp.Matrix(sp.symbols(f"z_1:{D + 1}"))
W = sp.symbols("w_1 w_u1 w_u2 w_u3 w_u2u2 w_u2u3 w_u3u3 w_u1u2 w_u1u3")
ONE, U1, U2, U3, U22, U23, U33, U12, U13 = W


def reduction() -> sp.Matrix:
    T = sp.zeros(5 + 2 * N, D)
    for i in range(4):
        T[i, i] = 1
    T[4, 4] = T[4, 5] = 1
    for i in range(N):
        at, to = 11 + 6 * i, 5 + 2 * i
        T[to, at + 3] = T[to, at + 4] = T[to + 1, at + 5] = T[to + 1, 6] = 1
        T[to, 7] = T[to, 8] = T[to + 1, at + 2] = T[to + 1, 9] = -1
    return T


def lifted_transition() -> sp.Matrix:
    def polynomial(matrices: np.ndarray) -> sp.Matrix:
        total = sp.zeros(*matrices[0].shape)
        for w, M in zip(W, matrices, strict=True):
            total += w * sp.Matrix(M.astype(int))
        return total

    return sp.diag(polynomial(lift.VEHICLE_MATRICES), *[polynomial(lift.LANDMARK_MATRICES)] * N)


def reduced_transition() -> sp.Matrix:
    """Written by hand: r' = Rot(-alpha) r - u1 (u3, -u2) w."""
    pose = sp.Matrix(
        [
            [ONE, 0, 0, U1, 0],
            [0, ONE, U1, 0, 0],
            [0, 0, U3, U2, 0],
            [0, 0, -U2, U3, 0],
            [0, 0, 0, 0, U22 + U33],
        ]
    )
    Phi = sp.diag(pose, *[sp.Matrix([[U3, U2], [-U2, U3]])] * N)
    for i in range(N):
        Phi[5 + 2 * i, 4], Phi[6 + 2 * i, 4] = -U13, U12
    return Phi


T, PHI, PHI_R = reduction(), lifted_transition(), reduced_transition()


def test_transition_is_closed() -> None:
    assert sp.expand(T * PHI - PHI_R * T) == sp.zeros(5 + 2 * N, D)


def test_noise_enters_alike() -> None:
    J_U = (PHI * Z).jacobian(W[1:])
    Zr = sp.Matrix(sp.symbols(f"m_1:{6 + 2 * N}"))
    J_r = (PHI_R * Zr).jacobian(W[1:]).subs(list(zip(Zr, T * Z, strict=True)), simultaneous=True)
    assert sp.expand(T * J_U - J_r) == sp.zeros(5 + 2 * N, 8)


def test_measurement_reads_the_reduced_state() -> None:
    H = sp.Matrix(lift.measurement_matrix([1, 0], N).astype(int))
    H_r = sp.zeros(4, 5 + 2 * N)
    for row, state in enumerate((7, 8, 5, 6)):  # r_2, then r_1
        H_r[row, state] = 1
    assert H_r * T == H


def placement(rows: slice) -> tuple[sp.Matrix, sp.Matrix]:
    """Lifted rows of a new landmark, G_3(x_new) z_R, and G_new(z_R), as symbols."""
    xn, yn = sp.symbols("x_new y_new")
    at = [
        lift.placement_matrices(np.zeros(11), np.array(m))[0].astype(int)
        for m in ([0.0, 0], [1.0, 0], [0, 1.0])
    ]
    G_3 = sp.Matrix(at[0]) + xn * sp.Matrix(at[1] - at[0]) + yn * sp.Matrix(at[2] - at[0])
    new = G_3 * Z[:11, :]
    return new[rows, :], new.jacobian((xn, yn))[rows, :]


def test_new_landmark_enters_as_w_times_the_measurement() -> None:
    xn, yn = sp.symbols("x_new y_new")
    new, G_new = placement(slice(0, 6))
    r = sp.Matrix([new[3] + new[4] - Z[7] - Z[8], new[5] - new[2] + Z[6] - Z[9]])
    w = Z[4] + Z[5]
    assert sp.expand(r - w * sp.Matrix([xn, yn])) == sp.zeros(2, 1)
    R = sp.Matrix([[0, 0, 0, 1, 1, 0], [0, 0, -1, 0, 0, 1]])  # r_i of the landmark's own states
    assert sp.expand(R * G_new - w * sp.eye(2)) == sp.zeros(2, 2)


def test_the_map_is_no_function_of_the_reduced_state() -> None:
    assert T.rank() == 5 + 2 * N
    world = sp.zeros(1, D)
    world[11] = 1
    assert T.col_join(world).rank() == 6 + 2 * N


def test_the_map_may_be_carried_along() -> None:
    """z_i1, z_i2 stay put, and a new pair needs x, y, s, c only: 5 + 4 n states are closed, too."""
    carried = sp.zeros(2 * N, D)
    for i in range(N):
        carried[2 * i, 11 + 6 * i] = carried[2 * i + 1, 12 + 6 * i] = 1
    assert carried * PHI == ONE * carried
    new, _ = placement(slice(0, 2))
    assert new.free_symbols <= {*Z[:4], *sp.symbols("x_new y_new")}


@pytest.mark.parametrize("dropped", [5, 6])
def test_without_one_of_its_states_the_reduction_is_not_closed(dropped: int) -> None:
    """Half a landmark does not do: rows of T Phi leave the row space of what is kept."""
    keep = [i for i in range(5 + 2 * N) if i != dropped]
    kept = T.extract(keep, list(range(D)))
    numbers = dict(zip(W, (1, 2, sp.Rational(3, 5), sp.Rational(4, 5), 7, 11, 13, 17, 19), strict=True))
    moved = (kept * PHI).subs(numbers)
    assert kept.col_join(moved).rank() > kept.rank()


def test_w_may_be_dropped_only_on_the_circle() -> None:
    """w' = (u2u2 + u3u3) w: constant iff the monomials' mean, and every noise on them, keeps u2^2 + u3^2."""
    assert sp.expand((PHI_R * T * Z)[4] - (U22 + U33) * (Z[4] + Z[5])) == 0
    row = (PHI_R * T * Z).jacobian(W[1:])[4, :]
    tangent = sp.Matrix([0, U3, -U2, 2 * U23, U33 - U22, -2 * U23, U13, -U12])  # d(monomials)/d(alpha)
    assert sp.expand((row * tangent)[0]) == 0
    radial = sp.Matrix([0, U2, U3, 2 * U22, 2 * U23, 2 * U33, U12, U13])
    assert sp.expand((row * radial)[0] - 2 * (U22 + U33) * (Z[4] + Z[5])) == 0

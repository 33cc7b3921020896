"""Every printed row of B§2, symbolically, against the definition of the lift.

The oracle is B4 and the definition of the lifted states (B14, B15) alone: substitute
x' = x + u1 cos(theta), y' = y + u1 sin(theta), theta' = theta + a, u2 = sin a, u3 = cos a into the lift
and compare with the row.  The rows below are typed from the paper, not taken from the package; a
second set of tests compares the package's matrices with the same definition, entry by entry.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from vslam_ref.filters.carleman_ekf import lift

x, y, t, a, u1, X, Y, xn, yn = sp.symbols("x y theta alpha u_1 X Y x_new y_new", real=True)
u2, u3 = sp.sin(a), sp.cos(a)
s, c = sp.sin(t), sp.cos(t)
MOVE = {x: x + u1 * c, y: y + u1 * s, t: t + a}

VEHICLE = (x, y, s, c, s**2, c**2, x * s, x * c, y * s, y * c, s * c)  # B14
LANDMARK = (X, Y, s * X, c * X, s * Y, c * Y)  # B15
z1, z2, z3, z4, z5, z6, z7, z8, z9, z10, z11 = VEHICLE
f1, f2, f3, f4, f5, f6 = LANDMARK
SEEN = sp.Matrix([[c, s], [-s, c]]) * sp.Matrix([X - x, Y - y])  # R(theta)^T (X - x)
PLACED = (x + c * xn - s * yn, y + s * xn + c * yn)
NEW = [e.subs({X: PLACED[0], Y: PLACED[1]}, simultaneous=True) for e in LANDMARK]

PRINTED: dict[str, tuple[list[sp.Expr], list[sp.Expr]]] = {
    # label: (rows as the paper prints them, what the definition says)
    "B7": (
        [z1 + z4 * u1, z2 + z3 * u1, z3 * u3 + z4 * u2, z4 * u3 - z3 * u2],
        [e.subs(MOVE, simultaneous=True) for e in VEHICLE[:4]],
    ),
    "B9": (
        list(
            sp.Matrix([[1, 0, 0, u1], [0, 1, u1, 0], [0, 0, u3, u2], [0, 0, -u2, u3]])
            * sp.Matrix(VEHICLE[:4])
        ),
        [e.subs(MOVE, simultaneous=True) for e in VEHICLE[:4]],
    ),
    "B16": (
        [
            z1 + u1 * z4,
            z2 + u1 * z3,
            z3 * u3 + z4 * u2,
            z4 * u3 - z3 * u2,
            z5 * u3**2 + z11 * 2 * u2 * u3 + z6 * u2**2,
            z6 * u3**2 - z11 * 2 * u2 * u3 + z5 * u2**2,
            z7 * u3 + z8 * u2 + z6 * u1 * u2 + z11 * u1 * u3,
            z8 * u3 - u2 * z7 + z6 * u1 * u3 - z11 * u1 * u2,
            z9 * u3 + u2 * z10 + z5 * u1 * u3 + z11 * u1 * u2,
            z10 * u3 - u2 * z9 + z11 * u1 * u3 - z5 * u1 * u2,
            z11 * u3**2 - u2 * u3 * z5 + z6 * u2 * u3 - z11 * u2**2,
        ],
        [e.subs(MOVE, simultaneous=True) for e in VEHICLE],
    ),
    "B18": (
        [f1, f2, f3 * u3 + f4 * u2, f4 * u3 - f3 * u2, f5 * u3 + f6 * u2, f6 * u3 + f5 * u2],
        [e.subs(MOVE, simultaneous=True) for e in LANDMARK],
    ),
    "B21": ([X * c + Y * s - x * c - y * s, Y * c - X * s + x * s - y * c], list(SEEN)),
    "B22": ([f4 + f5 - z8 - z9, -f3 + f6 + z7 - z10], list(SEEN)),
    "B25": ([xn * z4 - yn * z3 + z1, xn * z3 + yn * z4 + z2], list(PLACED)),
    "B26": (
        [
            xn * z4 - yn * z3 + z1,
            xn * z3 + yn * z4 + z2,
            xn * z11 - yn * z5 + z7,
            xn * z6 - yn * z11 + z8,
            xn * z5 - yn * z11 + z9,
            xn * z11 + yn * z6 + z10,
        ],
        NEW,
    ),
}
WRONG = {("B18", 6), ("B26", 5)}
ROWS = [(label, i) for label, (rows, _) in PRINTED.items() for i in range(1, len(rows) + 1)]


def is_zero(expression: sp.Expr) -> bool:
    """Exact: an identity in sines and cosines becomes a polynomial identity in exponentials."""
    return bool(sp.expand(sp.expand(expression).rewrite(sp.exp)).equals(0)) if expression != 0 else True


@pytest.mark.parametrize(("label", "row"), ROWS)
def test_printed_row_agrees_with_the_lift_unless_it_is_an_erratum(label: str, row: int) -> None:
    rows, definition = PRINTED[label]
    assert is_zero(rows[row - 1] - definition[row - 1]) == ((label, row) not in WRONG)


def test_the_corrections_of_the_two_errata() -> None:
    assert is_zero(f6 * u3 - f5 * u2 - PRINTED["B18"][1][5])
    assert is_zero(xn * z5 + yn * z11 + z9 - PRINTED["B26"][1][4])


def test_b11_is_the_jacobian_of_b7_in_the_control() -> None:
    U = sp.symbols("U_1:4")
    Z = sp.symbols("Z_1:5")
    b7 = sp.Matrix(
        [Z[0] + Z[3] * U[0], Z[1] + Z[2] * U[0], Z[2] * U[2] + Z[3] * U[1], Z[3] * U[2] - Z[2] * U[1]]
    )
    b11 = sp.Matrix([[Z[3], 0, 0], [Z[2], 0, 0], [0, Z[3], Z[2]], [0, -Z[2], Z[3]]])
    assert b7.jacobian(U) == b11


# --- the package's matrices, entry by entry -----------------------------------------------------------


def polynomial_matrix(matrices: np.ndarray) -> sp.Matrix:
    """The package's constant matrices, one per control monomial, as one symbolic matrix."""
    w = (1, u1, u2, u3, u2 * u2, u2 * u3, u3 * u3, u1 * u2, u1 * u3)
    assert lift.MONOMIALS == ("1", "u1", "u2", "u3", "u2u2", "u2u3", "u3u3", "u1u2", "u1u3")
    return sum(
        (m * sp.Matrix(M.astype(int)) for m, M in zip(w, matrices, strict=True)), sp.zeros(*matrices[0].shape)
    )


def failing_rows(found: sp.Matrix, definition: list[sp.Expr]) -> set[int]:
    return {i for i, (f, d) in enumerate(zip(found, definition, strict=True), 1) if not is_zero(f - d)}


def test_package_matrices_are_integers() -> None:
    for M in (lift.VEHICLE_MATRICES, lift.LANDMARK_MATRICES, lift.LANDMARK_MATRICES_AS_PRINTED):
        assert np.array_equal(M, M.astype(int))


def test_package_vehicle_matrix_moves_the_lift() -> None:
    assert (
        failing_rows(polynomial_matrix(lift.VEHICLE_MATRICES) * sp.Matrix(VEHICLE), PRINTED["B16"][1])
        == set()
    )


@pytest.mark.parametrize(
    ("matrices", "wrong"), [("LANDMARK_MATRICES", set()), ("LANDMARK_MATRICES_AS_PRINTED", {6})]
)
def test_package_landmark_matrix_moves_the_lift(matrices: str, wrong: set[int]) -> None:
    moved = polynomial_matrix(getattr(lift, matrices)) * sp.Matrix(LANDMARK)
    assert failing_rows(moved, PRINTED["B18"][1]) == wrong


def test_package_matrices_take_monomials_in_their_order() -> None:
    for which, function in (
        (lift.VEHICLE_MATRICES, lift.vehicle_matrix),
        (lift.LANDMARK_MATRICES, lift.landmark_matrix),
    ):
        for k in range(9):
            assert np.array_equal(function(np.eye(9)[k]), which[k])


def test_package_measurement_matrix_sees_the_landmark() -> None:
    other = [sp.Symbol(f"other_{k}") for k in range(6)]  # a landmark that is not measured
    H = sp.Matrix(lift.measurement_matrix([1], 2).astype(int))
    state = sp.Matrix([*VEHICLE, *other, *LANDMARK])
    assert failing_rows(H * state, list(SEEN)) == set()


@pytest.mark.parametrize(("printed", "wrong"), [(False, set()), (True, {5})])
def test_package_placement_lifts_the_new_landmark(printed: bool, wrong: set[int]) -> None:
    """G_3 is affine in the measurement: three evaluations give it whole; G_new is its derivative."""
    variant = lift.Variant(b26_as_printed=printed)
    at = [
        lift.placement_matrices(np.zeros(11), np.array(m), variant)[0] for m in ([0.0, 0], [1.0, 0], [0, 1.0])
    ]
    G_0, G_x, G_y = (sp.Matrix(M.astype(int)) for M in (at[0], at[1] - at[0], at[2] - at[0]))
    lifted = (G_0 + xn * G_x + yn * G_y) * sp.Matrix(VEHICLE)
    assert failing_rows(lifted, NEW) == wrong
    unit = np.stack([lift.placement_matrices(np.eye(11)[k], np.zeros(2), variant)[1] for k in range(11)], -1)
    G_new = sp.Matrix(6, 2, lambda i, j: sum(int(unit[i, j, k]) * VEHICLE[k] for k in range(11)))
    derivative = sp.Matrix(NEW).jacobian((xn, yn))
    off = {i + 1 for i in range(6) for j in range(2) if not is_zero(G_new[i, j] - derivative[i, j])}
    assert off == wrong


def test_package_lifts_and_their_jacobian_are_the_definition() -> None:
    values = {
        x: sp.Rational(13, 10),
        y: -sp.Rational(21, 10),
        t: sp.Rational(9, 10),
        X: 5,
        Y: sp.Rational(7, 3),
    }
    pose = np.array([1.3, -2.1, 0.9])
    exact = np.array([float(e.subs(values)) for e in VEHICLE])
    J = np.array(sp.Matrix(VEHICLE).jacobian((x, y, t)).subs(values).evalf(20).tolist(), dtype=float)
    landmark = np.array([float(e.subs(values)) for e in LANDMARK])
    # at most four roundings on numbers below 6
    tolerance = 4 * 6 * np.finfo(float).eps
    assert np.abs(lift.lift_vehicle(pose) - exact).max() < tolerance
    assert np.abs(lift.lift_vehicle_jacobian(pose) - J).max() < tolerance
    assert np.abs(lift.lift_landmark(pose, [5, 7 / 3]) - landmark).max() < tolerance

"""The second-order Carleman lift by computer algebra, and its filter in 50 digits.

A lifted state is a product of basic quantities (x, y, s, c and X, Y of a landmark).  Its value after a step
is the product of what these become: expanded, and read as a sum of lifted states.  No row of the paper is
typed in.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Sequence
from typing import Any

import mpmath
import numpy as np
import sympy
from mpmath import mpf

from generator.exact_arrays import (
    Big,
    block_diagonal,
    eye,
    from_matrix,
    inverse,
    jacobian,
    stack,
    zeros,
)
from generator.exact_ekf import increment
from generator.exact_moments import LIFT, MONOMIALS, POSE, moments

BASIC = x, y, s, c, X, Y = sympy.symbols("x y s c X Y")
CONTROL = u1, u2, u3 = sympy.symbols("u1 u2 u3")
MEASURED = a, b = sympy.symbols("a b")
VEHICLE = [x, y, s, c, s * s, c * c, x * s, x * c, y * s, y * c, s * c]
LANDMARK = [X, Y, s * X, c * X, s * Y, c * Y]
STEP = {x: x + u1 * c, y: y + u1 * s, s: s * u3 + c * u2, c: c * u3 - s * u2}
PLACE = {X: x + c * a - s * b, Y: y + s * a + c * b}
SEEN = [c * (X - x) + s * (Y - y), c * (Y - y) - s * (X - x)]


def _rows(expressions: list[Any], states: list[Any]) -> Any:
    """Matrix of expressions that are linear in the states; an assertion fails where they are not."""
    places = {sympy.Poly(state, *BASIC).monoms()[0]: k for k, state in enumerate(states)}
    M = sympy.zeros(len(expressions), len(states))
    for i, expression in enumerate(expressions):
        for monomial, coefficient in sympy.Poly(sympy.expand(expression), *BASIC).terms():
            assert monomial in places, f"{expression} is not linear in the lifted states"
            M[i, places[monomial]] = coefficient
    return M


def _printed(M: Any, wrong: str) -> Any:
    """The matrix with the paper's misprint."""
    if wrong == "b18-as-printed":
        M[5, 4] = -M[5, 4]
    if wrong == "b26-as-printed":
        M[4, 10] = M[4, 10].subs(b, -b)
    return M


def _stepped(states: list[Any]) -> list[Any]:
    return [state.subs(STEP, simultaneous=True) for state in states]


@functools.cache
def motion(wrong: str = "") -> tuple[Callable[..., Any], Callable[..., Any], Callable[..., Any]]:
    """Functions of U: matrix of the vehicle, of a landmark, and their derivatives in u1, u2, u3."""
    M_R = _rows(_stepped(VEHICLE), VEHICLE)
    M_L = _printed(_rows(_stepped(LANDMARK), LANDMARK), wrong)
    slopes = [[M.diff(u) for u in CONTROL] for M in (M_R, M_L)]
    of_R, of_L, of_slopes = (sympy.lambdify(CONTROL, M, "mpmath") for M in (M_R, M_L, slopes))
    return of_R, of_L, of_slopes


@functools.cache
def placement(wrong: str = "") -> Callable[..., Any]:
    """Function of a measurement: matrix (6, 11) of a new landmark's states."""
    placed = [state.subs(PLACE, simultaneous=True) for state in LANDMARK]
    of: Callable[..., Any] = sympy.lambdify(MEASURED, _printed(_rows(placed, VEHICLE), wrong), "mpmath")
    return of


@functools.cache
def sight() -> Big:
    """Constant matrix (2, 17) of one landmark's relative place."""
    return from_matrix(mpmath.matrix(_rows(SEEN, [*VEHICLE, *LANDMARK]).tolist()))


def lift(pose: Big) -> Big:
    """Eleven products of (x, y, theta)."""
    values = {x: pose[0], y: pose[1], s: mpmath.sin(pose[2]), c: mpmath.cos(pose[2])}
    return stack(
        [mpmath.fprod(values[q] ** k for q, k in state.as_powers_dict().items()) for state in VEHICLE]
    )


def lifted_start(pose: Big, P: Big, *, wrong: str = "") -> tuple[Big, Big]:
    """Lifted mean, and covariance by the lift's derivative."""
    J = jacobian(lift, pose)
    Z, P_Z = lift(pose), J @ P @ J.T
    if wrong == "no-products":
        P_Z[4:, :], P_Z[:, 4:] = zeros(7, 11), zeros(11, 7)
    if wrong == "cos-before-sin":
        order = [0, 1, 3, 2, 5, 4, 7, 6, 9, 8, 10]
        return Z[order], P_Z[order][:, order]
    return Z, P_Z


def gaussian_start(pose: Big, P: Big, *, wrong: str = "") -> tuple[Big, Big]:
    """Exact mean and covariance of the lifted pose."""
    return lifted_start(pose, P) if wrong == "first-order" else moments(LIFT, pose, P)


def reduced_start(pose: Big, P: Big, *, wrong: str = "") -> tuple[Big, Big]:
    """Exact mean and covariance of (x, y, sin, cos)."""
    if wrong == "first-order":
        Z, P_Z = lifted_start(pose, P)
        return Z[:4], P_Z[:4, :4]
    return moments(POSE, pose, P)


def lifted_landmark(pose: Big, place: Big) -> Big:
    """Six products of a landmark and the heading."""
    s_, c_ = mpmath.sin(pose[2]), mpmath.cos(pose[2])
    return stack([place[0], place[1], s_ * place[0], c_ * place[0], s_ * place[1], c_ * place[1]])


def control(inc: Big, cov: Big, *, wrong: str = "") -> tuple[Big, Big]:
    """U = (ds, sin, cos) of an increment, and its covariance to first order, of rank 2."""

    def lifted(d: Big) -> Big:
        return stack([d[0], mpmath.sin(d[1]), mpmath.cos(d[1])])

    G = jacobian(lifted, inc)
    Q, U = G @ cov @ G.T, lifted(inc)
    if wrong == "three-noises":
        Q = np.diag(np.diag(Q)) + zeros(3, 3)
    return (U[[0, 2, 1]] if wrong == "control-sin-cos-swapped" else U), Q


def predict(Z: Big, P: Big, inc: Big, cov: Big, *, wrong: str = "") -> tuple[Big, Big]:
    """Lifted mean and covariance after one increment."""
    n = (len(Z) - 11) // 6
    U, Q = control(inc, cov, wrong=wrong)
    of_R, of_L, slopes = motion("b18-as-printed" if wrong == "b18-as-printed" else "")
    d_R, d_L = ([from_matrix(M) for M in of_one] for of_one in slopes(*U))
    M = block_diagonal([from_matrix(of_R(*U)), *[from_matrix(of_L(*U))] * n])
    J = np.stack([block_diagonal([d_R[k], *[d_L[k]] * n]) @ Z for k in range(3)], 1)
    noise = J @ Q @ J.T
    if wrong == "no-common-noise":
        noise = _diagonal_blocks(noise)
    if wrong == "no-control-noise":
        noise = zeros(*P.shape)
    after = M.T @ P @ M + noise if wrong == "gtpg" else M @ P @ M.T + noise
    if wrong == "no-cross-blocks":
        after = _diagonal_blocks(after)
    return M @ Z, after


def predict_gaussian(Z: Big, P: Big, inc: Big, cov: Big, *, wrong: str = "") -> tuple[Big, Big]:
    """As :func:`predict`, with exact means and covariances of the control's monomials.

    The step is linear in the monomials w: M(w) Z = sum of w_k M_k Z, M_0 without any.
    """
    n = (len(Z) - 11) // 6
    three, K = stack([inc[0], mpf(0), inc[1]]), zeros(3, 3)
    K[0, 0], K[0, 2], K[2, 0], K[2, 2] = cov[0, 0], cov[0, 1], cov[1, 0], cov[1, 1]
    w, C = moments(MONOMIALS, three, K)
    if wrong == "product-of-means":
        u = w[:3]
        w = stack([*u, u[1] ** 2, u[1] * u[2], u[2] ** 2, u[0] * u[1], u[0] * u[2]])
    parts = [block_diagonal([R, *[L] * n]) for R, L in zip(*monomial_matrices(), strict=True)]
    M = sum((value * part for value, part in zip(w, parts[1:], strict=True)), parts[0])
    J = np.stack([part @ Z for part in parts[1:]], 1)
    return M @ Z, M @ P @ M.T + J @ C @ J.T


@functools.cache
def monomial_matrices() -> tuple[list[Big], list[Big]]:
    """Constant matrices of 1, u1, u2, u3, u2 u2, u2 u3, u3 u3, u1 u2, u1 u3: vehicle, landmark."""
    products = [(), (u1,), (u2,), (u3,), (u2, u2), (u2, u3), (u3, u3), (u1, u2), (u1, u3)]
    out = []
    for states in (VEHICLE, LANDMARK):
        M = _rows(_stepped(states), states)
        keys = [tuple(sum(q == u for q in product) for u in CONTROL) for product in products]
        parts = [sympy.zeros(*M.shape) for _ in keys]
        for i in range(M.rows):
            for j in range(M.cols):
                for powers, factor in sympy.Poly(M[i, j], *CONTROL).terms():
                    if factor != 0:
                        parts[keys.index(powers)][i, j] += factor
        out.append([from_matrix(mpmath.matrix(part.tolist())) for part in parts])
    return out[0], out[1]


def _diagonal_blocks(P: Big) -> Big:
    """P with nothing between vehicle and landmarks."""
    edges = [0, 11, *range(17, len(P) + 1, 6)]
    return block_diagonal([P[i:j, i:j] for i, j in itertools.pairwise(edges)])


def update(Z: Big, P: Big, slots: Sequence[int], z: Big, cov_z: Big, *, wrong: str = "") -> tuple[Big, Big]:
    """Lifted mean and covariance after some landmarks were seen, all at once."""
    H = zeros(2 * len(slots), len(Z))
    for k, slot in enumerate(slots):
        at = 11 + 6 * slot
        if wrong == "global-measurement":
            for i in range(2):
                H[2 * k + i, at + i], H[2 * k + i, i] = mpf(1), mpf(-1)
        else:
            H[2 * k : 2 * k + 2, :11] = sight()[:, :11]
            H[2 * k : 2 * k + 2, at : at + 6] = sight()[:, 11:]
    innovation = z.reshape(-1) - H @ Z
    S = H @ P @ H.T + block_diagonal([cov_z] * len(slots))
    K = P @ H.T @ inverse(S)
    after = Z - K @ innovation if wrong == "innovation-sign" else Z + K @ innovation
    if wrong == "heading-renormalised":
        length = mpmath.sqrt(after[2] ** 2 + after[3] ** 2)
        after = stack([*after[:2], after[2] / length, after[3] / length, *after[4:]])
    return after, P - K @ S @ K.T


def augment(Z: Big, P: Big, z: Big, cov_z: Big, *, wrong: str = "") -> tuple[Big, Big]:
    """Lifted mean and covariance with one landmark more."""
    of = placement("b26-as-printed" if wrong == "b26-as-printed" else "")

    def place(w: Big) -> Big:
        return from_matrix(of(*w)) @ Z[:11]

    G_3, G_new = zeros(6, len(Z)), jacobian(place, z)
    G_3[:, :11] = from_matrix(of(*z))
    own, cross = G_3 @ P @ G_3.T + G_new @ cov_z @ G_new.T, G_3 @ P
    if wrong == "identity-landmark":
        own = eye(6)
    if wrong in ("identity-landmark", "no-cross-covariance"):
        cross = zeros(*cross.shape)
    return np.concatenate([Z, place(z)]), np.block([[P, cross.T], [cross, own]])


def pose(z: Big, P: Big, *, wrong: str = "") -> tuple[Big, Big]:
    """Mean (x, y, atan2(sin, cos)), and covariance to first order, of the states (x, y, sin, cos)."""

    def heading(w: Big) -> Any:
        return mpmath.atan2(w[3], w[2]) if wrong == "atan2-swapped" else mpmath.atan2(w[2], w[3])

    def read(w: Big) -> Big:
        return stack([w[0], w[1], heading(w)])

    J = jacobian(read, z)
    if wrong == "length-forgotten":
        J[2] = J[2] * (z[2] ** 2 + z[3] ** 2)
    return read(z), J @ P @ J.T


def reduced_predict(m: Big, P: Big, inc: Big, cov: Big, *, wrong: str = "") -> tuple[Big, Big]:
    """(x, y, sin, cos, r1, ...), r a landmark in the axes of the vehicle: ahead by ds, then the turn."""

    def step(w: Big, d: Big) -> Big:
        ds, sin, cos = d[0], mpmath.sin(d[1]), mpmath.cos(d[1])
        R = np.array([[cos, sin], [-sin, cos]], dtype=object)  # the transpose of a turn to the left
        rest = w[4:].reshape(-1, 2)
        ahead = stack([ds, mpf(0)])
        if wrong == "landmarks-turn-left":
            R = R.T
        turned = [R @ r - ahead if wrong == "turn-before-drive" else R @ (r - ahead) for r in rest]
        own = [w[0] + ds * w[3], w[1] + ds * w[2], w[2] * cos + w[3] * sin, w[3] * cos - w[2] * sin]
        return stack([*own, *(value for r in turned for value in r)])

    M, J = jacobian(lambda w: step(w, inc), m), jacobian(lambda d: step(m, d), inc)
    noise = J @ cov @ J.T
    if wrong == "no-common-noise":
        edges = [0, *range(4, len(P) + 1, 2)]
        noise = block_diagonal([noise[i:j, i:j] for i, j in itertools.pairwise(edges)])
    after = M.T @ P @ M + noise if wrong == "gtpg" else M @ P @ M.T + noise
    return step(m, inc), after


def reduced_gaussian(m: Big, P: Big, inc: Big, cov: Big, *, wrong: str = "") -> tuple[Big, Big]:
    """As :func:`reduced_predict`, with exact moments of u1, u2, u3, u1 u2, u1 u3: linear in all five."""
    three, K = stack([inc[0], mpf(0), inc[1]]), zeros(3, 3)
    K[0, 0], K[0, 2], K[2, 0], K[2, 2] = cov[0, 0], cov[0, 1], cov[1, 0], cov[1, 1]
    used = [0, 1, 2, 6, 7]
    w, C = moments(MONOMIALS, three, K)
    w, C = w[used], C[used][:, used]
    if wrong == "product-of-means":
        w = stack([*w[:3], w[0] * w[1], w[0] * w[2]])

    def step(state: Big, v: Big) -> Big:
        x_, y_, s_, c_ = state[:4]
        d, sin, cos, d_sin, d_cos = v
        out = [x_ + d * c_, y_ + d * s_, s_ * cos + c_ * sin, c_ * cos - s_ * sin]
        for r in state[4:].reshape(-1, 2):
            out += [cos * r[0] + sin * r[1] - d_cos, cos * r[1] - sin * r[0] + d_sin]
        return stack(out)

    M, J = jacobian(lambda state: step(state, w), m), jacobian(lambda v: step(m, v), w)
    return step(m, w), M @ P @ M.T + J @ C @ J.T


def run(inputs: dict[str, Any], *, wrong: str = "") -> list[tuple[Big, Big]]:
    """A whole run of the lifted filter: as :func:`.exact_ekf.run`; poses and their covariances."""
    Z, P = lifted_start(inputs["x"], inputs["P"])
    slots: dict[int, int] = {}
    steps = []
    for u, sighting in zip(inputs["controls"], inputs["sightings"], strict=True):
        inc = increment(u, inputs["wheelbase"], inputs["dt"])
        D = jacobian(lambda w: increment(w, inputs["wheelbase"], inputs["dt"]), u)
        Z, P = predict(Z, P, inc, D @ inputs["cov_u"] @ D.T, wrong=wrong)
        known = [(slots[i], z) for i, z in sighting if i in slots]
        if known:
            z = np.array([z for _, z in known], dtype=object)
            Z, P = update(Z, P, [slot for slot, _ in known], z, inputs["cov_z"], wrong=wrong)
        for i, z in sighting:
            if i not in slots:
                slots[i] = len(slots)
                Z, P = augment(Z, P, z, inputs["cov_z"], wrong=wrong)
        steps.append(pose(Z[:4], P[:4, :4]))
    return steps

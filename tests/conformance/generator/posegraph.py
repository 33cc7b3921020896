"""Pose graphs: errors of edges in two conventions, one Gauss-Newton step, and the chordal start."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np

from generator.building import Topic, not_in_single, tolerance
from generator.draws import digits
from generator.edges import GROUPS, edge
from generator.exact import Matrix, column, floats, matrix, vector
from generator.groups import Array, shift, turn
from generator.se2 import _matrix as plane
from generator.se2 import _read as read_plane
from generator.so3 import polar

TOPIC, CHAPTER = "posegraph", 13

NOTES = {
    "z-not-inverted": (
        "your error multiplies by Z where it must take it away: at the measured poses it is not zero",
        "Log(Z X_i^-1 X_j)",
    ),
    "edge-reversed": ("you take the edge from j to i", "Log(Z^-1 X_j^-1 X_i)"),
    "other-convention": (
        "your error is that of the other convention: log is the whole logarithm, g2o takes the translation "
        "as it is, and in space the vector part of the quaternion",
        "(t, angle) for Log, or Log for (t, angle)",
    ),
    "angle-not-wrapped": ("the angle of your error is off by a whole turn", "theta_j - theta_i - theta_z"),
    "right-for-left": (
        "you take the left Jacobian's inverse; steps on the right need the right one",
        "J_l^-1(e)",
    ),
    "jacobian-forgotten": ("your J_j is the identity, which holds only where the error is zero", "J_j = I"),
    "adjoint-of-the-inverse": ("your J_i has the adjoint of the wrong motion", "-J_j Ad(X_i^-1 X_j)"),
    "left-steps": ("your Jacobians are for steps on the left, Exp(delta) X", "J Ad(X^-1)"),
    "quaternion-order": ("you take w x y for the vector part: the order is w x y z", "(w, x, y)"),
    "whole-angle": ("you take twice the vector part of the quaternion", "(t, 2 v)"),
    "uphill": ("your step goes uphill: the gradient's sign is wrong", "+H^-1 g"),
    "information-ignored": ("your step ignores the information", "Omega = I"),
    "information-inverted": ("you weigh with the covariance; the information is given", "Omega^-1"),
    "upper-triangle": ("you take the upper triangle of the information for all of it", "triu(Omega)"),
    "blocks-swapped": ("you read the information angle first", "(theta, x, y)"),
    "first-not-held": ("you hold no pose: your step is the shortest of all", "pinv(J) r"),
    "chi2-halved": ("your chi2 is half of the sum", "1/2 sum e^T Omega e"),
    "factors-exchanged": ("you multiply the rotations in the wrong order", "R_ij R_i - R_j"),
    "weights-ignored": ("your start weighs all edges alike", "kappa = tau = 1"),
    "not-projected": ("you leave the matrices as they are: the nearest rotation is wanted", "M for U V^T"),
    "steps-not-turned": (
        "you add up the steps as they were measured, in their bodies' axes",
        "t_i + t_ij - t_j",
    ),
}
OF_ERRORS = ("z-not-inverted", "edge-reversed", "adjoint-of-the-inverse", "left-steps")
OF_LOG = ("right-for-left", "jacobian-forgotten")
OF_STEP = (
    *("uphill", "information-ignored", "information-inverted", "upper-triangle", "blocks-swapped"),
    *("first-not-held", "chi2-halved"),
)
OF_START = ("factors-exchanged", "weights-ignored", "not-projected", "steps-not-turned")
DEFINITION = "definition, 50 digits; Jacobians by series of brackets"
ENDS = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [0, 2]])


def build(rng: np.random.Generator) -> Topic:
    """All groups."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    reason = "three products, a logarithm and an inverse Jacobian of numbers of order 10: some hundred eps"
    fine = tolerance(1e-13, reason)
    reason = "poses of size 10 multiplied: what is left of them keeps their rounding"
    left = not_in_single(tolerance(1e-13, reason, absolute=2e-14))
    for space in ("se2", "se3", "sim3"):
        for convention in ("log", "g2o") if space != "sim3" else ("log",):
            for flag, size, count in (("generic", 1.0, 4), ("agrees", 1e-6, 2)):
                cases = [_edge(rng, space, convention, size) for _ in range(count)]
                flags = (convention,) if flag == "generic" else (convention, flag)
                label = "eq-edge-error" if convention == "log" else "eq-g2o-error"
                rule = fine if flag == "generic" else left
                topic.group(f"posegraph.{space}_edge", label, DEFINITION, rule, cases, flags=flags)
    for convention in ("log", "g2o"):
        cases = [_edge(rng, "se2", convention, 1.0, across=True) for _ in range(4)]
        label = "eq-edge-error" if convention == "log" else "eq-g2o-error"
        topic.group("posegraph.se2_edge", label, DEFINITION, fine, cases, flags=(convention, "wrapped"))
    reason = "condition of the normal matrix, at most 10^3, times some ten operations"
    rule = tolerance(2e-12, reason, float32=1e-2)
    for convention in ("log", "g2o"):
        cases = [_step(rng, convention) for _ in range(4)]
        topic.group(
            "posegraph.step", "eq-graph-normal", "rows in 50 digits", rule, cases, flags=(convention,)
        )
    cases = [_start(rng) for _ in range(4)]
    oracle = "normal equations in 50 digits, Newton's iteration for the nearest rotation"
    topic.group("posegraph.chordal_start", "eq-chordal-rotations", oracle, rule, cases)
    return topic


def _drawn(rng: np.random.Generator, space: str, size: float = 1.0) -> Array:
    """An element that is ``size`` away from the identity, as doubles."""
    if space == "se2":
        return digits([*(size * shift(rng)[:2]), size * rng.uniform(0.3, 0.9) * rng.choice([-1.0, 1.0])])
    xi = [*size * shift(rng), *size * 0.4 * turn(rng)]
    xi = [*xi, size * rng.uniform(-0.4, 0.4)] if space == "sim3" else xi
    return np.array(floats(GROUPS[space].exp(vector(xi))))


def _big(space: str, x: Array) -> Matrix:
    return plane(x) if space == "se2" else matrix(x)


def _small(space: str, M: Matrix) -> Array:
    return np.array(floats(read_plane(M) if space == "se2" else M))


def _edge(
    rng: np.random.Generator, space: str, convention: str, size: float, *, across: bool = False
) -> dict[str, Any]:
    """An edge that is off by ``size``; ``across``: its ends look to both sides of the half turn."""
    X_i, Z, off = (_drawn(rng, space, s) for s in (1.0, 1.0, size))
    if across:
        X_i[2], Z[2] = digits([rng.uniform(2.6, 3.0), rng.uniform(0.8, 1.2)])
    X_j = _small(space, _big(space, X_i) * _big(space, Z) * _big(space, off))
    X = (_big(space, X_i), _big(space, X_j), _big(space, Z))
    notes = [*OF_ERRORS, *(OF_LOG if convention == "log" else ())]
    if space != "sim3":
        notes.append("other-convention")
    if (space, convention) == ("se3", "g2o"):
        notes += ["quaternion-order", "whole-angle"]
    if across:
        notes = ["angle-not-wrapped"]
    wrong = {} if size < 1.0 else {note: edge(space, convention, X, note).doubles() for note in notes}
    inputs: dict[str, Any] = {"X_i": X_i, "X_j": X_j, "Z": Z}
    if space != "sim3":
        inputs["convention"] = convention
    case = {"inputs": inputs, "expected": edge(space, convention, X).doubles()}
    return {**case, "mistakes": wrong} if wrong else case


def _step(rng: np.random.Generator, convention: str) -> dict[str, Any]:
    """A ring of four poses of the plane with a chord, full information, poses off by a little."""
    X = [_drawn(rng, "se2") for _ in range(4)]
    Z = [_small("se2", plane(X[i]) ** -1 * plane(X[j]) * plane(_drawn(rng, "se2", 0.2))) for i, j in ENDS]
    half = rng.uniform(-0.6, 0.6, (len(ENDS), 3, 3)) + np.eye(3) * [1.0, 1.5, 2.0]
    Omega = half @ np.swapaxes(half, 1, 2)
    Omega = digits(0.5 * (Omega + np.swapaxes(Omega, 1, 2)))
    wrong = {note: _stepped(convention, X, Z, Omega, note) for note in OF_STEP}
    inputs = {"X": X, "tail": ENDS[:, 0], "head": ENDS[:, 1], "Z": Z, "information": Omega}
    right = _stepped(convention, X, Z, Omega)
    return {"inputs": {**inputs, "convention": convention}, "expected": right, "mistakes": wrong}


def _stepped(
    convention: str, X: list[Array], Z: list[Array], Omega: Array, wrong: str = ""
) -> dict[str, Any]:
    n = len(X)
    H, g, chi2 = mpmath.zeros(3 * n), mpmath.zeros(3 * n, 1), mpmath.mpf(0)
    for (i, j), z, given in zip(ENDS.tolist(), Z, Omega, strict=True):
        found = edge("se2", convention, (plane(X[i]), plane(X[j]), plane(z)))
        W, e = _weight(given, wrong), mpmath.matrix(found.e)
        J = mpmath.zeros(3, 3 * n)
        J[0:3, 3 * i : 3 * i + 3], J[0:3, 3 * j : 3 * j + 3] = found.J_i, found.J_j
        H, g, chi2 = H + J.T * W * J, g + J.T * W * e, chi2 + (e.T * W * e)[0]
    if wrong == "first-not-held":
        # the shortest solution: the gauge's directions G are taken out of H's kernel
        G = mpmath.matrix(_gauge(X))
        step = -((H + G * G.T) ** -1) * g
        step -= G * ((G.T * G) ** -1 * (G.T * step))
    else:
        step = mpmath.zeros(3 * n, 1)
        step[3:, 0] = -(H[3:, 3:] ** -1) * g[3:, 0]
    if wrong == "uphill":
        step = -step
    found_step = np.array(floats(column(step))).reshape(n, 3)
    return {"step": found_step, "chi2": float(chi2 / 2 if wrong == "chi2-halved" else chi2)}


def _weight(given: Array, wrong: str) -> Matrix:
    W = matrix(given)
    if wrong == "information-ignored":
        return mpmath.eye(3)
    if wrong == "information-inverted":
        return W**-1
    if wrong == "upper-triangle":
        return matrix(np.triu(given))
    return matrix(given[np.ix_([1, 2, 0], [1, 2, 0])]) if wrong == "blocks-swapped" else W


def _gauge(X: list[Array]) -> list[list[Any]]:
    """Steps on the right of all poses that move the world: Ad(X^-1) for each, one below the other."""
    rows: list[list[Any]] = []
    for x in X:
        rows += GROUPS["se2"].adjoint(plane(x) ** -1).tolist()
    return rows


def _start(rng: np.random.Generator) -> dict[str, Any]:
    """A ring of four poses in space with a chord, each edge off by a little."""
    X = [_big("se3", _drawn(rng, "se3")) for _ in range(4)]
    Z = np.stack([_small("se3", X[i] ** -1 * X[j] * _big("se3", _drawn(rng, "se3", 0.15))) for i, j in ENDS])
    kappa, tau = digits(rng.uniform(0.5, 4.0, (2, len(ENDS))))
    inputs = {"tail": ENDS[:, 0], "head": ENDS[:, 1], "Z": Z, "kappa": kappa, "tau": tau}
    wrong = {note: {"T": _started(Z, kappa, tau, note)} for note in OF_START}
    return {"inputs": inputs, "expected": {"T": _started(Z, kappa, tau)}, "mistakes": wrong}


def _started(Z: Array, kappa: Array, tau: Array, wrong: str = "") -> Array:
    """Rotations as matrices, projected; then positions; the first pose is the identity."""
    n = 4
    if wrong == "weights-ignored":
        kappa, tau = np.ones_like(kappa), np.ones_like(tau)
    A, B = mpmath.zeros(3 * len(ENDS), 3 * n), mpmath.zeros(3 * len(ENDS), 3 * n)
    for k, (i, j) in enumerate(ENDS.tolist()):
        root = mpmath.sqrt(mpmath.mpf(kappa[k]))
        R = matrix(Z[k, :3, :3])
        A[3 * k : 3 * k + 3, 3 * i : 3 * i + 3] = root * (R if wrong == "factors-exchanged" else R.T)
        A[3 * k : 3 * k + 3, 3 * j : 3 * j + 3] = -root * mpmath.eye(3)
    # unknowns are R^T one below the other; of exchanged factors, the matrices themselves
    free, held = A[:, 3:], A[:, 0:3]
    M = -((free.T * free) ** -1) * (free.T * held)
    rows = [mpmath.eye(3), *(M[3 * k : 3 * k + 3, 0:3] for k in range(n - 1))]
    raw = rows if wrong == "factors-exchanged" else [block.T for block in rows]
    R_world = raw if wrong == "not-projected" else [raw[0], *(polar(block) for block in raw[1:])]
    B, b = mpmath.zeros(len(ENDS), n), mpmath.zeros(len(ENDS), 3)
    for k, (i, j) in enumerate(ENDS.tolist()):
        root = mpmath.sqrt(mpmath.mpf(tau[k]))
        t = matrix(Z[k, :3, 3])
        B[k, i], B[k, j] = root, -root
        b[k, 0:3] = -root * (t if wrong == "steps-not-turned" else R_world[i] * t).T
    free = B[:, 1:]
    t_world = (free.T * free) ** -1 * (free.T * b)
    found = np.tile(np.eye(4), (n, 1, 1))
    for k in range(n):
        found[k, :3, :3] = floats(R_world[k])
        if k:
            found[k, :3, 3] = floats(column(t_world[k - 1, 0:3].T))
    return found

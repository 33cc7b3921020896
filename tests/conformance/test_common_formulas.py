"""No false alarm: correct formulas in common use pass, or lose digits where their widths say so; none fails.

Each function is written in several ways that programs really use, with the thresholds that they really have.
The same programs, rounded to single precision at their doors, pass the single profile.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from plain_motions import ad6, ad_plane, skew
from scipy.linalg import expm, logm
from scipy.spatial.transform import Rotation
from scipy.special import expit, logit
from vector_cases import loaded, some

from vslam_ref.conformance import vectors_format as form
from vslam_ref.conformance.adapters.table import answer_from, plain
from vslam_ref.conformance.compare import Profile, compare, is_asked
from vslam_ref.conformance.program import InProcess
from vslam_ref.conformance.vectors_format import Case

Array = Any
PI, TURN = np.pi, 2 * np.pi
Formula = Callable[..., Any]


def first_order(small: float, series: Callable[[float], float], closed: Callable[[float], float]) -> Any:
    """A closed form with a series below a threshold."""
    return lambda a: series(a) if abs(a) < small else closed(a)


SINC = first_order(1e-8, lambda a: 1 - a * a / 6, lambda a: np.sin(a) / a)
CHORD = first_order(1e-8, lambda a: a / 2, lambda a: (1 - np.cos(a)) / a)
HALF_COS = first_order(1e-8, lambda a: 0.5 - a * a / 24, lambda a: (1 - np.cos(a)) / a**2)
STABLE_COS = first_order(1e-8, lambda a: 0.5 - a * a / 24, lambda a: 2 * np.sin(a / 2) ** 2 / a**2)
THIRD = first_order(1e-5, lambda a: 1 / 6 - a * a / 120, lambda a: (a - np.sin(a)) / a**3)


# --- the plane


def looped(angle: float) -> float:
    while angle > PI:
        angle -= TURN
    while angle <= -PI:
        angle += TURN
    return angle


WRAPS: dict[str, Formula] = {
    "floor": lambda angle: angle - TURN * np.ceil((angle - PI) / TURN),
    "atan2": lambda angle: np.arctan2(np.sin(angle), np.cos(angle)),
    "modulo from above": lambda angle: PI - (PI - angle) % TURN,
    "remainder": lambda angle: float(np.remainder(angle + PI, TURN) - PI) if abs(angle) != PI else PI,
    "ieee": lambda angle: angle - TURN * np.rint(angle / TURN),
    "complex": lambda angle: np.angle(np.exp(1j * angle)),
    "loop": looped,
}


def plane_exp(xi: Array, sine: Any = SINC, chord: Any = CHORD) -> Array:
    x, y, a = xi
    return np.array([sine(a) * x - chord(a) * y, chord(a) * x + sine(a) * y, WRAPS["atan2"](a)])


def plane_log(x: Array) -> Array:
    """As in Sophus: a threshold of 1e-10 on 1 - cos."""
    a, less = x[2], np.cos(x[2]) - 1
    half = 1 - a * a / 12 if abs(less) < 1e-10 else -(a / 2 * np.sin(a)) / less
    return np.array([half * x[0] + a / 2 * x[1], -a / 2 * x[0] + half * x[1], a])


def plane_jacobian(xi: Array) -> Array:
    """The closed form of the left Jacobian, Sola (163), series below 1e-5."""
    x, y, a = xi
    if abs(a) < 1e-5:
        return np.eye(3) + ad_plane(xi) / 2 + ad_plane(xi) @ ad_plane(xi) / 6
    s, c = np.sin(a), np.cos(a)
    across = [(a * x + y - y * c - x * s) / a**2, (-x + a * y + x * c - y * s) / a**2]
    return np.array([[s / a, (c - 1) / a, across[0]], [(1 - c) / a, s / a, across[1]], [0, 0, 1]])


# --- rotations


def rodrigues(phi: Array, cosine: Any = HALF_COS) -> Array:
    a, K = np.linalg.norm(phi), skew(phi)
    return np.eye(3) + SINC(a) * K + cosine(a) * K @ K


def axis_angle(phi: Array) -> Array:
    a = np.linalg.norm(phi)
    if a < 1e-10:
        return np.eye(3) + skew(phi)
    n = phi / a
    return np.cos(a) * np.eye(3) + np.sin(a) * skew(n) + (1 - np.cos(a)) * np.outer(n, n)


def vee(R: Array) -> Array:
    return np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2


def log_by_cosine(R: Array) -> Array:
    """The arc cosine of the trace; within 1e-4 of a half turn the axis from R + I."""
    angle = np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1))
    if angle < 1e-4:
        return vee(R) * (1 + angle**2 / 6)
    return half_turn(R, angle) if PI - angle < 1e-4 else vee(R) * angle / np.sin(angle)


def half_turn(R: Array, angle: float) -> Array:
    """The largest column of the symmetric part; its angle by the arc tangent."""
    S = (R + R.T) / 2 + np.eye(3)
    k = int(np.argmax(np.diag(S)))
    axis = S[:, k] / np.linalg.norm(S[:, k])
    v = vee(R)
    axis = -axis if v @ axis < 0 else axis
    return axis * np.arctan2(np.linalg.norm(v), (np.trace(R) - 1) / 2)


def log_by_tangent(R: Array) -> Array:
    v = vee(R)
    sine, cosine = np.linalg.norm(v), (np.trace(R) - 1) / 2
    if sine < 1e-8:
        return v if cosine > 0 else half_turn(R, PI)
    return v * np.arctan2(sine, cosine) / sine


def quaternion_log(R: Array) -> Array:
    return Rotation.from_matrix(R).as_rotvec()


def jacobian(phi: Array, cosine: Any = HALF_COS) -> Array:
    a, K = np.linalg.norm(phi), skew(phi)
    return np.eye(3) + cosine(a) * K + THIRD(a) * K @ K


def jacobian_inverse(phi: Array) -> Array:
    a, K = np.linalg.norm(phi), skew(phi)
    if a < 1e-4:
        return np.eye(3) - K / 2 + K @ K / 12
    return np.eye(3) - K / 2 + (1 / a**2 - (1 + np.cos(a)) / (2 * a * np.sin(a))) * K @ K


def jacobian_inverse_by_cotangent(phi: Array) -> Array:
    a, K = np.linalg.norm(phi), skew(phi)
    if a < 1e-4:
        return np.eye(3) - K / 2 + K @ K / 12
    return np.eye(3) - K / 2 + (1 - a / 2 / np.tan(a / 2)) / a**2 * K @ K


def shepperd(R: Array) -> Array:
    squares = np.array([np.trace(R), *np.diag(R)])
    k = int(np.argmax(squares))
    if k == 0:
        w = np.sqrt(1 + np.trace(R)) / 2
        return np.array([w, *(vee(R) / (2 * w))])
    i = k - 1
    j, m = (i + 1) % 3, (i + 2) % 3
    q = np.zeros(4)
    q[k] = np.sqrt(1 + R[i, i] - R[j, j] - R[m, m]) / 2
    q[0] = (R[m, j] - R[j, m]) / (4 * q[k])
    q[j + 1], q[m + 1] = (R[j, i] + R[i, j]) / (4 * q[k]), (R[m, i] + R[i, m]) / (4 * q[k])
    return q


def by_w(R: Array) -> Array:
    """The largest entry only where w is small, as many programs have it."""
    return (
        shepperd(R)
        if np.trace(R) < -0.9999
        else np.array([w := np.sqrt(1 + np.trace(R)) / 2, *(vee(R) / (2 * w))])
    )


def from_quaternion(q: Array) -> Array:
    w, v = q[0], q[1:]
    return (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * skew(v)


# --- rigid motions and similarities


def rigid(R: Array, t: Array) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    return T


def rigid_exp(xi: Array) -> Array:
    return rigid(rodrigues(xi[3:]), jacobian(xi[3:]) @ xi[:3])


def rigid_log(T: Array, inverse: Formula = jacobian_inverse_by_cotangent) -> Array:
    phi = quaternion_log(T[:3, :3])
    return np.concatenate([inverse(phi) @ T[:3, 3], phi])


def rigid_log_by_solving(T: Array) -> Array:
    phi = quaternion_log(T[:3, :3])
    return np.concatenate([np.linalg.solve(jacobian(phi, STABLE_COS), T[:3, 3]), phi])


def barfoot(xi: Array) -> Array:
    """Q of Barfoot (7.86), series below 1e-3 where its quartic term has lost half of all digits."""
    rho, phi = skew(xi[:3]), skew(xi[3:])
    a = np.linalg.norm(xi[3:])
    if a < 1e-3:
        ad, J, term = ad6(xi), np.eye(6), np.eye(6)
        for k in range(1, 9):
            term = term @ ad / (k + 1)
            J = J + term
        return J
    c1 = (a - np.sin(a)) / a**3
    c2 = (a * a / 2 + np.cos(a) - 1) / a**4
    c3 = (c2 - 3 * (a - np.sin(a) - a**3 / 6) / a**5 * -1) / 2
    first = phi @ rho + rho @ phi + phi @ rho @ phi
    second = phi @ phi @ rho + rho @ phi @ phi - 3 * phi @ rho @ phi
    third = phi @ rho @ phi @ phi + phi @ phi @ rho @ phi
    Q = rho / 2 + c1 * first + c2 * second + c3 * third
    J = jacobian(xi[3:])
    return np.block([[J, Q], [np.zeros((3, 3)), J]])


def block_inverse(xi: Array) -> Array:
    J = barfoot(xi)
    inverse = np.linalg.inv(J[:3, :3])
    return np.block([[inverse, -inverse @ J[:3, 3:] @ inverse], [np.zeros((3, 3)), inverse]])


def by_logm(T: Array) -> Array:
    M = np.real(logm(T))
    return np.array([*M[:3, 3], M[2, 1], M[0, 2], M[1, 0]])


# --- losses, odds, linear systems, filters


def tukey(name: str, c: float, x: Array) -> Array:
    if name == "tukey":
        return np.where(np.abs(x) < c, c * c / 6 * (1 - (1 - (x / c) ** 2) ** 3), c * c / 6)
    if name == "cauchy":
        return c * c / 2 * np.log(1 + (x / c) ** 2)
    if name == "geman-mcclure":
        return c * c * (1 - 1 / (1 + (x / c) ** 2)) / 2
    raise NotImplementedError(name)


def update(x: Array, P: Array, ids: Any, z: Array, cov_z: Array, form: str) -> Any:
    """By the inverse of S, and three forms of the covariance."""
    m, n = len(ids), len(x)
    if m == 0:
        return {"x": x, "P": P}
    c, s = np.cos(x[2]), np.sin(x[2])
    A, H, h = np.array([[c, s], [-s, c]]), np.zeros((2 * m, n)), []
    for k, i in enumerate(np.asarray(ids, dtype=int)):
        at, d = slice(3 + 2 * i, 5 + 2 * i), A @ (x[3 + 2 * i : 5 + 2 * i] - x[:2])
        H[2 * k : 2 * k + 2, :2], H[2 * k : 2 * k + 2, 2] = -A, [d[1], -d[0]]
        H[2 * k : 2 * k + 2, at] = A
        h += d.tolist()
    N = np.kron(np.eye(m), cov_z)
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + N)
    L = np.eye(n) - K @ H
    kept = {"short": L @ P, "joseph": L @ P @ L.T + K @ N @ K.T, "half": (L @ P + (L @ P).T) / 2}[form]
    after = x + K @ (np.ravel(z) - h)
    after[2] = WRAPS["atan2"](after[2])
    return {"x": after, "P": kept}


FORMULAS: dict[str, dict[str, Formula]] = {
    "so2.wrap": WRAPS,
    "so2.exp": {"complex": lambda angle: (e := np.exp(1j * angle)) and [[e.real, -e.imag], [e.imag, e.real]]},
    "se2.exp": {
        "1 - cos": plane_exp,
        "half angle": lambda xi: plane_exp(
            xi, lambda a: np.sinc(a / PI), lambda a: a / 2 * np.sinc(a / TURN) ** 2
        ),
    },
    "se2.log": {"sophus": plane_log},
    "se2.left_jacobian": {"closed": plane_jacobian},
    "so3.exp": {
        "rodrigues": rodrigues,
        "half angle": lambda phi: rodrigues(phi, STABLE_COS),
        "axis and angle": axis_angle,
        "quaternion": lambda phi: Rotation.from_rotvec(phi).as_matrix(),
        "pade": lambda phi: expm(skew(phi)) if np.linalg.norm(phi) < 100 else rodrigues(phi),
    },
    "so3.log": {"arc cosine": log_by_cosine, "arc tangent": log_by_tangent, "quaternion": quaternion_log},
    "so3.left_jacobian": {"1 - cos": jacobian, "half angle": lambda phi: jacobian(phi, STABLE_COS)},
    "so3.left_jacobian_inverse": {
        "1 + cos": jacobian_inverse,
        "cotangent": jacobian_inverse_by_cotangent,
        "solved": lambda phi: np.linalg.inv(jacobian(phi, STABLE_COS)),
    },
    "so3.nearest": {
        "svd": lambda M: (s := np.linalg.svd(M))[0] @ np.diag([1, 1, np.linalg.det(s[0] @ s[2])]) @ s[2],
    },
    "quaternion.from_rotation": {"shepperd": shepperd, "by w": by_w},
    "quaternion.to_rotation": {"products": from_quaternion},
    "se3.exp": {"closed": rigid_exp},
    "se3.log": {
        "cotangent": rigid_log,
        "1 + cos": lambda T: rigid_log(T, jacobian_inverse),
        "solved": rigid_log_by_solving,
    },
    "se3.left_jacobian": {"barfoot": barfoot},
    "se3.left_jacobian_inverse": {"blocks": block_inverse, "inverse": lambda xi: np.linalg.inv(barfoot(xi))},
    "se3.inverse": {
        "general": lambda T: np.linalg.inv(T),
        "transposed": lambda T: rigid(T[:3, :3].T, -T[:3, :3].T @ T[:3, 3]),
    },
    "loss.cost": {"from one": tukey},
    "grid.log_odds": {
        "ratio": lambda probability: np.log(probability / (1 - probability)),
        "scipy": lambda probability: logit(probability),
    },
    "grid.probability": {
        "logistic": lambda log_odds: 1 / (1 + np.exp(-log_odds)),
        "scipy": lambda log_odds: expit(log_odds),
    },
    "least_squares.gauss_newton_step": {
        "normal": lambda J, r: -np.linalg.solve(J.T @ J, J.T @ r),
        "inverse": lambda J, r: -np.linalg.inv(J.T @ J) @ J.T @ r,
        "qr": lambda J, r: -np.linalg.lstsq(J, r, rcond=None)[0],
    },
    "least_squares.lm_step": {
        "normal": lambda J, r, damping, scale: (
            -np.linalg.solve(J.T @ J + damping * np.diag(scale**2), J.T @ r)
        ),
    },
    "least_squares.covariance": {
        "inverse": lambda J, r: r @ r / (len(r) - J.shape[1]) * np.linalg.inv(J.T @ J),
    },
    "ekf.update": {
        form: lambda form=form, **inputs: update(**inputs, form=form) for form in ("short", "joseph", "half")
    },
    "consistency.nees": {"inverse": lambda error, P: error @ np.linalg.inv(P) @ error},
}
FILE = {
    **dict.fromkeys(("so2", "so3", "se2", "se3", "quaternion"), "02"),
    **{"loss": "04", "grid": "19", "least_squares": "05", "ekf": "15", "consistency": "17"},
}


def single(value: Any) -> Any:
    """Numbers as single precision holds them."""
    if isinstance(value, dict):
        return {key: single(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [single(v) for v in value]
    with np.errstate(over="ignore"):
        return float(np.float32(value)) if isinstance(value, float) else value


def verdicts(table: dict[str, Formula], cases: list[Case], profile: Profile) -> dict[str, tuple[str, float]]:
    """Verdict and digits of each case that is answered."""
    found = {}
    for case in cases:
        if case.result != "valid" or case.statistic is not None or not is_asked(case, profile):
            continue
        try:
            inputs = single(case.inputs) if profile == "float32" else case.inputs
            with np.errstate(all="ignore"):
                answer = answer_from(table, case.function, inputs)
        except NotImplementedError:
            continue
        if not (isinstance(answer, dict) and set(answer) & set(case.expected)):
            answer = {next(iter(case.expected)): answer}
        answer = single(answer) if profile == "float32" else answer
        difference = compare(case, plain(answer), profile)
        found[case.id] = (difference.verdict, difference.digits)
    return found


WAYS = [(function, way) for function, ways in FORMULAS.items() for way in ways]


@pytest.mark.parametrize("profile", ["float64", "float32"])
@pytest.mark.parametrize(("function", "way"), WAYS)
def test_no_common_formula_fails(function: str, way: str, profile: Profile) -> None:
    if (way, profile) == ("arc cosine", "float32"):
        pytest.skip("its threshold near a half turn is one for doubles")
    topic = function.partition(".")[0]
    cases = some(f"{FILE[topic]}/{topic}.json", lambda case: case.function == function).cases
    found = verdicts({function: FORMULAS[function][way]}, cases, profile)
    assert {name: digits for name, (verdict, digits) in found.items() if verdict == "failed"} == {}
    counts = Counter(verdict for verdict, _ in found.values())
    assert counts["passed"] > counts["lost digits"]  # digits are lost at the edges only


LIBRARY = InProcess("vslam_ref.conformance.adapters.itself")


@pytest.mark.parametrize("name", form.names())
def test_doubles_rounded_at_the_doors_pass_in_single_precision(name: str) -> None:
    """A program that computes in double, and takes and gives single precision, is right."""
    failed = []
    for case in loaded(name).cases:
        if case.result == "valid" and case.statistic is None and is_asked(case, "float32"):
            reply = LIBRARY.ask(case.id, case.function, single(case.inputs))
            assert reply.what == "value", f"{case.id}: {reply.message}"
            value = reply.value
            if not (isinstance(value, dict) and set(value) & set(case.expected)):
                value = {next(iter(case.expected)): value}
            difference = compare(case, single(value), "float32")
            failed += [(case.id, difference.size, difference.allowed)] * (difference.verdict == "failed")
    assert failed == []

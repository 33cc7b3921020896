# ruff: noqa: E501
"""Well-known wrong formulas that the vectors themselves do not carry, each with its sentence.

A formula gets the inputs as arrays and gives what a program with this mistake answers; where it gives None,
the mistake makes no difference and the right answer stands.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.diagnosis.changes import FAILURES, library
from vslam_ref.conformance.diagnosis.evidence import Answer, Evidence, Guess, array, outputs
from vslam_ref.conformance.vectors_format import Case

Formula = Callable[..., Any]


def _motion(M: Array, t: Array) -> Array:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = M, t
    return out


def _hat(v: Array) -> Array:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def _weights(phi: Array) -> tuple[float, float, float]:
    """Sin x / x, (1 - cos x)/x^2, (x - sin x)/x^3, to rounding."""
    x = float(np.linalg.norm(phi))
    if x < 0.3:
        terms = [
            (-1) ** k * x ** (2 * k) / np.cumprod(np.arange(1.0, 2 * k + 4))[[2 * k, 2 * k + 1, 2 * k + 2]]
            for k in range(9)
        ]
        a, b, c = np.sum(terms, axis=0)
        return float(a), float(b), float(c)
    return np.sin(x) / x, 2 * (np.sin(x / 2) / x) ** 2, (x - np.sin(x)) / x**3


def _polynomial(phi: Array, p: float, q: float) -> Array:
    W = _hat(phi)
    return np.asarray(np.eye(3) + p * W + q * W @ W)


def _rotation(phi: Array) -> Array:
    a, b, _ = _weights(phi)
    return _polynomial(phi, a, b)


def _exp_with(xi: Array, p: float, q: float) -> Array:
    return _motion(_rotation(xi[3:]), _polynomial(xi[3:], p, q) @ xi[:3])


def _log_with(T: Array, right: Any, matrix: Callable[[Array], Any]) -> Array:
    phi = np.asarray(right["xi"], dtype=float)[3:]
    return np.concatenate([matrix(phi) @ T[:3, 3], phi])


def _from_trace(R: Array) -> Array | None:
    """The logarithm by arccos and the antisymmetric part, which is zero at a half turn."""
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    angle = np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1))
    size = np.linalg.norm(axis)
    return axis * angle / size if size > 0 else np.zeros(3)


def _nearest(M: Array) -> Array:
    U, _, Vt = np.linalg.svd(M)
    return np.asarray(U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt)


def _log(R: Array) -> Array:
    from vslam_ref.geometry import so3

    return so3.log(R)


def _fmod(angle: float) -> float:
    return float(np.fmod(angle + np.pi, 2 * np.pi) - np.pi)


def _per_coordinate(source: Array, target: Array, with_scale: Any, right: Any) -> float:
    return float(right["rmse"] / np.sqrt(np.shape(source)[1]))


EYE = np.eye(3)
FORMULAS: dict[str, dict[str, Formula]] = {
    "so2.wrap": {
        "wrapped by fmod, which keeps the sign of its argument: wrong below -pi": lambda angle, right: _fmod(angle),
        "fmod of the angle alone: in (-2 pi, 2 pi)": lambda angle, right: np.fmod(angle, 2 * np.pi),
        "wrapped by remainder of pi: off by half a turn": lambda angle, right: np.mod(angle, 2 * np.pi) - np.pi,
    },
    "so3.exp": {
        "the small-angle branch, I + hat(phi), is taken everywhere": lambda phi, right: EYE + _hat(phi),
        "(1 - cos) is used for (1 - cos)/angle^2": lambda phi, right: _polynomial(phi, _weights(phi)[0], 1 - np.cos(np.linalg.norm(phi))),
        "sin is used for sin/angle": lambda phi, right: _polynomial(phi, np.sin(np.linalg.norm(phi)), _weights(phi)[1]),
        "the sign of hat(phi)^2 is flipped": lambda phi, right: _polynomial(phi, _weights(phi)[0], -_weights(phi)[1]),
        "the term of hat(phi)^2 is left out": lambda phi, right: _polynomial(phi, _weights(phi)[0], 0.0),
    },
    "so3.log": {
        "the half-turn branch is missing: arccos of the trace and the antisymmetric part": lambda R, right: _from_trace(R),
        "a half turn gives zero": lambda R, right: np.zeros(3) if np.trace(R) < -1 + 1e-6 else None,
        "the angle by the arc sine: wrong beyond a right angle": lambda R, right: _by_sine(R),
    },
    "so3.left_jacobian": {
        "the right Jacobian is given": lambda phi, right: _polynomial(-phi, *_weights(phi)[1:]),
        "the exponential is given": lambda phi, right: _rotation(phi),
        "the inverse is given": lambda phi, right: np.linalg.inv(_polynomial(phi, *_weights(phi)[1:])),
        "the sign of hat(phi)^2 is flipped": lambda phi, right: _polynomial(phi, _weights(phi)[1], -_weights(phi)[2]),
        "the term of hat(phi)^2 is left out": lambda phi, right: _polynomial(phi, _weights(phi)[1], 0.0),
    },
    "so3.left_jacobian_inverse": {
        "the right Jacobian's inverse is given": lambda phi, right: np.transpose(right["J"]),
        "the Jacobian itself is given": lambda phi, right: _polynomial(phi, *_weights(phi)[1:]),
    },
    "so3.interpolate": {
        "entries are blended, (1 - u) a + u b: no rotation": lambda a, b, fraction, right: (1 - fraction) * a + fraction * b,
        "entries are blended and the nearest rotation taken: not at constant speed": lambda a, b, fraction, right: _nearest((1 - fraction) * a + fraction * b),
        "the step is applied on the left": lambda a, b, fraction, right: _rotation(fraction * _log(a.T @ b)) @ a,
        "b a^T from the right: the step is that of the other side": lambda a, b, fraction, right: a @ _rotation(fraction * _log(b @ a.T)),
    },
    "se3.exp": {
        "V has the wrong sign: the right Jacobian times rho": lambda xi, right: _exp_with(xi, -_weights(xi[3:])[1], _weights(xi[3:])[2]),
        "V has the wrong sign at hat(phi)^2": lambda xi, right: _exp_with(xi, _weights(xi[3:])[1], -_weights(xi[3:])[2]),
        "V is left out: t = rho": lambda xi, right: _exp_with(xi, 0.0, 0.0),
        "V is the rotation itself: t = R rho": lambda xi, right: _exp_with(xi, *_weights(xi[3:])[:2]),
        "V's inverse is taken for V": lambda xi, right: _motion(_rotation(xi[3:]), np.linalg.inv(_polynomial(xi[3:], *_weights(xi[3:])[1:])) @ xi[:3]),
        "V lacks the term of hat(phi)^2": lambda xi, right: _exp_with(xi, _weights(xi[3:])[1], 0.0),
    },
    "se3.log": {
        "V is taken for its inverse": lambda T, right: _log_with(T, right, lambda phi: _polynomial(phi, *_weights(phi)[1:])),
        "V has the wrong sign": lambda T, right: _log_with(T, right, lambda phi: np.linalg.inv(_polynomial(-phi, *_weights(phi)[1:]))),
        "the translation is turned back by the rotation": lambda T, right: _log_with(T, right, lambda phi: _rotation(-phi)),
        "the translation is copied: rho = t": lambda T, right: _log_with(T, right, lambda phi: EYE),
    },
    "se3.inverse": {
        "the translation is -R t, turned forward; right is -R^T t": lambda T, right: _motion(T[:3, :3].T, -T[:3, :3] @ T[:3, 3]),
        "the translation is R^T t, without its minus sign": lambda T, right: _motion(T[:3, :3].T, T[:3, :3].T @ T[:3, 3]),
        "the rotation is not transposed": lambda T, right: _motion(T[:3, :3], -T[:3, :3].T @ T[:3, 3]),
        "the rotation stays, the translation is negated": lambda T, right: _motion(T[:3, :3], -T[:3, 3]),
    },
    "se3.act": {
        "the inverse motion is applied": lambda T, x, right: T[:3, :3].T @ (x - T[:3, 3]),
        "the translation is subtracted": lambda T, x, right: T[:3, :3] @ x - T[:3, 3],
        "the translation is left out": lambda T, x, right: T[:3, :3] @ x,
    },
    "se3.compose": {
        "the translations are added, t_b is not turned": lambda a, b, right: _motion(a[:3, :3] @ b[:3, :3], a[:3, 3] + b[:3, 3]),
        "t_b is turned by R_b": lambda a, b, right: _motion(a[:3, :3] @ b[:3, :3], b[:3, :3] @ b[:3, 3] + a[:3, 3]),
    },
    "se3.adjoint": {
        "the rotation-first adjoint: hat(t) R stands below": lambda T, right: np.block([[T[:3, :3], 0 * EYE], [_hat(T[:3, 3]) @ T[:3, :3], T[:3, :3]]]),
        "the sign of hat(t) R is flipped": lambda T, right: np.block([[T[:3, :3], -_hat(T[:3, 3]) @ T[:3, :3]], [0 * EYE, T[:3, :3]]]),
    },
    "multiview.pose_from_centre": {
        "the centre is taken for the translation; right is t = -R p": lambda R_cam_world, p_world, right: _motion(R_cam_world, p_world),
        "t = R p, without its minus sign": lambda R_cam_world, p_world, right: _motion(R_cam_world, R_cam_world @ p_world),
        "t = -R^T p, turned the wrong way": lambda R_cam_world, p_world, right: _motion(R_cam_world, -R_cam_world.T @ p_world),
        "t = -p, not turned": lambda R_cam_world, p_world, right: _motion(R_cam_world, -p_world),
    },
    "multiview.camera_from_world": {
        "the centre is taken for the translation: R X + p": lambda R_cam_world, p_world, X_world, right: X_world @ R_cam_world.T + p_world,
        "R X - p: the centre is not turned": lambda R_cam_world, p_world, X_world, right: X_world @ R_cam_world.T - p_world,
    },
    "multiview.alignment_error": {
        "the root mean square of single coordinates, not of distances": _per_coordinate,
        "the root of the sum over coordinates and points times 1/(n - 1)": lambda source, target, with_scale, right: right["rmse"] * np.sqrt(len(source) / (len(source) - 1)),
        "the square is given, without the root": lambda source, target, with_scale, right: right["rmse"] ** 2,
    },
    "loss.cost": {
        "Huber's cost beyond c is c (|x| - c), without the half": lambda name, c, x, right: _huber(name, c, x, lambda a: c * (a - c)),
        "Huber's cost beyond c is c |x|, without its offset c^2/2": lambda name, c, x, right: _huber(name, c, x, lambda a: c * a),
        "Huber's cost within c is x^2, without the half": lambda name, c, x, right: np.where(np.abs(x) <= c, x * x, right["value"]) if name == "huber" else None,
        "Huber's cost is twice the right one": lambda name, c, x, right: 2 * np.asarray(right["value"]) if name == "huber" else None,
    },
    "consistency.band": {
        "the band is not divided by the runs, but by the degrees of freedom": lambda runs, dof, confidence, right: {k: v * runs / dof for k, v in right.items()},
        "the band is divided by the degrees of freedom as well": lambda runs, dof, confidence, right: {k: v / dof for k, v in right.items()},
        "a band of runs - 1": lambda runs, dof, confidence, right: _chi2_band((runs - 1) * dof, confidence, runs),
    },
    "ekf.augment": {
        "the sensor's noise is turned the wrong way: R^T C R": lambda x, P, z, cov_z, right: _augmented(x, P, cov_z, right),
    },
}  # fmt: skip
"""Function -> sentence -> what a program with this mistake answers."""


def _by_sine(R: Array) -> Array | None:
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    size = np.linalg.norm(axis)
    return axis * np.arcsin(min(float(size), 1.0)) / size if size > 0 else None


def _huber(name: str, c: float, x: Array, beyond: Callable[[Array], Array]) -> Array | None:
    a = np.abs(x)
    return np.where(a > c, beyond(a), x * x / 2) if name == "huber" else None


def _chi2_band(dof: float, confidence: float, runs: float) -> dict[str, float]:
    from scipy.stats import chi2

    tail = (1 - confidence) / 2
    return {"low": float(chi2.ppf(tail, dof)) / runs, "high": float(chi2.isf(tail, dof)) / runs}


def _augmented(x: Array, P: Array, cov_z: Array, right: Any) -> dict[str, Any]:
    c, s = np.cos(x[2]), np.sin(x[2])
    R, out = np.array([[c, -s], [s, c]]), np.array(right["P"], dtype=float)
    out[-2:, -2:] += R.T @ cov_z @ R - R @ cov_z @ R.T
    return {"x": right["x"], "P": out.tolist()}


def formulas(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """Wrong formulas of this function."""
    for sentence, formula in FORMULAS.get(evidence.function.name, {}).items():
        yield sentence, _of(evidence, formula)
    if evidence.function.name == "multiview.umeyama":
        yield "the wrong way round: source and target are exchanged", _umeyama_back(evidence)


def _of(evidence: Evidence, formula: Formula) -> Guess:
    def guess(case: Case, got: Answer) -> Answer | None:
        given = {
            k: v if isinstance(v, str | bool) or array(v) is None else array(v)
            for k, v in case.inputs.items()
        }
        try:
            with np.errstate(all="ignore"):
                found = formula(**given, right=case.expected)
        except FAILURES:
            return None
        if found is None:
            return case.expected
        answer = outputs(found, evidence.function)
        return answer and {k: np.asarray(v).tolist() for k, v in answer.items()}

    return guess


def _umeyama_back(evidence: Evidence) -> Guess:
    def guess(case: Case, got: Answer) -> Answer | None:
        given = case.inputs
        return library(evidence, {**given, "source": given["target"], "target": given["source"]})

    return guess

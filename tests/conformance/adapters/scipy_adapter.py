"""SciPy under the vectors: ``spatial.transform``, ``linalg``, ``optimize``, ``special`` and ``stats``.

Its convention stands in ``scipy_convention.json``: quaternions x y z w, tangent vectors of
``RigidTransform`` rotation first.

The derivative of an exponential is ``linalg.expm_frechet``: exact for any group of matrices, so Jacobians and
adjoints of all groups are one function each (:class:`Group`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, optimize, special, stats
from scipy.spatial import distance
from scipy.spatial.transform import Rotation, Slerp

from vslam_ref.conformance.adapters.table import Answers, answer_from

Array = NDArray[np.float64]


def answer(function: str, inputs: dict[str, Any]) -> Any:
    """Answer one question with SciPy."""
    return answer_from(TABLE, function, inputs)


# --- chapter 2 ---------------------------------------------------------------------------------


class Group(NamedTuple):
    """A group of matrices: from a tangent vector to the matrix whose exponential it is, and back."""

    hat: Callable[[Any], Array]
    vee: Callable[[Array], Array]
    dim: int

    def exp(self, xi: Array) -> Array:
        """Exponential of a tangent vector."""
        return np.asarray(linalg.expm(self.hat(xi)))

    def log(self, T: Array) -> Array:
        """Principal logarithm."""
        return self.vee(np.real(linalg.logm(T)))

    def left_jacobian(self, xi: Array) -> Array:
        """Column k: the derivative of Exp along e_k, times Exp(-xi)."""
        H, back = self.hat(xi), linalg.expm(-self.hat(xi))
        slopes = [linalg.expm_frechet(H, self.hat(e), compute_expm=False) for e in np.eye(self.dim)]
        return np.stack([self.vee(slope @ back) for slope in slopes], axis=1)

    def left_jacobian_inverse(self, xi: Array) -> Array:
        """Inverse of the left Jacobian."""
        return np.asarray(linalg.inv(self.left_jacobian(xi)))

    def adjoint(self, T: Array) -> Array:
        """Column k: T hat(e_k) T^-1."""
        back = linalg.inv(T)
        return np.stack([self.vee(T @ self.hat(e) @ back) for e in np.eye(self.dim)], axis=1)


def _cross(w: Array) -> Array:
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def _uncross(W: Array) -> Array:
    return np.array([W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]]) / 2.0


def _bordered(A: Array, column: Array) -> Array:
    M = np.zeros((len(A) + 1, len(A) + 1))
    M[:-1, :-1], M[:-1, -1] = A, column
    return M


SO3 = Group(_cross, _uncross, 3)
SE2 = Group(
    lambda xi: _bordered(np.array([[0.0, -xi[2]], [xi[2], 0.0]]), xi[:2]),
    lambda M: np.array([M[0, 2], M[1, 2], (M[1, 0] - M[0, 1]) / 2.0]),
    3,
)
SE3 = Group(lambda xi: _bordered(_cross(xi[:3]), xi[3:]), lambda M: np.r_[_uncross(M[:3, :3]), M[:3, 3]], 6)
SIM3 = Group(
    lambda xi: _bordered(xi[6] * np.eye(3) + _cross(xi[:3]), xi[3:6]),
    lambda M: np.r_[_uncross(M[:3, :3]), M[:3, 3], np.trace(M[:3, :3]) / 3.0],
    7,
)
"""SE(3) and Sim(3) have the rotation first, as ``RigidTransform`` has."""


def _plane(x: Array) -> Array:
    T = np.eye(3)
    T[:2, :2], T[:2, 2] = linalg.expm(x[2] * np.array([[0.0, -1.0], [1.0, 0.0]])), x[:2]
    return T


def _plane_pose(T: Array) -> Array:
    return np.array([T[0, 2], T[1, 2], np.arctan2(T[1, 0], T[0, 0])])


def _wrap(angle: float) -> float:
    return float(stats.circmean([angle], high=np.pi, low=-np.pi))


def _rigid(T: Array) -> Any:
    """SciPy's rigid transform, since 1.16."""
    try:
        from scipy.spatial.transform import RigidTransform
    except ImportError:
        raise NotImplementedError("this SciPy has no RigidTransform") from None
    return RigidTransform.from_matrix(T)


def _rigid_exp(xi: Array) -> Array:
    return np.asarray(type(_rigid(np.eye(4))).from_exp_coords(xi).as_matrix())


def _between(a: Array, b: Array, fraction: float) -> Array:
    return np.asarray(Slerp([0.0, 1.0], Rotation.from_matrix(np.stack([a, b])))(fraction).as_matrix())


def _motion_between(a: Array, b: Array, fraction: float) -> Array:
    start = _rigid(a)
    return np.asarray((start * (start.inv() * _rigid(b)) ** fraction).as_matrix())


GROUPS: Answers = {
    "so2.exp": lambda angle: linalg.expm(angle * np.array([[0.0, -1.0], [1.0, 0.0]])),
    "so2.wrap": lambda angle: _wrap(angle),
    "se2.exp": lambda xi: _plane_pose(SE2.exp(xi)),
    "se2.log": lambda x: SE2.log(_plane(x)),
    "se2.compose": lambda a, b: _plane_pose(_plane(a) @ _plane(b)),
    "se2.inverse": lambda x: _plane_pose(linalg.inv(_plane(x))),
    "se2.adjoint": lambda x: SE2.adjoint(_plane(x)),
    "se2.left_jacobian": lambda xi: SE2.left_jacobian(xi),
    "so3.exp": lambda phi: Rotation.from_rotvec(phi).as_matrix(),
    "so3.log": lambda R: Rotation.from_matrix(R).as_rotvec(),
    "so3.left_jacobian": lambda phi: SO3.left_jacobian(phi),
    "so3.left_jacobian_inverse": lambda phi: SO3.left_jacobian_inverse(phi),
    "so3.interpolate": _between,
    "so3.nearest": lambda M: Rotation.from_matrix(M).as_matrix(),
    "so3.random": lambda N: Rotation.random(int(N)).as_matrix(),
    "quaternion.from_rotation": lambda R: Rotation.from_matrix(R).as_quat(),
    "quaternion.to_rotation": lambda q: Rotation.from_quat(q).as_matrix(),
    "se3.exp": _rigid_exp,
    "se3.log": lambda T: _rigid(T).as_exp_coords(),
    "se3.compose": lambda a, b: (_rigid(a) * _rigid(b)).as_matrix(),
    "se3.inverse": lambda T: _rigid(T).inv().as_matrix(),
    "se3.act": lambda T, x: _rigid(T).apply(x),
    "se3.adjoint": lambda T: SE3.adjoint(T),
    "se3.left_jacobian": lambda xi: SE3.left_jacobian(xi),
    "se3.left_jacobian_inverse": lambda xi: SE3.left_jacobian_inverse(xi),
    "se3.interpolate": _motion_between,
    "sim3.exp": lambda xi: SIM3.exp(xi),
    "sim3.log": lambda S: SIM3.log(S),
    "sim3.inverse": lambda S: linalg.inv(S),
    "sim3.adjoint": lambda S: SIM3.adjoint(S),
}


# --- chapters 1, 4, 5, 6 -----------------------------------------------------------------------


def _umeyama(source: Array, target: Array, with_scale: bool) -> dict[str, Any]:
    if with_scale:
        raise NotImplementedError("align_vectors has no scale")
    a, b = source.mean(0), target.mean(0)
    R = Rotation.align_vectors(target - b, source - a)[0].as_matrix()
    return {"scale": 1.0, "R": R, "t": b - R @ a}


def _optimal(T_cams: Array, params: Array, uv: Array) -> dict[str, Any]:
    """Least squares over the point, from the linear solution."""

    def residuals(X: Array) -> Array:
        seen = T_cams[:, :3, :3] @ X + T_cams[:, :3, 3]
        return np.ravel(params[:2] * seen[:, :2] / seen[:, 2:] + params[2:4] - uv)

    xn = (uv - params[2:4]) / params[:2]
    rows = np.concatenate([x[:, None] * T[2:3] - T[:2] for x, T in zip(xn, T_cams[:, :3], strict=True)])
    start = linalg.lstsq(rows[:, :3], -rows[:, 3])[0]
    found = optimize.least_squares(residuals, start, jac="3-point", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    return {"X": found.x, "covariance": linalg.inv(found.jac.T @ found.jac)}


def _robust(name: str, c: float, x: Array) -> Any:
    """A one-dimensional problem f(p) = x + p at p = 0, for each x: SciPy's cost and gradient."""
    losses = {"l2": "linear", "huber": "huber", "cauchy": "cauchy"}
    if name not in losses:
        raise NotImplementedError(name)
    options = {"jac": lambda p: np.ones((1, 1)), "loss": losses[name], "f_scale": c, "max_nfev": 1}
    starts = [optimize.least_squares(lambda p, at=at: p + at, [0.0], **options) for at in np.atleast_1d(x)]
    return np.array([s.cost for s in starts]), np.array([s.grad[0] for s in starts])


def _zero(*_: Any, **__: Any) -> float:
    """The centre, where a median would stand."""
    return 0.0


def _lm_step(J: Array, r: Array, damping: float, scale: Array) -> Array:
    stacked = np.concatenate([J, np.sqrt(damping) * np.diag(scale)])
    return np.asarray(linalg.lstsq(stacked, -np.concatenate([r, 0.0 * scale]))[0])


def _blocks(C: Array) -> Array:
    """One matrix from the diagonal blocks (n, 3, 3)."""
    return C if C.ndim == 2 else np.asarray(linalg.block_diag(*C))


def _schur(B: Array, W: Array, C: Array, g_view: Array, g_point: Array) -> dict[str, Array]:
    factor = linalg.cho_factor(_blocks(C))
    S = B - W @ linalg.cho_solve(factor, W.T)
    return {"S": S, "rhs": -g_view + W @ linalg.cho_solve(factor, g_point.ravel())}


def _back(W: Array, C: Array, g_point: Array, view_step: Array) -> Array:
    step = -linalg.cho_solve(linalg.cho_factor(_blocks(C)), g_point.ravel() + W.T @ view_step)
    return np.asarray(step).reshape(g_point.shape)


ESTIMATION: Answers = {
    "multiview.umeyama": _umeyama,
    "multiview.triangulate_optimal": _optimal,
    "loss.cost": lambda name, c, x: _robust(name, c, x)[0],
    "loss.influence": lambda name, c, x: _robust(name, c, x)[1],
    "scale.mad": lambda errors: stats.median_abs_deviation(errors, center=_zero, scale="normal"),
    "scale.norm": lambda errors: np.median(linalg.norm(errors, axis=1)) / stats.rayleigh.median(),
    "least_squares.gauss_newton_step": lambda J, r: linalg.lstsq(J, -r)[0],
    "least_squares.lm_step": _lm_step,
    "bundle.schur": _schur,
    "bundle.back_substitute": _back,
}


# --- chapters 17, 19, 23 -----------------------------------------------------------------------


def _band(runs: int, dof: int, confidence: float) -> dict[str, float]:
    low, high = stats.chi2(runs * dof).interval(confidence)
    return {"low": low / runs, "high": high / runs}


def _ate(estimate: Array, truth: Array, align: str) -> dict[str, float]:
    if align == "sim3":
        raise NotImplementedError("align_vectors has no scale")
    if align == "se3":
        found = _umeyama(estimate, truth, False)
        estimate = estimate @ found["R"].T + found["t"]
    errors = linalg.norm(estimate - truth, axis=1)
    values = {"mean": errors.mean(), "median": np.median(errors), "max": errors.max(), "scale": 1.0}
    return {"rmse": np.sqrt((errors**2).mean()), **values}


def _rpe(estimate: Array, truth: Array) -> dict[str, float]:
    a, b = _rigid(estimate), _rigid(truth)
    error = (b[:-1].inv() * b[1:]).inv() * (a[:-1].inv() * a[1:])
    degrees = np.degrees(error.rotation.magnitude())
    moved = linalg.norm(error.translation, axis=1)
    return {"trans_rmse": np.sqrt((moved**2).mean()), "rot_rmse_deg": np.sqrt((degrees**2).mean())}


JUDGING: Answers = {
    "consistency.nees": lambda error, P: distance.mahalanobis(error, 0.0 * error, linalg.inv(P)) ** 2,
    "consistency.band": _band,
    "consistency.bound": lambda runs, dof, confidence: stats.chi2(runs * dof).ppf(confidence) / runs,
    "grid.log_odds": lambda probability: special.logit(probability),
    "grid.probability": lambda log_odds: special.expit(log_odds),
    "grid.update": lambda prior, measured: special.logit(prior) + special.logit(measured),
    "trajectory.ate": _ate,
    "trajectory.rpe": _rpe,
}

TABLE: Answers = {**GROUPS, **ESTIMATION, **JUDGING}

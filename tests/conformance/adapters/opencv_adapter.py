"""OpenCV under the vectors: what a user of ``cv2`` gets, in the order of the chapters.

No convention file is needed: OpenCV's pose is T_cam_world, its pixel (0, 0) a centre.  It has no tangent
vectors of poses: its Jacobians are those in a rotation vector and a translation that are *added* to, and
``composeRT`` is what turns them into ours (:func:`_left`).

What it reveals stands in ``docs/what-the-vectors-found.md``.
"""

from __future__ import annotations

from typing import Any

import cv2 as untyped
import numpy as np
from motion_models import drive, heading_wrapped, sight
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers, answer_from

cv2: Any = untyped  # its stubs know neither float64 nor optional arguments
Array = NDArray[np.float64]
ZERO = np.zeros(3)
FINE = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 1000, 1e-15)
"""Stop an inverse distortion after so many iterations, or at such a step."""


def answer(function: str, inputs: dict[str, Any]) -> Any:
    """Answer one question with OpenCV."""
    return answer_from(TABLE, function, inputs)


# --- chapter 2: rotations and motions ----------------------------------------------------------


def _vector(R: Array) -> Array:
    return np.asarray(cv2.Rodrigues(R)[0]).ravel()


def _matrix(rvec: Array) -> Array:
    return np.asarray(cv2.Rodrigues(rvec)[0])


def _rt(T: Array) -> tuple[Array, Array]:
    return _vector(T[:3, :3]), np.ascontiguousarray(T[:3, 3])


def motion(rvec: Array, tvec: Array) -> Array:
    """4 x 4 matrix of OpenCV's two vectors."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = _matrix(rvec), np.ravel(tvec)
    return T


def _left_jacobian(phi: Array) -> dict[str, Array]:
    """From the 3 x 9 derivative of R: dR/dphi_k R^T = hat(J e_k)."""
    R, slopes = cv2.Rodrigues(phi)
    columns = [slope.reshape(3, 3) @ R.T for slope in np.asarray(slopes)]
    return {"J": np.stack([[W[2, 1], W[0, 2], W[1, 0]] for W in columns], axis=1)}


def _left(rvec: Array, tvec: Array) -> tuple[Array, Array]:
    """Derivatives (3, 6) of rvec and tvec in xi = (rho, phi) of Exp(xi) T, at xi = 0."""
    _, _, _, _, dr_dphi, dr_drho, _, _, dt_dphi, dt_drho = cv2.composeRT(rvec, tvec, ZERO, ZERO)
    return np.hstack([dr_drho, dr_dphi]), np.hstack([dt_drho, dt_dphi])


def _left_jacobian_inverse(phi: Array) -> Array:
    if np.linalg.norm(phi) > np.pi:
        raise NotImplementedError("composeRT shortens the vector first")
    return _left(phi, ZERO)[0][:, 3:]


def _compose(a: Array, b: Array) -> Array:
    rvec, tvec = cv2.composeRT(*_rt(b), *_rt(a))[:2]
    return motion(rvec, tvec)


def _between(a: Array, b: Array, fraction: float) -> Array:
    return a @ _matrix(fraction * _vector(a.T @ b))


def _apply(T: Array, x: Array) -> Array:
    return np.asarray(cv2.transform(x.reshape(1, 1, 3), T[:3])).ravel()


def _plane_rotation(angle: float) -> Array:
    return np.asarray(cv2.getRotationMatrix2D((0.0, 0.0), float(np.degrees(angle)), 1.0)[:, :2])


def _phase(angle: float) -> float:
    return float(cv2.phase(np.array([[np.cos(angle)]]), np.array([[np.sin(angle)]]))[0, 0])


MOTIONS: Answers = {
    "so2.exp": _plane_rotation,
    "so2.wrap": _phase,
    "so3.exp": lambda phi: _matrix(phi),
    "so3.log": lambda R: _vector(R),
    "so3.left_jacobian": _left_jacobian,
    "so3.left_jacobian_inverse": _left_jacobian_inverse,
    "so3.interpolate": _between,
    "so3.nearest": lambda M: _matrix(_vector(M)),
    "se3.compose": _compose,
    "se3.act": _apply,
    "sim3.act": lambda S, x: _apply(S, x),
}


# --- chapter 3: cameras ------------------------------------------------------------------------


def camera_matrix(model: str, params: Array) -> tuple[Array, Array]:
    """Camera matrix, and distortion coefficients."""
    if model not in ("pinhole", "radtan", "rational", "fisheye"):
        raise NotImplementedError(model)
    K = np.array([[params[0], 0.0, params[2]], [0.0, params[1], params[3]], [0.0, 0.0, 1.0]])
    return K, params[4:] if len(params) > 4 else np.zeros(4)


def _projected(
    model: str, params: Array, X: Array, rvec: Array = ZERO, tvec: Array = ZERO
) -> tuple[Array, dict[str, Array]]:
    """Pixel (2,) of a point, and its Jacobians in the pose's two vectors and in fx fy cx cy k."""
    K, k = camera_matrix(model, params)
    point = X.reshape(1, 1, 3)
    if model == "fisheye":  # columns f, c, k, rvec, tvec, skew
        uv, J = cv2.fisheye.projectPoints(point, rvec, tvec, K, k)
        return uv.ravel(), {"params": J[:, :8], "rvec": J[:, 8:11], "tvec": J[:, 11:14]}
    uv, J = cv2.projectPoints(point, rvec, tvec, K, k)  # columns rvec, tvec, f, c, k
    return uv.ravel(), {"params": J[:, 6 : 6 + len(params)], "rvec": J[:, :3], "tvec": J[:, 3:6]}


def _project(model: str, params: Array, X_cam: Array) -> dict[str, Any]:
    uv = _projected(model, params, X_cam)[0]
    return {"uv": uv, "valid": bool(np.isfinite(uv).all())}


def _unproject(model: str, params: Array, uv: Array) -> dict[str, Any]:
    K, k = camera_matrix(model, params)
    undistort = cv2.fisheye.undistortPoints if model == "fisheye" else cv2.undistortPoints
    x = np.ravel(undistort(uv.reshape(1, 1, 2), K, k, criteria=FINE))
    ray = np.array([*x, 1.0])
    return {"bearing": ray / np.linalg.norm(ray), "valid": bool(np.isfinite(x).all())}


def _jacobian_pose(model: str, params: Array, pose: Array, X_world: Array) -> Array:
    rvec, tvec = _rt(pose)
    J = _projected(model, params, X_world, rvec, tvec)[1]
    dr, dt = _left(rvec, tvec)
    return np.asarray(J["rvec"] @ dr + J["tvec"] @ dt)


def _jacobian_rig(model: str, params: Array, T_cam_rig: Array, pose: Array, X_world: Array) -> Array:
    rig = _rt(pose)
    rvec, tvec, dr_dr, dr_dt, _, _, dt_dr, dt_dt, _, _ = cv2.composeRT(*rig, *_rt(T_cam_rig))
    J = _projected(model, params, X_world, rvec, tvec)[1]
    dr, dt = _left(*rig)
    return np.asarray(J["rvec"] @ (dr_dr @ dr + dr_dt @ dt) + J["tvec"] @ (dt_dr @ dr + dt_dt @ dt))


CAMERAS: Answers = {
    "camera.project": _project,
    "camera.unproject": _unproject,
    "camera.jacobian_point": lambda model, params, X_cam: _projected(model, params, X_cam)[1]["tvec"],
    "camera.jacobian_intrinsics": lambda model, params, X_cam: _projected(model, params, X_cam)[1]["params"],
    "camera.jacobian_pose": _jacobian_pose,
    "camera.jacobian_rig": _jacobian_rig,
}


# --- chapter 1: several views ------------------------------------------------------------------


def _pair(T_cams: Array, x: Array) -> dict[str, Any]:
    """Linear triangulation from the first and the last view; x (V, 2) normalised."""
    X = cv2.triangulatePoints(T_cams[0, :3], T_cams[-1, :3], x[0].reshape(2, 1), x[-1].reshape(2, 1))
    return {"X": (X[:3] / X[3]).ravel()}


def _optimal(T_cams: Array, params: Array, uv: Array) -> dict[str, Any]:
    """Two views: ``correctMatches``, then linear; the covariance from the Jacobians of ``projectPoints``."""
    if len(T_cams) != 2:
        raise NotImplementedError("OpenCV triangulates two views")
    K, _ = camera_matrix("pinhole", params)
    T_b_a = T_cams[1] @ np.linalg.inv(T_cams[0])
    x, y, z = T_b_a[:3, 3]
    E = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ T_b_a[:3, :3]
    inverse = np.linalg.inv(K)
    a, b = cv2.correctMatches(inverse.T @ E @ inverse, uv[:1].reshape(1, 1, 2), uv[1:].reshape(1, 1, 2))
    pixels = np.concatenate([a.reshape(1, 2), b.reshape(1, 2)])
    X = _pair(T_cams, (pixels - params[2:4]) / params[:2])["X"]
    J = np.concatenate([_projected("pinhole", params, _apply(T, X))[1]["tvec"] @ T[:3, :3] for T in T_cams])
    return {"X": X, "covariance": np.linalg.inv(J.T @ J)}


def _pnp(params: Array, X_world: Array, uv: Array) -> Array:
    K, k = camera_matrix("pinhole", params)
    found, rvec, tvec = cv2.solvePnP(X_world, uv, K, k, flags=cv2.SOLVEPNP_SQPNP)
    if not found:
        raise ValueError("solvePnP finds no pose")
    rvec, tvec = cv2.solvePnPRefineLM(X_world, uv, K, k, rvec, tvec)
    return motion(rvec, tvec)


def _p3p(bearings: Array, X_world: Array) -> dict[str, Any]:
    if not (bearings[:, 2] > 0).all():
        raise NotImplementedError("OpenCV takes pixels")
    x = np.ascontiguousarray(bearings[:, :2] / bearings[:, 2:])
    count, rvecs, tvecs = cv2.solveP3P(X_world, x, np.eye(3), np.zeros(4), flags=cv2.SOLVEPNP_P3P)
    return {"poses": [motion(r, t) for r, t in zip(rvecs[:count], tvecs[:count], strict=True)]}


def _umeyama(source: Array, target: Array, with_scale: bool) -> dict[str, Any]:
    if not with_scale:
        raise NotImplementedError("Python cannot ask for scale 1")
    T, scale = cv2.estimateAffine3D(source, target, force_rotation=True)
    return {"scale": scale, "R": T[:, :3], "t": T[:, 3]}


VIEWS: Answers = {
    "multiview.triangulate": lambda T_cams, bearings: _pair(T_cams, bearings[:, :2] / bearings[:, 2:]),
    "multiview.triangulate_optimal": _optimal,
    "multiview.pnp": _pnp,
    "multiview.p3p": _p3p,
    "multiview.umeyama": _umeyama,
}


# --- chapters 5, 6, 15, 17, 19, 23 -------------------------------------------------------------


def _solve(A: Array, b: Array) -> Array:
    return np.asarray(cv2.solve(A, b.reshape(-1, 1), flags=cv2.DECOMP_SVD)[1]).ravel()


def _lm_step(J: Array, r: Array, damping: float, scale: Array) -> Array:
    stacked = np.concatenate([J, np.sqrt(damping) * np.diag(scale)])
    return _solve(stacked, -np.concatenate([r, 0.0 * scale]))


def _cost(model: str, params: Array, pose: Array, X_world: Array, uv: Array, cov: Array) -> float:
    def one(X: Array, z: Array, C: Array) -> float:
        predicted = _projected(model, params, X, *_rt(pose))[0]
        return 0.5 * float(cv2.Mahalanobis(predicted, z, cv2.invert(C)[1])) ** 2

    return sum(map(one, X_world.reshape(-1, 3), uv.reshape(-1, 2), cov.reshape(-1, 2, 2)))


def _residual(model: str, params: Array, pose: Array, X_world: Array, uv: Array) -> Array:
    points = X_world.reshape(-1, 3)
    predicted = np.stack([_projected(model, params, X, *_rt(pose))[0] for X in points])
    return predicted.reshape(uv.shape) - uv


def _filter(x: Array, P: Array, measured: int) -> Any:
    kalman = cv2.KalmanFilter(len(x), measured, 0, cv2.CV_64F)
    kalman.statePost = kalman.statePre = x.reshape(-1, 1)
    kalman.errorCovPost = kalman.errorCovPre = P
    return kalman


def _ekf_predict(
    x: Array, P: Array, control: Array, cov_u: Array, wheelbase: float, dt: float
) -> dict[str, Any]:
    moved, F, Q = drive(x, control, cov_u, wheelbase, dt)
    kalman = _filter(x, P, 1)
    kalman.transitionMatrix, kalman.processNoiseCov = F, Q
    kalman.predict()  # its mean is F x; that of an EKF is ours
    return {"x": moved, "P": kalman.errorCovPre}


def _ekf_update(x: Array, P: Array, ids: Array, z: Array, cov_z: Array) -> dict[str, Any]:
    predicted, H = sight(x, ids)
    kalman = _filter(x, P, len(predicted))
    kalman.measurementMatrix = H
    kalman.measurementNoiseCov = np.kron(np.eye(len(ids)), cov_z)
    kalman.correct((z.ravel() - predicted + H @ x).reshape(-1, 1))  # it subtracts H x
    return {"x": heading_wrapped(kalman.statePost.ravel()), "P": kalman.errorCovPost}


def _ate(estimate: Array, truth: Array, align: str) -> dict[str, float]:
    scale = 1.0
    if align == "sim3":
        T, scale = cv2.estimateAffine3D(estimate, truth, force_rotation=True)
        estimate = scale * estimate @ T[:, :3].T + T[:, 3]
    elif align != "none":
        raise NotImplementedError("Python cannot ask for scale 1")
    errors = np.array([cv2.norm(a, b) for a, b in zip(estimate, truth, strict=True)])
    values = {"mean": errors.mean(), "median": np.median(errors), "max": errors.max(), "scale": scale}
    return {"rmse": float(cv2.norm(errors)) / len(errors) ** 0.5, **values}


def _ray_cells(start: Array, end: Array) -> list[list[int]]:
    """Pixels that ``cv2.line`` draws from one cell to the other, sorted from the start."""
    a, b = (np.floor(p).astype(int) for p in (start, end))
    low = np.minimum(a, b) - 1
    size = np.abs(a - b) + 3
    if size.max() > 4000:
        raise NotImplementedError("too large a picture")
    picture = np.zeros((int(size[1]), int(size[0])), np.uint8)
    cv2.line(picture, tuple(map(int, a - low)), tuple(map(int, b - low)), 255)
    cells = np.asarray(cv2.findNonZero(picture)).reshape(-1, 2) + low
    order = np.argsort((cells - a) @ (b - a), kind="stable")
    return [[int(i), int(j)] for i, j in cells[order]]


REST: Answers = {
    "least_squares.gauss_newton_step": lambda J, r: _solve(J, -r),
    "least_squares.lm_step": _lm_step,
    "bundle.residual": _residual,
    "bundle.cost": _cost,
    "ekf.predict": _ekf_predict,
    "ekf.update": _ekf_update,
    "consistency.nees": lambda error, P: cv2.Mahalanobis(error, 0.0 * error, cv2.invert(P)[1]) ** 2,
    "grid.ray_cells": _ray_cells,
    "trajectory.ate": _ate,
}

TABLE: Answers = {**MOTIONS, **CAMERAS, **VIEWS, **REST}

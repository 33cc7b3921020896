"""Short programs in another style: matrix exponentials, dictionaries of lenses, information forms.

They are right, share nothing with the library nor with the other plain programs, and are what the third table
of wrong programs changes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.linalg import expm, logm
from scipy.special import expit

Array = np.ndarray[Any, Any]


def skew(w: Array) -> Array:
    return np.cross(np.eye(3), w)


def wrapped(a: float) -> float:
    turns = np.ceil((a - np.pi) / (2 * np.pi))
    return float(a - 2 * np.pi * turns)


def frame(x: Array) -> Array:
    c, s = np.cos(x[2]), np.sin(x[2])
    return np.array([[c, -s, x[0]], [s, c, x[1]], [0.0, 0.0, 1.0]])


def pose(M: Array) -> list[float]:
    return [M[0, 2], M[1, 2], float(np.arctan2(M[1, 0], M[0, 0]))]


def se2_exp(xi: Array) -> list[float]:
    u, v, w = xi
    M = expm(np.array([[0.0, -w, u], [w, 0.0, v], [0.0, 0.0, 0.0]]))
    return pose(M)


def se2_compose(a: Array, b: Array) -> list[float]:
    M = frame(a) @ frame(b)
    return pose(M)


def se2_inverse(x: Array) -> list[float]:
    c, s = np.cos(x[2]), np.sin(x[2])
    return [-c * x[0] - s * x[1], s * x[0] - c * x[1], wrapped(-x[2])]


def se2_adjoint(x: Array) -> Array:
    A = frame(x)
    A[:2, 2] = x[1], -x[0]
    return A


def so3_nearest(M: Array) -> Array:
    u, _, vt = np.linalg.svd(M)
    last = np.sign(np.linalg.det(u) * np.linalg.det(vt))
    return (u * [1.0, 1.0, last]) @ vt


def sim3_parts(S: Array) -> tuple[float, Array, Array]:
    s = np.cbrt(np.linalg.det(S[:3, :3]))
    return s, S[:3, :3] / s, S[:3, 3]


def sim3_inverse(S: Array) -> Array:
    s, R, t = sim3_parts(S)
    out = np.eye(4)
    out[:3, :3] = R.T / s
    out[:3, 3] = -(R.T @ t) / s
    return out


def sim3_act(S: Array, x: Array) -> Array:
    s, R, t = sim3_parts(S)
    return s * (R @ x) + t


def sim3_exp(xi: Array) -> Array:
    G = np.zeros((4, 4))
    G[:3, :3] = skew(xi[3:6]) + xi[6] * np.eye(3)
    G[:3, 3] = xi[:3]
    return expm(G)


def sim3_adjoint(S: Array) -> Array:
    s, R, t = sim3_parts(S)
    A = np.zeros((7, 7))
    A[:3, :3] = s * R
    A[:3, 3:6] = skew(t) @ R
    A[:3, 6] = -t
    A[3:6, 3:6] = R
    A[6, 6] = 1.0
    return A


def act_jacobian(pose: Array, x: Array) -> Array:
    moved = pose[:3, :3] @ x + pose[:3, 3]
    return np.hstack([np.eye(3), -skew(moved)])


def pinhole(params: Array, X: Array) -> Array:
    return np.array([params[0] * X[0] / X[2] + params[2], params[1] * X[1] / X[2] + params[3]])


def pinhole_slope(params: Array, X: Array) -> Array:
    fx, fy = params[:2]
    return np.array([[fx / X[2], 0.0, -fx * X[0] / X[2] ** 2], [0.0, fy / X[2], -fy * X[1] / X[2] ** 2]])


def unproject(model: str, params: Array, uv: Array) -> dict[str, Any]:
    if model != "pinhole":
        raise NotImplementedError
    ray = np.array([(uv[0] - params[2]) / params[0], (uv[1] - params[3]) / params[1], 1.0])
    return {"bearing": ray / np.sqrt(ray @ ray), "valid": True}


def jacobian_rig(model: str, params: Array, T_cam_rig: Array, pose: Array, X_world: Array) -> Array:
    if model != "pinhole":
        raise NotImplementedError
    X_rig = pose[:3, :3] @ X_world + pose[:3, 3]
    X_cam = T_cam_rig[:3, :3] @ X_rig + T_cam_rig[:3, 3]
    return pinhole_slope(params, X_cam) @ T_cam_rig[:3, :3] @ np.hstack([np.eye(3), -skew(X_rig)])


def jacobian_intrinsics(model: str, params: Array, X_cam: Array) -> Array:
    if model != "pinhole":
        raise NotImplementedError
    x, y = X_cam[0] / X_cam[2], X_cam[1] / X_cam[2]
    return np.array([[x, 0.0, 1.0, 0.0], [0.0, y, 0.0, 1.0]])


def residual(model: str, params: Array, pose: Array, X_world: Array, uv: Array) -> Array:
    if model != "pinhole":
        raise NotImplementedError
    return pinhole(params, pose[:3, :3] @ X_world + pose[:3, 3]) - uv


def midpoint(p_a: Array, b_a: Array, p_b: Array, b_b: Array) -> Array:
    n = np.cross(b_a, b_b)
    if n @ n <= 1e-24 * (b_a @ b_a) * (b_b @ b_b):
        raise ValueError("parallel")
    s = np.cross(p_b - p_a, b_b) @ n / (n @ n)
    t = np.cross(p_b - p_a, b_a) @ n / (n @ n)
    return (p_a + s * b_a + p_b + t * b_b) / 2


def epipolar_distance(F: Array, uv_a: Array, uv_b: Array) -> float:
    line = F @ [uv_a[0], uv_a[1], 1.0]
    return float(line @ [uv_b[0], uv_b[1], 1.0] / np.sqrt(line[0] ** 2 + line[1] ** 2))


def mad(errors: Array) -> float:
    return float(1.482602218505602 * np.median(np.abs(errors)))


def nielsen_factor(gain: float) -> float:
    rho = 2 * min(gain, 1.0) - 1
    return max(1 / 3, 1 - rho**3)


def back_substitute(W: Array, C: Array, g_point: Array, view_step: Array) -> Array:
    rhs = g_point + W.T @ view_step
    return -np.concatenate([np.linalg.solve(c, r) for c, r in zip(C, rhs.reshape(-1, 3), strict=True)])


def schur(B: Array, W: Array, C: Array, g_view: Array, g_point: Array) -> dict[str, Any]:
    S, rhs = B.copy(), -g_view
    for k, block in enumerate(C):
        w = W[:, 3 * k : 3 * k + 3]
        S = S - w @ np.linalg.inv(block) @ w.T
        rhs = rhs + w @ np.linalg.inv(block) @ g_point[3 * k : 3 * k + 3]
    return {"S": S, "rhs": rhs}


def zmssd(a: Array, b: Array) -> float:
    d = a - a.mean() - (b - b.mean())
    return float((d * d).sum())


def halve(image: Array) -> Array:
    h, w = image.shape[0] // 2, image.shape[1] // 2
    whole = image[: 2 * h, : 2 * w].reshape(h, 2, w, 2).sum(axis=(1, 3))
    return (whole + 2) // 4


def sampling(A: Array, target_level: int, source_level: int) -> Array:
    return 2.0 ** (target_level - source_level) * np.linalg.inv(A)


def level_from_finest(uv: Array, level: int) -> Array:
    return (uv + 0.5) / 2**level - 0.5


def nearest_essential(M: Array) -> Array:
    u, _, vt = np.linalg.svd(M)
    return u @ np.diag([1.0, 1.0, 0.0]) @ vt


def depths(T_b_a: Array, xn_a: Array, xn_b: Array) -> Array:
    a, b = np.append(xn_a, 1.0), np.append(xn_b, 1.0)
    return np.linalg.lstsq(np.column_stack([T_b_a[:3, :3] @ a, -b]), -T_b_a[:3, 3], rcond=None)[0]


def truncated_cost(squared: Array, most: float) -> float:
    return float(np.mean(np.minimum(squared, most)))


def model_criterion(squared: Array, dimension: int, unknowns: int) -> float:
    n = len(squared)
    cut = np.minimum(squared, 2 * (4 - dimension)).sum()
    return float(cut + np.log(4) * dimension * n + np.log(4 * n) * unknowns)


def homography_distance(H: Array, x_a: Array, x_b: Array) -> float:
    h = H @ np.append(x_a, 1.0)
    e = h[:2] / h[2] - x_b
    J = (H[:2, :2] - np.outer(h[:2] / h[2], H[2, :2])) / h[2]
    return float(e @ np.linalg.solve(np.eye(2) + J @ J.T, e))


def tracking_predict(T_before: Array, T_now: Array, decay: float) -> Array:
    step = T_now @ np.linalg.inv(T_before)
    return expm(decay * np.real(logm(step))) @ T_now


def keyframe_distance(T_kfs: Array, pose: Array, X_world: Array) -> float:
    centre = -pose[:3, :3].T @ pose[:3, 3]
    others = np.array([-T[:3, :3].T @ T[:3, 3] for T in T_kfs])
    near = np.linalg.norm(others - centre, axis=1).min()
    depth = np.median((X_world @ pose[:3, :3].T + pose[:3, 3])[:, 2])
    return float(near / depth)


def yaw_rate(x: Array, control: Array, dt: float) -> list[float]:
    v, w = control
    return [x[0] + v * dt * np.cos(x[2]), x[1] + v * dt * np.sin(x[2]), wrapped(x[2] + w * dt)]


def velocity_arc(x: Array, control: Array, dt: float) -> list[float]:
    v, w = control
    return se2_compose(x, np.array(se2_exp(np.array([v * dt, 0.0, w * dt]))))


def front_wheel(x: Array, control: Array, wheelbase: float, dt: float) -> list[float]:
    V, G = control
    way = V * dt * np.exp(1j * (x[2] + G))
    return [x[0] + way.real, x[1] + way.imag, wrapped(x[2] + V * dt * np.sin(G) / wheelbase)]


def sighting(x: Array, landmark: int) -> tuple[Array, Array]:
    c, s = np.cos(x[2]), np.sin(x[2])
    at = 3 + 2 * landmark
    d = x[at : at + 2] - x[:2]
    turn = np.array([[c, s], [-s, c]])
    H = np.zeros((2, len(x)))
    H[:, :2], H[:, 2], H[:, at : at + 2] = -turn, np.array([[-s, c], [-c, -s]]) @ d, turn
    return turn @ d, H


def gate(x: Array, P: Array, id: int, z: Array, cov_z: Array) -> float:
    h, H = sighting(x, int(id))
    e = z - h
    return float(e @ np.linalg.inv(H @ P @ H.T + cov_z) @ e)


def range_bearing_update(x: Array, P: Array, ids: Array, polar: Array, cov: Array) -> dict[str, Any]:
    if not len(ids):
        return {"x": x, "P": P}
    rows, misses = [], []
    for landmark, (r, b) in zip(ids, polar, strict=True):
        at = 3 + 2 * int(landmark)
        dx, dy = x[at] - x[0], x[at + 1] - x[1]
        q = dx * dx + dy * dy
        h = np.zeros((2, len(x)))
        h[0, [0, 1, at, at + 1]] = np.array([-dx, -dy, dx, dy]) / np.sqrt(q)
        h[1, [0, 1, at, at + 1]] = np.array([dy, -dx, -dy, dx]) / q
        h[1, 2] = -1.0
        rows.append(h)
        misses += [r - np.sqrt(q), wrapped(b - np.arctan2(dy, dx) + x[2])]
    H = np.concatenate(rows)
    S = H @ P @ H.T + np.kron(np.eye(len(rows)), cov)
    K = np.linalg.solve(S, H @ P).T
    x = x + K @ np.array(misses)
    x[2] = wrapped(x[2])
    rest = np.eye(len(x)) - K @ H
    return {"x": x, "P": rest @ P @ rest.T + K @ np.kron(np.eye(len(rows)), cov) @ K.T}


def predict_additive(
    x: Array, P: Array, control: Array, cov_pose: Array, wheelbase: float, dt: float
) -> dict[str, Any]:
    v, phi = control
    way = v * dt
    moved = x.copy()
    moved[:3] += [way * np.cos(x[2]), way * np.sin(x[2]), way * np.tan(phi) / wheelbase]
    moved[2] = wrapped(moved[2])
    F = np.eye(len(x))
    F[0, 2], F[1, 2] = -way * np.sin(x[2]), way * np.cos(x[2])
    after = F @ P @ F.T
    after[:3, :3] += cov_pose
    return {"x": moved, "P": after}


def lift_landmark(x: Array, landmark: Array) -> list[float]:
    s, c = np.sin(x[2]), np.cos(x[2])
    X, Y = landmark
    return [X, Y, s * X, c * X, s * Y, c * Y]


def recursion(table: float, transition: float, prediction: float) -> float:
    return table - transition + prediction


def follow(start: float, evidence: Array) -> Array:
    return start + np.cumsum(evidence)


def grid_probability(log_odds: float) -> float:
    return float(expit(log_odds))


def chain(steps: Array) -> Array:
    poses = [np.eye(4)]
    for step in steps:
        poses.append(poses[-1] @ step)
    return np.array(poses)


def rpe(estimate: Array, truth: Array) -> dict[str, Any]:
    shifts, turns = [], []
    for k in range(len(truth) - 1):
        true = np.linalg.inv(truth[k]) @ truth[k + 1]
        E = np.linalg.inv(true) @ np.linalg.inv(estimate[k]) @ estimate[k + 1]
        shifts.append(E[:3, 3] @ E[:3, 3])
        R = E[:3, :3]
        sine = np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
        turns.append(np.arctan2(sine, np.trace(R) - 1) ** 2)
    return {"trans_rmse": np.sqrt(np.mean(shifts)), "rot_rmse_deg": np.degrees(np.sqrt(np.mean(turns)))}


def pose_error(truth: Array, estimate: Array) -> list[float]:
    d = truth - estimate
    return [d[0], d[1], wrapped(d[2])]


def influence(name: str, c: float, x: Array) -> Array:
    if name != "huber":
        raise NotImplementedError
    return np.clip(x, -c, c)


def se3_interpolate(a: Array, b: Array, fraction: float) -> Array:
    step = np.linalg.inv(a) @ b
    return a @ expm(fraction * np.real(logm(step)))


PROGRAM: dict[str, Callable[..., Any]] = {
    "se2.exp": se2_exp,
    "se2.compose": se2_compose,
    "se2.inverse": se2_inverse,
    "se2.adjoint": se2_adjoint,
    "so3.nearest": so3_nearest,
    "sim3.inverse": sim3_inverse,
    "sim3.act": sim3_act,
    "sim3.exp": sim3_exp,
    "sim3.adjoint": sim3_adjoint,
    "se3.act_jacobian": act_jacobian,
    "camera.unproject": unproject,
    "camera.jacobian_rig": jacobian_rig,
    "camera.jacobian_intrinsics": jacobian_intrinsics,
    "bundle.residual": residual,
    "multiview.midpoint": midpoint,
    "multiview.epipolar_distance": epipolar_distance,
    "scale.mad": mad,
    "least_squares.nielsen_factor": nielsen_factor,
    "bundle.back_substitute": back_substitute,
    "bundle.schur": schur,
    "features.zmssd": zmssd,
    "features.halve": halve,
    "features.sampling": sampling,
    "features.level_from_finest": level_from_finest,
    "two_views.nearest_essential": nearest_essential,
    "two_views.depths": depths,
    "two_views.truncated_cost": truncated_cost,
    "two_views.model_criterion": model_criterion,
    "two_views.homography_distance": homography_distance,
    "tracking.predict": tracking_predict,
    "mapping.keyframe_distance": keyframe_distance,
    "vehicle.yaw_rate": yaw_rate,
    "vehicle.velocity_arc": velocity_arc,
    "vehicle.front_wheel": front_wheel,
    "ekf.gate": gate,
    "range_bearing.update": range_bearing_update,
    "ekf.predict_additive": predict_additive,
    "lift.landmark": lift_landmark,
    "grid.recursion": recursion,
    "grid.follow": follow,
    "grid.probability": grid_probability,
    "trajectory.chain": chain,
    "trajectory.rpe": rpe,
    "consistency.pose_error": pose_error,
    "loss.influence": influence,
    "se3.interpolate": se3_interpolate,
}
"""Function -> the program's own."""

"""Chapters 01 and 23 in plain NumPy and SciPy, and their known mistakes on demand.

Poses from three points come from Newton's iteration on the three distances from many starts at once,
similarities from a singular value decomposition: neither is the generator's way.
"""

from __future__ import annotations

import functools
import itertools
from typing import Any

import numpy as np
from plain_motions import se3_exp, skew
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

Array = Any


def rigid(R: Array, t: Array) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    return T


# --- points


def midpoint(T_cams: Array, rays: Array) -> Array:
    """Least sum of squared distances to rays (V, 3) of any length."""
    A, b = np.zeros((3, 3)), np.zeros(3)
    for T, ray in zip(T_cams, rays, strict=True):
        d = T[:3, :3].T @ (ray / np.linalg.norm(ray))
        P = np.eye(3) - np.outer(d, d)
        A, b = A + P, b + P @ (-T[:3, :3].T @ T[:3, 3])
    if np.linalg.cond(A) > 1e9:
        raise ValueError("parallel")
    return np.linalg.solve(A, b)


def triangulate(T_cams: Array, bearings: Array, wrong: str | None = None) -> Array:
    X = midpoint(T_cams, bearings)
    if any(b @ (T[:3, :3] @ X + T[:3, 3]) <= 0 for T, b in zip(T_cams, bearings, strict=True)):
        raise ValueError("behind")
    return T_cams[0, :3, :3] @ X + T_cams[0, :3, 3] if wrong == "first-camera-frame" else X


def pixels(T_cams: Array, params: Array, X: Array) -> Array:
    P = np.einsum("vij,j->vi", T_cams[:, :3, :3], X) + T_cams[:, :3, 3]
    return params[:2] * P[:, :2] / P[:, 2:] + params[2:4]


def point_slopes(T_cams: Array, params: Array, X: Array) -> Array:
    columns = []
    for j in range(3):
        x = X.astype(complex)
        x[j] += 1e-40j
        columns.append(pixels(T_cams, params, x).imag.ravel() / 1e-40)
    return np.stack(columns, 1)


def triangulate_optimal(T_cams: Array, params: Array, uv: Array, wrong: str | None = None) -> Any:
    rays = np.concatenate([(uv - params[2:4]) / params[:2], np.ones((len(uv), 1))], 1)
    X = midpoint(T_cams, rays)
    for _ in range(0 if wrong == "midpoint" else 30):
        J = point_slopes(T_cams, params, X)
        X = X - np.linalg.lstsq(J, (pixels(T_cams, params, X) - uv).ravel(), rcond=None)[0]
    J = point_slopes(T_cams, params, X)
    H = J.T @ J
    return {"X": X, "covariance": H if wrong == "information" else np.linalg.inv(H)}


def meeting(p_a: Array, b_a: Array, p_b: Array, b_b: Array, wrong: str | None = None) -> Array:
    """Feet of the common perpendicular by the triple product."""
    n = np.cross(b_a, b_b)
    s = np.cross(p_b - p_a, b_b) @ n / (n @ n)
    t = np.cross(p_b - p_a, b_a) @ n / (n @ n)
    a, b = p_a + s * b_a, p_b + t * b_b
    return a if wrong == "on-the-first-line" else (a + b) / 2


def meeting_slopes(p_a: Array, b_a: Array, p_b: Array, b_b: Array, wrong: str | None = None) -> Any:
    """Complex steps."""

    def slopes(f: Any, at: Array) -> Array:
        return np.stack([f(at + 1e-40j * e).imag / 1e-40 for e in np.eye(3)], 1)

    J_b = slopes(lambda v: meeting(p_a, v, p_b, b_b), b_a)
    J_b = J_b * np.linalg.norm(b_a) if wrong == "length-forgotten" else J_b
    return {"J_p_a": slopes(lambda v: meeting(v, b_a, p_b, b_b), p_a), "J_b_a": J_b}


def epipolar(F: Array, uv_a: Array, uv_b: Array, wrong: str | None = None) -> float:
    F = F.T if wrong == "fundamental-transposed" else F
    a, b = np.append(uv_a, 1), np.append(uv_b, 1)
    length = {"other-image": np.hypot(*(F.T @ b)[:2]), "algebraic": 1.0}.get(
        wrong or "", np.hypot(*(F @ a)[:2])
    )
    return float(b @ F @ a / length)


def sampson(F: Array, uv_a: Array, uv_b: Array, wrong: str | None = None) -> float:
    a, b = np.append(uv_a, 1), np.append(uv_b, 1)
    in_a, in_b = np.hypot(*(F.T @ b)[:2]), np.hypot(*(F @ a)[:2])
    return float(b @ F @ a / {"one-image": in_b, "algebraic": 1.0}.get(wrong or "", np.hypot(in_a, in_b)))


# --- poses


def distances(b: Array, X: Array) -> Array:
    """All real solutions (k, 3) of the three laws of cosines with the first distance positive."""
    pairs = [(0, 1), (0, 2), (1, 2)]
    cos = [b[i] @ b[j] for i, j in pairs]
    sides = [np.sum((X[i] - X[j]) ** 2) for i, j in pairs]
    grid = [1.0, 2.5, 4.0, 6.0, 9.0]
    d = np.array(list(itertools.product(grid, [*grid, *(-v for v in grid)], [*grid, *(-v for v in grid)])))
    with np.errstate(all="ignore"):
        for _ in range(40):
            f, J = np.zeros((len(d), 3)), np.zeros((len(d), 3, 3))
            for n, (i, j) in enumerate(pairs):
                f[:, n] = d[:, i] ** 2 + d[:, j] ** 2 - 2 * d[:, i] * d[:, j] * cos[n] - sides[n]
                J[:, n, i], J[:, n, j] = 2 * (d[:, i] - d[:, j] * cos[n]), 2 * (d[:, j] - d[:, i] * cos[n])
            good = np.isfinite(d).all(1) & (np.abs(np.linalg.det(J)) > 1e-12) & (np.abs(d) < 1e4).all(1)
            f, J, d = f[good], J[good], d[good]
            d = d - np.linalg.solve(J, f[..., None])[..., 0]
    d = d[np.abs(f).max(1) < 1e-9]
    d = d * np.sign(d[:, :1])
    found: list[Array] = []
    for row in d:
        if all(np.abs(row - other).max() > 1e-5 for other in found):
            found.append(row)
    return np.array(found)


def p3p(bearings: Array, X_world: Array, wrong: str | None = None) -> Array:
    d = distances(bearings, X_world)
    if wrong != "points-behind":
        d = d[(d > 0).all(1)]
    poses = []
    for row in d:
        S = align(X_world, row[:, None] * bearings, False)
        poses.append(rigid(S["R"], S["t"]))
    return np.linalg.inv(poses) if wrong == "world-from-cam" else np.array(poses)


def pnp(params: Array, X_world: Array, uv: Array, wrong: str | None = None) -> Array:
    T = found_pose(params.tobytes(), X_world.tobytes(), uv.tobytes())
    if wrong == "centre-for-translation":
        return rigid(T[:3, :3], -T[:3, :3].T @ T[:3, 3])
    if wrong == "other-axes":
        return np.diag([1, -1, -1, 1]) @ T
    return np.linalg.inv(T) if wrong == "world-from-cam" else T


@functools.cache
def found_pose(*given: bytes) -> Array:
    """Best pose of the first three points, refined with all; kept for the next mistake."""
    params, X_world, uv = (
        np.frombuffer(g).reshape(shape) for g, shape in zip(given, (4, (-1, 3), (-1, 2)), strict=True)
    )
    rays = np.concatenate([(uv - params[2:4]) / params[:2], np.ones((len(uv), 1))], 1)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    starts = p3p(rays[:3], X_world[:3])

    def miss(v: Array, T: Array) -> Array:
        X = Rotation.from_rotvec(v[3:]).apply(X_world @ T[:3, :3].T + T[:3, 3]) + v[:3]
        return (params[:2] * X[:, :2] / X[:, 2:] + params[2:4] - uv).ravel()

    T = min(starts, key=lambda T: float(np.sum(miss(np.zeros(6), T) ** 2)))
    for _ in range(3):
        v = least_squares(miss, np.zeros(6), args=(T,), x_scale=1e-3, xtol=1e-15, ftol=1e-15, gtol=1e-15).x
        T = rigid(Rotation.from_rotvec(v[3:]).as_matrix(), v[:3]) @ T
    return T


def pose_optimal(params: Array, X_world: Array, uv: Array, start: Array, wrong: str | None = None) -> Array:
    """Gauss-Newton with the closed Jacobian."""
    T = start
    for _ in range({"start-kept": 0, "one-step": 1}.get(wrong or "", 30)):
        X = X_world @ T[:3, :3].T + T[:3, 3]
        x, y, z = X.T
        zero = 0 * z
        u = np.stack([params[0] / z, zero, -params[0] * x / z**2], 1)
        v = np.stack([zero, params[1] / z, -params[1] * y / z**2], 1)
        J = np.concatenate([np.hstack([d, np.cross(X, d)]) for d in (u, v)])
        r = params[:2] * X[:, :2] / X[:, 2:] + params[2:4] - uv
        T = se3_exp(-np.linalg.lstsq(J, r.T.ravel(), rcond=None)[0]) @ T
    return np.linalg.inv(T) if wrong == "world-from-cam" else T


def essential(T_b_a: Array, wrong: str | None = None) -> Array:
    R, H = T_b_a[:3, :3], skew(T_b_a[:3, 3])
    return {"factors-swapped": R @ H, "other-way-round": (H @ R).T, "element-wise": H * R}.get(
        wrong or "", H @ R
    )


def camera_from_world(R_cam_world: Array, p_world: Array, X_world: Array, wrong: str | None = None) -> Array:
    R, p, X = R_cam_world, p_world, X_world
    return {
        "centre-added": R @ (X + p),
        "centre-not-turned": R @ X - p,
        "turned-back": R.T @ (X - p),
    }.get(wrong or "", R @ (X - p))


# --- similarities and trajectories


def align(source: Array, target: Array, with_scale: bool, wrong: str | None = None) -> Any:
    if wrong == "target-to-source":
        return align(target, source, with_scale)
    a, b = source.mean(0), target.mean(0)
    p, q = source - a, target - b
    if min(np.linalg.matrix_rank(p, 1e-9), np.linalg.matrix_rank(q, 1e-9)) < 2:
        raise ValueError("the points leave the rotation open")
    U, D, Vt = np.linalg.svd(q.T @ p)
    sign = np.array([1, 1, 1.0 if wrong == "mirrored" else np.linalg.det(U @ Vt)])
    R = U @ np.diag(sign) @ Vt
    top = D.sum() if wrong == "scale-of-mirror" else D @ sign
    moves_x, moves_y = np.sum(p**2), np.sum(q**2)
    s = {"other-variance": top / moves_y, "ratio-of-spreads": np.sqrt(moves_y / moves_x)}.get(
        wrong or "", top / moves_x
    )
    s = s if with_scale else 1.0
    return {"scale": s, "R": R, "t": b - (1.0 if wrong == "translation-not-scaled" else s) * R @ a}


def alignment_error(source: Array, target: Array, with_scale: bool, wrong: str | None = None) -> float:
    S = align(source, target, with_scale)
    e = np.linalg.norm(S["scale"] * source @ S["R"].T + S["t"] - target, axis=1)
    if wrong == "mean-for-root-mean-square":
        return float(e.mean())
    return float(np.sqrt(np.sum(e**2) / (1 if wrong == "sum-not-divided" else len(e))))


def pose_from_centre(R_cam_world: Array, p_world: Array, wrong: str | None = None) -> Array:
    return rigid(R_cam_world, p_world if wrong == "centre-for-translation" else -R_cam_world @ p_world)


def ate(estimate: Array, truth: Array, align: str, wrong: str | None = None) -> Any:
    mode = {"scale-fixed": "se3", "scale-freed": "sim3"}.get(wrong or "", align)
    if wrong == "truth-aligned":
        estimate, truth = truth, estimate
    S = {"scale": 1.0, "R": np.eye(3), "t": np.zeros(3)}
    if mode != "none":
        S = globals()["align"](estimate, truth, mode == "sim3")
    scale = S["scale"]
    if wrong in ("not-aligned", "aligned-at-the-start"):
        S = {"scale": 1.0, "R": np.eye(3), "t": np.zeros(3)}
    if wrong == "aligned-at-the-start":
        S["t"] = truth[0] - estimate[0]
    e = np.linalg.norm(S["scale"] * estimate @ S["R"].T + S["t"] - truth, axis=1)
    n = len(e) - (wrong == "divided-by-n-minus-1")
    rmse = e.mean() if wrong == "mean-for-root-mean-square" else np.sqrt(np.sum(e**2) / n)
    middle = np.sort(e)[len(e) // 2] if wrong == "upper-median" else np.median(e)
    told = 1 / scale if wrong == "scale-inverted" else scale
    return {"rmse": rmse, "mean": e.mean(), "median": middle, "max": e.max(), "scale": told}


def rpe(estimate: Array, truth: Array, wrong: str | None = None) -> Any:
    inv = np.linalg.inv

    def steps(path: Array) -> Array:
        if wrong in ("right-for-left", "right-for-left-other-side"):
            return path[1:] @ inv(path[:-1])
        return inv(path[:-1]) @ path[1:]

    E = inv(steps(truth)) @ steps(estimate)
    if wrong in ("other-side", "right-for-left-other-side"):
        E = steps(estimate) @ inv(steps(truth))
    if wrong == "absolute":
        E = inv(truth) @ estimate
    shift = np.linalg.norm(E[:, :3, 3], axis=1)
    if wrong == "in-the-world":
        shift = np.linalg.norm(np.diff(estimate[:, :3, 3], axis=0) - np.diff(truth[:, :3, 3], axis=0), axis=1)
    angle = np.linalg.norm(Rotation.from_matrix(E[:, :3, :3]).as_rotvec(), axis=1)
    angle = angle / 2 if wrong == "half-angle" else angle
    angle = angle if wrong == "radians" else np.degrees(angle)
    if wrong == "mean-for-root-mean-square":
        return {"trans_rmse": shift.mean(), "rot_rmse_deg": angle.mean()}
    return {"trans_rmse": np.sqrt(np.mean(shift**2)), "rot_rmse_deg": np.sqrt(np.mean(angle**2))}


def chain(steps: Array, wrong: str | None = None) -> Array:
    poses = [np.eye(4)]
    for step in steps:
        T = poses[-1]
        poses.append(
            {"accumulated-on-the-left": step @ T, "element-wise": T * step}.get(wrong or "", T @ step)
        )
    return np.stack(poses)


def table(text: str, columns: int) -> Array:
    rows = [
        [float(w) for w in line.split()]
        for line in text.splitlines()
        if line.strip() and line.strip()[0] != "#"
    ]
    if not rows or any(len(row) != columns for row in rows) or not np.isfinite(rows).all():
        raise ValueError("no trajectory")
    return np.array(rows)


def tum(text: str, wrong: str | None = None) -> Any:
    rows = table(text, 8)
    q = rows[:, 4:] if wrong == "file-order" else np.roll(rows[:, 4:], 1, axis=1)
    if (np.diff(rows[:, 0]) < 0).any() or (np.abs(np.linalg.norm(q, axis=1) - 1) > 1e-3).any():
        raise ValueError("times or quaternions")
    times = rows[:, 0].astype(np.float32) if wrong == "single-precision" else rows[:, 0]
    q = q * np.sign(q[:, :1]) if wrong == "sign-changed" else q
    return {"times": times, "t": rows[:, 1:4], "q": q}


def kitti(text: str, wrong: str | None = None) -> Array:
    rows = table(text, 12)
    upper = rows.reshape(-1, 4, 3).transpose(0, 2, 1) if wrong == "column-major" else rows.reshape(-1, 3, 4)
    R = rows.reshape(-1, 3, 4)[:, :, :3]
    if np.abs(R @ np.swapaxes(R, 1, 2) - np.eye(3)).max() > 1e-3 or (np.linalg.det(R) < 0).any():
        raise ValueError("no rotation")
    T = np.tile(np.eye(4), (len(rows), 1, 1))
    T[:, :3] = upper
    return np.linalg.inv(T) if wrong == "inverted" else T


def write_tum(times: Array, t: Array, q: Array, wrong: str | None = None) -> str:
    form = {"four-decimals": "%.4f", "six-decimals": "%.6f"}.get(wrong or "", "%.17g")
    rows = np.column_stack([times, t, q if wrong == "writes-w-first" else np.roll(q, -1, axis=1)])
    if wrong == "times-in-the-back":
        rows = np.roll(rows, -1, axis=1)
    lines = [" ".join(form % v for v in row) for row in rows]
    return "# time tx ty tz qx qy qz qw\n" + "\n".join(lines) + "\n"


PROGRAM = {
    "multiview.triangulate": triangulate,
    "multiview.triangulate_optimal": triangulate_optimal,
    "multiview.pnp": pnp,
    "multiview.p3p": p3p,
    "multiview.essential": essential,
    "multiview.umeyama": align,
    "multiview.alignment_error": alignment_error,
    "multiview.pose_from_centre": pose_from_centre,
    "multiview.midpoint": meeting,
    "multiview.midpoint_jacobian": meeting_slopes,
    "multiview.pose_optimal": pose_optimal,
    "multiview.epipolar_distance": epipolar,
    "multiview.sampson_distance": sampson,
    "multiview.camera_from_world": camera_from_world,
    "trajectory.ate": ate,
    "trajectory.rpe": rpe,
    "trajectory.chain": chain,
    "format.tum": tum,
    "format.kitti": kitti,
    "format.write_tum": write_tum,
}

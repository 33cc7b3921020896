"""Chapters 04 to 06 in plain NumPy, and their known mistakes on demand."""

from __future__ import annotations

from typing import Any

import numpy as np
from plain_cameras import jacobian_point, pixel
from plain_motions import skew
from scipy.stats import norm

Array = Any


# --- losses and scales


def cost(name: str, c: float, x: Array, wrong: str | None = None) -> Array:
    if wrong == "cost-of-square":
        return cost(name, c, np.sqrt(np.abs(x)))
    a, u = np.abs(x), (x / c) ** 2
    inside = a < c
    if wrong == "tukey-as-printed":
        return np.where(inside, x * (1 - u), 0.0)
    if name == "l2":
        value = 0.5 * x * x
    elif name == "huber":
        value = np.where(a <= c, 0.5 * x * x, c * a if wrong == "huber-without-offset" else c * (a - 0.5 * c))
    elif name == "cauchy":
        value = 0.5 * c * c * np.log1p(u)
    elif name == "geman-mcclure":
        value = 0.5 * x * x / (1 + u)
    else:  # 1 - (1 - u)^3 multiplied out
        value = np.where(inside, 0.5 * x * x * (1 - u + u * u / 3), c * c / 6)
        if wrong in ("tukey-mixed", "tukey-constant"):
            value = np.where(inside, value, c * c / 3)
        if wrong == "tukey-falls-to-zero":
            value = np.where(inside, value, 0.0)
    return 2 * value if wrong in ("twice", "tukey-third") else value


def weight(name: str, c: float, x: Array, wrong: str | None = None) -> Array:
    a, u = np.abs(x), (x / c) ** 2
    if wrong == "tukey-as-printed":
        return np.where(a < c, x * (1 - u), 0.0)
    if wrong == "cost-over-square":
        return np.where(x == 0, 1.0, cost(name, c, x) / np.where(x == 0, 1.0, 0.5 * x * x))
    power = 1 if wrong == "weight-not-squared" else 2
    if name == "l2":
        return np.ones_like(x)
    if name == "huber":
        return np.where(a <= c, 1.0, c / np.where(a > 0, a, 1.0))
    if name == "cauchy":
        return 1 / (1 + u)
    if name == "geman-mcclure":
        return 1 / (1 + u) ** power
    return np.where(a < c, 1 - u, 0.0) ** power


def influence(name: str, c: float, x: Array, wrong: str | None = None) -> Array:
    if wrong == "weight-for-influence":
        return weight(name, c, x)
    if wrong == "tukey-as-printed":
        return np.where(np.abs(x) < c, x * (1 - (x / c) ** 2), 0.0)
    return weight(name, c, x) * x


def scale(errors: Array, wrong: str | None = None) -> float:
    one, two = 1 / norm.ppf(0.75), 1 / np.sqrt(2 * np.log(2))
    factor = one if errors.ndim == 1 else two
    factor = {"constant-of-norms": two, "constant-of-scalars": one, "not-scaled": 1.0}.get(
        wrong or "", factor
    )
    sizes = np.abs(errors) if errors.ndim == 1 else np.linalg.norm(errors, axis=1)
    if wrong == "about-the-median":
        sizes = np.abs(errors - np.median(errors))
    if wrong == "signed-median":
        return float(factor * abs(np.median(errors)))
    if wrong == "upper-median":
        return float(factor * np.sort(sizes)[len(sizes) // 2])
    if wrong == "root-mean-square":
        return float(np.sqrt(np.mean(errors**2)))
    if wrong == "componentwise":
        sizes = np.abs(errors).ravel()
    return float(factor * np.median(sizes))


def gaussian(N: int, sigma: float, wrong: str | None = None) -> Array:
    rng = np.random.default_rng(9)
    u = rng.uniform(0, 1, int(N))
    return {
        "uniform-noise": sigma * np.sqrt(12) * (u - 0.5),
        "uniform-half-width": sigma * (2 * u - 1),
        "positive-uniform": sigma * u,
        "variance-for-deviation": sigma**2 * rng.standard_normal(int(N)),
    }.get(wrong or "", sigma * rng.standard_normal(int(N)))


# --- least squares


def gauss_newton_step(J: Array, r: Array, wrong: str | None = None) -> Array:
    if wrong == "gradient-step":
        return -J.T @ r
    if np.linalg.matrix_rank(J) < J.shape[1]:
        raise ValueError("rank")
    step = -np.linalg.lstsq(J, r, rcond=None)[0]
    return -step if wrong == "uphill" else step


def lm_step(J: Array, r: Array, damping: float, scale: Array, wrong: str | None = None) -> Array:
    H = J.T @ J
    extra = {
        "scale-not-squared": damping * scale,
        "scale-ignored": damping * np.ones_like(scale),
        "damping-squared": damping**2 * scale**2,
        "marquardt-diagonal": damping * np.diag(H),
        "not-damped": 0 * scale,
    }.get(wrong or "", damping * scale**2)
    step = np.linalg.solve(H + np.diag(extra), -J.T @ r)
    return -step if wrong == "uphill" else step


def lm_trace(
    y: Array, t: Array, start: Array, damping: Array, wrong: str | None = None
) -> list[dict[str, Any]]:
    def residual(b: Array) -> Array:
        return b[0] * np.exp(-b[1] * t) - y

    b, steps = start, []
    if wrong == "damping-late":
        damping = np.array([damping[0], *damping[:-1]])
    for value in damping:
        e = np.exp(-b[1] * t)
        J, r = np.stack([e, -b[0] * t * e], 1), residual(b)
        rule = wrong if wrong in ("marquardt-diagonal", "not-damped") else None
        trial = b + lm_step(J, r, value, np.ones(2), rule)
        taken = wrong == "always-taken" or bool(np.sum(residual(trial) ** 2) < np.sum(r**2))
        b = trial if taken else b
        half = 1.0 if wrong == "cost-not-halved" else 0.5
        steps.append({"b": b, "cost": half * float(np.sum(residual(b) ** 2)), "taken": int(taken)})
    return steps


def nielsen_trace(
    y: Array, t: Array, start: Array, damping: float, count: int, wrong: str | None = None
) -> list[dict[str, Any]]:
    def residual(b: Array) -> Array:
        return b[0] * np.exp(-b[1] * t) - y

    b, lam, nu, steps = start, damping, 2.0, []
    for _ in range(int(count)):
        e = np.exp(-b[1] * t)
        J, r = np.stack([e, -b[0] * t * e], 1), residual(b)
        step = np.linalg.lstsq(
            np.vstack([J, np.sqrt(lam) * np.eye(2)]), -np.concatenate([r, [0, 0]]), rcond=None
        )[0]
        share = 0.0 if wrong == "promise-of-gauss-newton" else lam * step @ step
        new = residual(b + step)
        gain = (r @ r - new @ new) / 2 / ((J @ step) @ (J @ step) / 2 + share)
        taken = gain > 0 or wrong == "always-taken"
        cost = float(new @ new if taken else r @ r) / 2
        steps.append({"cost": cost, "gain": float(gain), "damping": float(lam), "taken": int(taken)})
        if taken:
            power = 2 if wrong == "factor-not-cubed" else 3
            b, nu, lam = b + step, 2.0, lam * max(1 / 3, 1 - (2 * min(gain, 1.0) - 1) ** power)
        else:
            lam, nu = lam * nu, nu if wrong == "growth-not-doubled" else 2 * nu
    return steps


def covariance(J: Array, r: Array, wrong: str | None = None) -> Array:
    m, n = J.shape
    if m <= n or np.linalg.matrix_rank(J) < n:
        raise ValueError("no residual is left over")
    noise = {"divided-by-m": r @ r / m, "noise-of-one": 1.0}.get(wrong or "", r @ r / (m - n))
    root = np.linalg.pinv(J)
    C = noise * root @ root.T
    return np.linalg.inv(C) if wrong == "information" else C


def nielsen_factor(gain: float, wrong: str | None = None) -> float:
    if wrong == "gain-not-bounded":
        return 1 - (2 * gain - 1) ** 3
    return max(1 / 3, 1 - (2 * min(gain, 1.0) - 1) ** (2 if wrong == "square-for-cube" else 3))


# --- bundle adjustment


def residual(
    model: str, params: Array, pose: Array, X_world: Array, uv: Array, wrong: str | None = None
) -> Array:
    R, t = pose[:3, :3], pose[:3, 3]
    X = R.T @ (X_world - t) if wrong == "pose-inverted" else R @ X_world + t
    r = pixel(model, params, X.astype(complex)).real - uv
    return -r if wrong == "measured-minus-predicted" else r


def bundle_cost(
    model: str, params: Array, pose: Array, X_world: Array, uv: Array, cov: Array, wrong: str | None = None
) -> float:
    e = np.stack([residual(model, params, pose, X, m) for X, m in zip(X_world, uv, strict=True)])
    weights = {
        "covariance-not-inverted": cov,
        "diagonal-only": np.stack([np.diag(1 / np.diag(C)) for C in cov]),
        "one-covariance": np.broadcast_to(np.linalg.inv(cov[0]), cov.shape),
        "covariance-ignored": np.broadcast_to(np.eye(2), cov.shape),
    }.get(wrong or "", np.linalg.inv(cov))
    squares = np.einsum("ni,nij,nj->n", e, weights, e)
    if wrong == "squared-twice":
        squares = squares**2
    if wrong == "norms-not-squared":
        squares = np.sqrt(squares)
    return float(squares.sum() if wrong == "not-halved" else 0.5 * squares.sum())


def normal_equations(
    model: str, params: Array, pose: Array, X_world: Array, uv: Array, cov: Array, wrong: str | None = None
) -> Any:
    R, t = pose[:3, :3], pose[:3, 3]
    rows, points, r = [], [], []
    for X, u in zip(X_world, uv, strict=True):
        inner = jacobian_point(model, params, R @ X + t)
        side = (R, X) if wrong == "right-perturbation" else (np.eye(3), R @ X + t)
        rows.append(np.hstack([inner @ side[0], -inner @ side[0] @ skew(side[1])]))
        points.append(inner @ R)
        r.append(residual(model, params, pose, X, u))
    weights = {"covariance-not-inverted": cov, "covariance-ignored": np.tile(np.eye(2), (len(cov), 1, 1))}
    A = weights.get(wrong or "", np.linalg.inv(cov))
    J, K, e = np.array(rows), np.array(points), np.array(r)
    sign = -1 if wrong == "gradient-sign" else 1
    return {
        "B": np.einsum("nai,nab,nbj->ij", J, A, J),
        "W_T": np.einsum("nai,nab,nbj->nij", K, A, J).reshape(-1, 6),
        "C": np.einsum("nai,nab,nbj->nij", K, A, K),
        "g_view": sign * np.einsum("nai,nab,nb->i", J, A, e)[None],
        "g_point": sign * np.einsum("nai,nab,nb->ni", K, A, e).ravel(),
    }


def inverse_blocks(C: Array, wrong: str | None) -> Array:
    blocks = {"c-not-inverted": C, "element-wise": 1 / C}.get(wrong or "", np.linalg.inv(C))
    big = np.zeros((3 * len(C), 3 * len(C)))
    for n, block in enumerate(blocks):
        big[3 * n : 3 * n + 3, 3 * n : 3 * n + 3] = block
    return big


def schur(B: Array, W: Array, C: Array, g_view: Array, g_point: Array, wrong: str | None = None) -> Any:
    V = W @ inverse_blocks(C, wrong)
    sign = -1 if wrong == "rhs-sign" else 1
    return {"S": B + V @ W.T if wrong == "schur-sign" else B - V @ W.T, "rhs": -g_view + sign * V @ g_point}


def back_substitute(W: Array, C: Array, g_point: Array, view_step: Array, wrong: str | None = None) -> Array:
    pull = {"points-not-pulled": 0.0, "pulled-the-wrong-way": -1.0}.get(wrong or "", 1.0)
    return -inverse_blocks(C, wrong) @ (g_point + pull * W.T @ view_step)


PROGRAM = {
    "loss.cost": cost,
    "loss.influence": influence,
    "loss.weight": weight,
    "scale.mad": scale,
    "scale.norm": scale,
    "noise.gaussian": gaussian,
    "least_squares.gauss_newton_step": gauss_newton_step,
    "least_squares.lm_step": lm_step,
    "least_squares.lm_trace": lm_trace,
    "least_squares.nielsen_trace": nielsen_trace,
    "least_squares.covariance": covariance,
    "least_squares.nielsen_factor": nielsen_factor,
    "bundle.residual": residual,
    "bundle.cost": bundle_cost,
    "bundle.normal_equations": normal_equations,
    "bundle.schur": schur,
    "bundle.back_substitute": back_substitute,
}

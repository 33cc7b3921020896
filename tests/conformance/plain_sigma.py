"""The step by sigma points once more: the whole set of points as one matrix, angles as complex numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import block_diag

Array = np.ndarray[Any, Any]


def points(mean: Any, cov: Any, alpha: float, beta: float, kappa: float, wrong: str = "") -> dict[str, Any]:
    mean, n = np.array(mean), len(mean)
    total = alpha * alpha * (n + kappa)
    root = np.linalg.cholesky(np.array(cov)) * (1.0 if wrong == "not-spread" else np.sqrt(total))
    root = root.T if wrong == "rows-for-columns" else root
    ways = np.hstack([np.zeros((n, 1)), root, -root])
    w = np.r_[1 - n / total, np.full(2 * n, 1 / (2 * total))]
    extra = 0.0 if wrong == "beta-forgotten" else 1 - alpha**2 + beta
    return {"points": (mean[:, None] + ways).T, "w_mean": w, "w_cov": w + np.eye(2 * n + 1)[0] * extra}


def moments(values: Array, given: dict[str, Any], angle: int, wrong: str) -> tuple[Array, Array]:
    off = values - values[0]
    if wrong != "angles-averaged":
        off[:, angle] = np.angle(np.exp(1j * off[:, angle]))
    step = given["w_mean"] @ off
    return values[0] + step, off - step


def predict(
    x: Any, P: Any, control: Any, cov_u: Any, wheelbase: float, dt: float, wrong: str = "", **spread: float
) -> dict[str, Any]:
    noise = 1e-30 * np.eye(2) if wrong == "control-noise-forgotten" else np.array(cov_u)
    given = points(np.r_[x, control], block_diag(P, noise), **spread, wrong=wrong)
    px, py, th, v, phi = given["points"].T
    turned = np.angle(np.exp(1j * (th + v * dt * np.tan(phi) / wheelbase)))
    moved = np.stack([px + v * dt * np.cos(th), py + v * dt * np.sin(th), turned], 1)
    mean, off = moments(moved, given, 2, wrong)
    mean[2] = np.angle(np.exp(1j * mean[2]))
    return {"x": mean, "P": np.einsum("k,ki,kj->ij", given["w_cov"], off, off)}


def update(
    x: Any, P: Any, landmark: Any, polar: Any, cov: Any, wrong: str = "", **spread: float
) -> dict[str, Any]:
    given = points(x, P, **spread, wrong=wrong)
    way = (np.array(landmark) - given["points"][:, :2]) @ [1, 1j] * np.exp(-1j * given["points"][:, 2])
    mean, off = moments(np.stack([np.abs(way), np.angle(way)], 1), given, 1, wrong)
    S = np.einsum("k,ki,kj->ij", given["w_cov"], off, off)
    S = S if wrong == "noise-forgotten" else S + np.array(cov)
    K = np.einsum("k,ki,kj->ij", given["w_cov"], given["points"] - np.array(x), off) @ np.linalg.inv(S)
    nu = np.array(polar) - mean
    if wrong != "bearing-not-wrapped":
        nu[1] = np.angle(np.exp(1j * nu[1]))
    after = np.array(x) + K @ nu
    after[2] = np.angle(np.exp(1j * after[2]))
    return {"x": after, "P": np.array(P) - K @ S @ K.T}

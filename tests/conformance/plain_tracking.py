"""Chapter 10 in plain NumPy, and its known mistakes on demand: weighted rows for normal equations."""

from __future__ import annotations

from typing import Any

import numpy as np
from plain_motions import se3_exp, se3_log

Array = Any


def tukey_step(
    params: Array, X_world: Array, uv: Array, size: Array, start: Array, wrong: str | None = None
) -> Array:
    X = X_world @ start[:3, :3].T + start[:3, 3]
    x, y, z = X.T
    zero = 0 * z
    u = np.stack([params[0] / z, zero, -params[0] * x / z**2], 1)
    v = np.stack([zero, params[1] / z, -params[1] * y / z**2], 1)
    s = (np.ones_like(size) if wrong == "levels-forgotten" else size)[:, None]
    J = np.stack([np.hstack([d, np.cross(X, d)]) for d in (u, v)], 1) / s[..., None]
    e = (params[:2] * X[:, :2] / X[:, 2:] + params[2:4] - uv) / s
    norm = np.linalg.norm(e, axis=1)
    factor = 1.482602218505602 if wrong == "scalar-constants" else 0.8493218002880191
    c = 4.685065 if wrong in ("scalar-constants", "scalar-constant") else 5.123
    end = c * max(factor * np.median(norm), 0.0 if wrong == "no-floor" else 0.4)
    power = {"root-weight": 0.5, "least-squares": 0.0}.get(wrong or "", 1.0)
    root = np.maximum(1 - (norm / end) ** 2, 0.0) ** power  # the root of the weight
    if wrong == "least-squares":
        root = np.ones_like(norm)
    A, b = root[:, None, None] * J, root[:, None] * e
    mu = np.linalg.lstsq(A.reshape(-1, 6), -b.ravel(), rcond=None)[0]
    if wrong == "on-the-right":
        return start @ se3_exp(mu)
    return se3_exp(-mu if wrong == "uphill" else mu) @ start


def predict(T_before: Array, T_now: Array, decay: float, wrong: str | None = None) -> Array:
    if wrong == "stands-still":
        return T_now
    step = se3_log(T_now @ np.linalg.inv(T_before))
    step = step * (1.0 if wrong == "decay-forgotten" else -decay if wrong == "backwards" else decay)
    return T_now @ se3_exp(step) if wrong == "velocity-on-the-right" else se3_exp(step) @ T_now


PROGRAM = {"tracking.tukey_step": tukey_step, "tracking.predict": predict}

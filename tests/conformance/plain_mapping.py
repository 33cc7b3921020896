"""Chapter 11 in plain NumPy, and its known mistakes on demand: crossings, lenses by differences, patches."""

from __future__ import annotations

from typing import Any

import numpy as np
from plain_cameras import jacobian_ray, pixel, unproject
from plain_motions import skew

Array = Any


def other_way(T: Array, wrong: str | None) -> Array:
    return np.linalg.inv(T) if wrong == "pose-inverted" else T


def ray_depths(a: Array, b: Array, T_b_a: Array, wrong: str | None = None) -> Array:
    """Along the ray, of what is across the other: p = det(t, b, n) and so on."""
    T = other_way(T_b_a, wrong)
    ra, t = (a if wrong == "not-turned" else T[:3, :3] @ a), T[:3, 3]
    n = np.cross(ra, b)
    under = 1.0 if wrong == "no-parallax" else n @ n
    found = np.array([np.cross(b, t) @ n, np.cross(ra, t) @ n]) / under
    return found[::-1] if wrong == "swapped" else found


def depth_sigma(
    depths: Array, parallax: float, eps_a: float, eps_b: float, wrong: str | None = None
) -> float:
    under = 1.0 if wrong == "no-parallax" else np.sin(parallax)
    own = depths[0] * eps_a * (1.0 if wrong == "cosine-forgotten" else np.cos(parallax))
    own = 0.0 if wrong == "other-ray-only" else own
    return float(np.sqrt(own**2 + (depths[1] * eps_b) ** 2) / under)


def triangulated_depth(
    params: Array, uv_a: Array, uv_b: Array, T_b_a: Array, sigma_px: float, wrong: str | None = None
) -> dict[str, Any]:
    """Gauss-Newton on four rows, from where the rays come closest."""
    a, b = (unproject("pinhole", params, uv)["bearing"] for uv in (uv_a, uv_b))
    p, q = ray_depths(a, b, T_b_a)
    R, t = T_b_a[:3, :3], T_b_a[:3, 3]
    X, middle = p * a, (p * a + R.T @ (q * b - t)) / 2
    for _ in range(30):
        r, J = rows(params, X, R, t, uv_a, uv_b)
        X = X - np.linalg.lstsq(J, r, rcond=None)[0]
    _, J = rows(params, X, R, t, uv_a, uv_b)
    cov = np.linalg.inv(J.T @ J) * (1.0 if wrong == "one-pixel" else sigma_px**2)
    along = np.array([0.0, 0.0, 1.0]) if wrong == "along-axis" else a
    return {"X": middle if wrong == "midpoint" else X, "sigma": float(np.sqrt(along @ cov @ along))}


def rows(params: Array, X: Array, R: Array, t: Array, uv_a: Array, uv_b: Array) -> tuple[Array, Array]:
    """Four residuals, and complex steps of them."""

    def misses(x: Array) -> Array:
        return np.concatenate(
            [pixel("pinhole", params, x) - uv_a, pixel("pinhole", params, R @ x + t) - uv_b]
        )

    J = np.stack([misses(X + 1e-30j * e).imag / 1e-30 for e in np.eye(3)], 1)
    return misses(X.astype(complex)).real, J


def on_curve(
    model: str, params: Array, uv_a: Array, distance: float, T_b_a: Array, wrong: str | None = None
) -> Array:
    T = other_way(T_b_a, wrong)
    first = "pinhole" if wrong == "straight-line" else model
    last = "pinhole" if wrong in ("straight-line", "lens-on-one-side") else model
    ray = unproject(first, params, uv_a)["bearing"]
    X = distance * ray / (ray[2] if wrong == "depth-for-distance" else 1.0)
    return pixel(last, params, (T[:3, :3] @ X + T[:3, 3]).astype(complex)).real


def curve_distance(
    model: str, params: Array, bearing_a: Array, uv_b: Array, T_b_a: Array, wrong: str | None = None
) -> float:
    T = other_way(T_b_a, wrong)
    line = skew(T[:3, 3]) @ T[:3, :3] @ bearing_a
    ray = "pinhole" if wrong == "straight-line" else model
    slope = "pinhole" if wrong in ("straight-line", "slope-without-lens") else model
    e = unproject(ray, params, uv_b)["bearing"] @ line
    return float(
        abs(e) / (1.0 if wrong == "not-divided" else np.hypot(*(line @ jacobian_ray(slope, params, uv_b))))
    )


def keyframe_distance(T_kfs: Array, pose: Array, X_world: Array, wrong: str | None = None) -> float:
    def place(T: Array) -> Array:
        return T[:3, 3] if wrong == "translations" else np.linalg.solve(T, np.array([0.0, 0, 0, 1]))[:3]

    away = [np.linalg.norm(place(T) - place(pose)) for T in T_kfs]
    X = X_world @ pose[:3, :3].T + pose[:3, 3]
    depth = np.linalg.norm(X, axis=1) if wrong == "distance-for-depth" else X[:, 2]
    middle = depth.mean() if wrong == "mean-depth" else np.sort(depth)[len(depth) // 2]
    return float((max if wrong == "farthest" else min)(away) / middle)


def match_on_line(
    params: Array, images: Array, corners_a: Array, corners_b: Array, T_b_a: Array, gates: Array,
    wrong: str | None = None,
) -> dict[str, Any]:  # fmt: skip
    """There from the first corner, and back."""
    distance, near, limit, back = gates
    sides = [(images[0], corners_a.astype(int)), (images[1], corners_b.astype(int))]

    def best(k: int, corner: Array, T: Array, nearest: float) -> int:
        (image, _), (there, corners) = sides[k], sides[1 - k]
        T8, costs = cut(image, corner), []
        for other in corners:
            d = T8 - cut(there, other)
            ray = unproject("pinhole", params, corner)["bearing"]
            b = unproject("pinhole", params, other)["bearing"]
            p, q = ray_depths(ray, b, T)
            far = curve_distance("pinhole", params, ray, other, T)
            open_gate = far <= distance or wrong == "line-forgotten"
            ahead = (p >= nearest and q > 0) or wrong == "depth-forgotten"
            size = (d**2).sum() if wrong == "means-kept" else ((d - d.mean()) ** 2).sum()
            costs.append(size if open_gate and ahead else np.inf)
        enough = np.inf if wrong == "any-patch" else limit * ((T8 - T8.mean()) ** 2).sum()
        return int(np.argmin(costs)) if np.isfinite(min(costs)) and min(costs) <= enough else -1

    number = best(0, sides[0][1][0], T_b_a, near)
    if number < 0 or wrong == "one-way":
        return {"number": number, "kept": number >= 0}
    home = best(1, sides[1][1][number], np.linalg.inv(T_b_a), 0.0)
    kept = home >= 0 and np.hypot(*(sides[0][1][home] - sides[0][1][0])) <= back
    return {"number": number, "kept": bool(kept)}


def cut(image: Array, at: Array) -> Array:
    return image[at[1] - 4 : at[1] + 4, at[0] - 4 : at[0] + 4].astype(float)


PROGRAM = {
    "mapping.ray_depths": ray_depths,
    "mapping.depth_sigma": depth_sigma,
    "mapping.triangulated_depth": triangulated_depth,
    "mapping.on_curve": on_curve,
    "mapping.curve_distance": curve_distance,
    "mapping.keyframe_distance": keyframe_distance,
    "mapping.match_on_line": match_on_line,
}

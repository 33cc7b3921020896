"""The book's points and cameras, one at a time, are those of the fast forms."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vslam_ref.geometry import camera_pose, se3
from vslam_ref.geometry.multiview import (
    book,
    dlt,
    essential_from_motion,
    midpoint,
    p3p,
    relative_motion,
    triangulate_linear,
)

SEEDS = st.integers(0, 10**6)


def scene(seed: int, views: int, points: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Poses about 5 from some points, the points, and noisy unit bearings (N, V, 3)."""
    rng = np.random.default_rng(seed)
    T = se3.exp(rng.uniform(-1, 1, (views, 6)) * [1, 1, 0.5, 0.1, 0.1, 0.3] + [0, 0, 5.0, 0, 0, 0])
    X = rng.uniform(-1, 1, (points, 3))
    rays = se3.act(T, X[:, None]) + 1e-3 * rng.standard_normal((points, views, 3))
    return T, X, rays / np.linalg.norm(rays, axis=-1, keepdims=True)


@given(SEEDS, st.integers(2, 5))
def test_points(seed: int, views: int) -> None:
    """The fast form moves the world: its centres lie around the origin at distance 1; so does the book.

    Rounding of the rows, 1e-16, over the gap of the two smallest singular values, about the parallax.
    """
    T, _, b = scene(seed, views, 4)
    centres = camera_pose.centre_from_pose(T)
    middle = centres.mean(axis=0)
    size = float(np.sqrt(np.mean(np.sum((centres - middle) ** 2, axis=1))))
    R = list(T[:, :3, :3])
    t = [-R_i @ (p - middle) / size for R_i, p in zip(R, centres, strict=True)]
    fast = triangulate_linear(T, b, min_parallax=0.0)
    for j in range(4):
        slow = size * book.triangulate(R, t, list(b[j])) + middle
        assert np.linalg.norm(slow - fast.X_world[j]) <= 1e-13 / fast.parallax[j] ** 2
        flipped = size * book.triangulate(R, [-t_i for t_i in t], list(b[j])) + middle
        assert np.linalg.norm(flipped - fast.X_world[j]) > 1e-3  # the mirrored world


@given(SEEDS)
def test_exact_points_cameras_and_planes(seed: int) -> None:
    """Without noise: rounding of 1e-16 times a condition of 1e4 at most, some terms."""
    T, X, _ = scene(seed, 2, 8)
    rays = se3.act(T, X[:, None])
    b = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    slow = book.triangulate(list(T[:, :3, :3]), list(T[:, :3, 3]), list(b[0]))
    parallax = np.linalg.norm(np.cross(T[0, :3, :3].T @ b[0, 0], T[1, :3, :3].T @ b[0, 1]))
    assert np.linalg.norm(slow - X[0]) < 1e-12 / parallax**2
    R, t = book.resect(b[:, 0], X)
    found = dlt(b[:, 0], X)
    if found.ok and found.spread < 1e-9:
        assert np.abs(R - found.T_cam_world[:3, :3]).max() < 1e-8
        assert np.abs(t - found.T_cam_world[:3, 3]).max() < 1e-7
    T_b_a = relative_motion(T[0], T[1])
    E = book.essential(T_b_a[:3, :3], T_b_a[:3, 3])
    assert np.abs(E - essential_from_motion(T_b_a)).max() < 1e-15 * 10
    assert abs(b[0, 1] @ E @ b[0, 0]) < 1e-14


@given(SEEDS)
def test_midpoints(seed: int) -> None:
    """Two 3 x 3 systems: 1e-16 over the square of the angle between the rays."""
    rng = np.random.default_rng(seed)
    p, b = rng.uniform(-1, 1, (2, 3)), rng.standard_normal((2, 3))
    b /= np.linalg.norm(b, axis=1, keepdims=True)
    slow, sine = book.midpoint(p[0], b[0], p[1], b[1]), np.linalg.norm(np.cross(*b))
    assert np.abs(slow - midpoint(p[0], b[0], p[1], b[1])).max() < 1e-13 / sine**4


@given(SEEDS)
def test_three_points(seed: int) -> None:
    """Each sharp answer of the fast form is one of the book's.

    A solution is found to rounding over its sharpness; 1e-12 / sharpness^2 leaves room for the book, which
    takes any two members of the pencil and polishes nothing.
    """
    T, X, _ = scene(seed, 1, 3)
    rays = se3.act(T[0], X)
    b = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    fast = p3p(b[None], X[None])
    sharp = fast.valid[0] & (fast.sharpness[0] > 0.02)
    slow = book.p3p(b, X)
    for T_fast in fast.T_cam_world[0][sharp]:
        assert min((np.abs(R - T_fast[:3, :3]).max() for R, _ in slow), default=1.0) < 1e-6

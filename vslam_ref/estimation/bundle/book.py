"""Bundle adjustment in plain loops: one observation, one block, one line at a time.

This is the algorithm of :mod:`.solver` as one would write it on a blackboard.  It is slow, and it shares no
code with the fast one: other projection, other exponential, other storage, other solver.  A test asserts
that both take the same steps.

::

    for each observation (i, j):          r, J_i, J_j at the current scene
        B[i]   += J_i^T J_i               what view i says about itself
        C[j]   += J_j^T J_j               what point j says about itself
        W[i,j] += J_i^T J_j               how they depend on each other
        g[i], g[j]                        J^T r of each
    for each point j:                     eliminate it from the views that see it
        S[i,k] -= W[i,j] C[j]^-1 W[k,j]^T
        b[i]   += W[i,j] C[j]^-1 g[j]
    solve S d = b;  d_j = -C[j]^-1 (g[j] + sum_i W[i,j]^T d_i)
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.bundle.families import camera_of, model_of_set
from vslam_ref.estimation.bundle.problem import BundleProblem, Scene
from vslam_ref.estimation.robust import L2, Loss

Key = tuple[str, int]


class BookResult(NamedTuple):
    """Scene, and the cost at the start and after every step that was tried."""

    scene: Scene
    costs: list[float]


class _Blocks(NamedTuple):
    """Blocks ``H[a, b]`` and ``g[a]``, with keys ("view", i), ("lens", l), ("point", j)."""

    H: dict[tuple[Key, Key], Array]
    g: dict[Key, Array]


def bundle_adjust_book(
    problem: BundleProblem, loss: Loss | None = None, *, iterations: int = 10, damping: float = 1e-4
) -> BookResult:
    """Minimise the reprojection errors by Levenberg-Marquardt, in loops.

    Implements :eq:`eq-a1-4` (A1.4).

    Parameters
    ----------
    problem : BundleProblem
        Every observed point in front of its cameras, inside the field of the lens.
    loss : Loss, optional
        On the whitened length of each error; least squares by default.
    iterations : int
        Steps to try.
    damping : float
        First lambda.

    Returns
    -------
    BookResult

    Raises
    ------
    ValueError
        Where an observed point has no image at the start.
    """
    loss = loss or L2()
    scene, growth = problem.scene, 2.0
    cost = total_cost(problem, scene, loss)
    if not math.isfinite(cost):
        raise ValueError("an observed point has no image: the loops need points in front of their cameras")
    costs = [cost]
    for _ in range(iterations):
        blocks = normal_blocks(problem, scene, loss)
        steps, promised = damped_steps(blocks, damping)
        trial = moved(problem, scene, steps)
        new_cost = total_cost(problem, trial, loss)
        gain = (cost - new_cost) / promised  # eq-gain-ratio
        if gain > 1e-3:
            scene, cost, growth = trial, new_cost, 2.0
            damping *= max(1 / 3, 1 - (2 * min(gain, 1.0) - 1) ** 3)  # eq-nielsen
        else:
            damping, growth = damping * growth, growth * 2.0
        costs.append(cost)
    return BookResult(scene, costs)


def total_cost(problem: BundleProblem, scene: Scene, loss: Loss) -> float:
    """Sum of the loss over all observations; infinite where one has no image."""
    total = 0.0
    for o in range(len(problem.seen)):
        i, j = int(problem.seen.view[o]), int(problem.seen.point[o])
        try:
            camera = camera_of(problem.model, scene.intrinsics, int(problem.lens_of_view[i]))
        except ValueError:  # no such camera: a focal length below zero
            return math.inf
        uv, valid = camera.pixel_from_world(scene.T_cam_world[i], scene.X_world[j])
        if not valid:
            return math.inf
        error = uv - problem.seen.uv[o]  # eq-ba-residual
        total += float(loss.cost(_length(problem, o, error)))  # eq-a1-4, eq-a2-9
    return total


def normal_blocks(problem: BundleProblem, scene: Scene, loss: Loss) -> _Blocks:
    """Add up the blocks of the normal equations, observation by observation."""
    H: dict[tuple[Key, Key], Array] = {}
    g: dict[Key, Array] = {}
    for o in range(len(problem.seen)):
        i, j = int(problem.seen.view[o]), int(problem.seen.point[o])
        at = int(problem.lens_of_view[i])
        camera = camera_of(problem.model, scene.intrinsics, at)
        own = model_of_set(problem.model, at)[1]  # the block of its family
        seen = camera.pixel_from_world_with_jacobians(scene.T_cam_world[i], scene.X_world[j])
        error = seen.uv - problem.seen.uv[o]
        weight = float(loss.weight(_length(problem, o, error)))
        information = weight * _information(problem, o)  # eq-reweighted
        J = {  # eq-ba-jacobians
            ("view", i): seen.J_pose[:, problem.free.pose[i]],
            ("lens", at): seen.J_intrinsics @ problem.free.intrinsics[own],
            ("point", j): seen.J_point if problem.free.point[j] else seen.J_point[:, :0],
        }
        for a in J:
            g[a] = g.get(a, 0.0) + J[a].T @ information @ error
            for b in J:
                H[a, b] = H.get((a, b), 0.0) + J[a].T @ information @ J[b]  # eq-ba-blocks
    return _Blocks(H, g)


def damped_steps(blocks: _Blocks, damping: float) -> tuple[dict[Key, Array], float]:
    """Damped step of every block, points eliminated first, and the decrease that it promises."""
    H, g = dict(blocks.H), dict(blocks.g)
    metric = {a: np.clip(np.diag(H[a, a]), 1e-6, 1e32) for a in g}
    for a in g:
        H[a, a] = H[a, a] + damping * np.diag(metric[a])  # eq-ba-normal, damped
    rest = [a for a in g if a[0] != "point"]
    points = [a for a in g if a[0] == "point" and len(g[a])]
    S = {(a, b): H[a, b].copy() for a in rest for b in rest if (a, b) in H}
    rhs = {a: -g[a] for a in rest}
    for p in points:
        inverse = np.linalg.inv(H[p, p])
        meets = [a for a in rest if (a, p) in H]
        for a in meets:
            rhs[a] = rhs[a] + H[a, p] @ inverse @ g[p]  # eq-schur
            for b in meets:
                S[a, b] = S.get((a, b), 0.0) - H[a, p] @ inverse @ H[p, b]  # eq-covisibility
    steps = _solve(S, rhs, rest)
    for p in points:
        pulled = g[p] + sum((H[p, a] @ steps[a] for a in rest if (p, a) in H), np.zeros(3))
        steps[p] = -np.linalg.inv(H[p, p]) @ pulled  # eq-back-substitution
    square = sum(float(metric[a] @ steps[a] ** 2) for a in steps)
    slope = sum(float(g[a] @ steps[a]) for a in steps)
    return steps, 0.5 * (damping * square - slope)


def _solve(S: dict[tuple[Key, Key], Array], rhs: dict[Key, Array], keys: list[Key]) -> dict[Key, Array]:
    """Solve the blocks as one dense system."""
    if not keys:
        return {}
    empty = {(a, b): np.zeros((len(rhs[a]), len(rhs[b]))) for a in keys for b in keys}
    dense = np.block([[S.get((a, b), empty[a, b]) for b in keys] for a in keys])
    flat = np.linalg.solve(dense, np.concatenate([rhs[a] for a in keys]))
    ends = np.cumsum([len(rhs[a]) for a in keys])[:-1]
    return dict(zip(keys, np.split(flat, ends), strict=True))


def moved(problem: BundleProblem, scene: Scene, steps: dict[Key, Array]) -> Scene:
    """Scene after the steps (6,) of views and (3,) of points: T <- expm(hat(xi)) T, all else by addition."""
    from scipy.linalg import expm

    T, X, lenses = scene.T_cam_world.copy(), scene.X_world.copy(), scene.intrinsics.copy()
    for (kind, number), step in steps.items():
        if kind == "point":
            X[number] += step
        elif kind == "lens":
            own = model_of_set(problem.model, number)[1]
            lenses[number, own] += problem.free.intrinsics[own] @ step
        else:
            xi = np.zeros(6)
            xi[problem.free.pose[number]] = step
            x, y, z, a, b, c = xi
            generator = np.array([[0, -c, b, x], [c, 0, -a, y], [-b, a, 0, z], [0, 0, 0, 0]])
            T[number] = expm(generator) @ T[number]
    return Scene(T, X, lenses)


def _information(problem: BundleProblem, o: int) -> Array:
    """Inverse covariance of an observation."""
    cov = problem.seen.cov_uv
    return np.eye(2) if cov is None else np.asarray(np.linalg.inv(cov[o]))


def _length(problem: BundleProblem, o: int, error: Array) -> float:
    """Length of an error in standard deviations."""
    return math.sqrt(float(error @ _information(problem, o) @ error))

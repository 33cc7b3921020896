"""Inputs for the twins of bundle adjustment; lengths are of order 1, so that one tolerance fits all."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vslam_ref.estimation.bundle import (
    BundleProblem,
    Families,
    Freedom,
    Observations,
    Scene,
    freedom,
    schur,
)
from vslam_ref.estimation.bundle.normal import normal_equations
from vslam_ref.estimation.bundle.structure import Structure, structure
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Fisheye, Radtan

Rng = np.random.Generator


ALL = ("f", "cx", "k1", "k2", "p1", "p2", "k3")


def problem(
    rng: Rng, B: int, n: int, *, shared: bool, held: bool, intrinsics: tuple[str, ...] = ALL
) -> tuple[BundleProblem, Structure]:
    """B + 1 views, 2 n points, some behind a camera; a lens of unit focal length."""
    views, points, sets = B + 1, 2 * n, 1 if shared else B + 1
    T = se3.perturb(np.eye(4), 0.2 * rng.standard_normal((views, 6)) + [0, 0, 3.0, 0, 0, 0])
    X = rng.uniform(-1, 1, (points, 3))
    X[0, 2] = -4.0
    lens = rng.normal(0, 0.05, (sets, 9)) + [1, 1, 0, 0, 0, 0, 0, 0, 0]
    scene = Scene(T, X, lens)
    view, point = (a.ravel() for a in np.meshgrid(np.arange(views), np.arange(points)))
    keep = rng.random(len(view)) < 0.8
    uv = rng.normal(0, 0.3, (int(keep.sum()), 2))
    free = freedom(Radtan, scene, intrinsics=intrinsics)
    pose = free.pose.copy()
    if held:
        pose[0], pose[-1, 2] = False, False
    free = Freedom(pose, np.arange(points) != 1, free.intrinsics)
    seen = Observations(view[keep], point[keep], uv)
    given = BundleProblem(Radtan, scene, seen, free=free)
    return given, structure(given)


def for_residuals(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return _moving(*problem(rng, B, n, shared=False, held=False))


def for_normal(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    given, table = problem(rng, B, n, shared=False, held=False)
    U = rng.normal(size=(len(table.order), 2, 2))
    orders = (table.offsets, table.view_order, table.view_offsets)
    return (*_moving(given, table), U, given.free.intrinsics, *orders)


def _moving(given: BundleProblem, table: Structure) -> tuple[Any, ...]:
    state = table.state(given)
    return (*state[:3], state.intrinsics, *table.links)


def _for_schur(
    rng: Rng, B: int, n: int, shared: bool, held: bool, intrinsics: tuple[str, ...] = ALL
) -> tuple[Any, ...]:
    given, table = problem(rng, B, n, shared=shared, held=held, intrinsics=intrinsics)
    weights = rng.uniform(0.5, 1, len(table.order))
    normal = normal_equations(given.model, table.state(given), table, weights, given.free.intrinsics)
    M = schur.point_factor(normal.C, np.ones((2 * n, 3)), table.free_point)
    sizes = (table.links.view, table.columns, table.size, table.offsets)
    return (normal.B, normal.g_view, normal.g_point, normal.W, M, *sizes)


def for_schur(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return _for_schur(rng, B, n, shared=False, held=False)


def for_schur_of_nine(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Nine columns a view, a width for which loops are unrolled; six are among the shared ones."""
    return _for_schur(rng, B, n, shared=False, held=False, intrinsics=("f", "k1", "k2"))


def for_schur_shared(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return _for_schur(rng, B, n, shared=True, held=False)


def for_schur_held(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return _for_schur(rng, B, n, shared=False, held=True)


def for_schur_shared_held(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return _for_schur(rng, B, n, shared=True, held=True)


def for_schur_of_families(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """Shared lenses of two families: the first column of some is missing, and so is the last of others."""
    views, points = 2 * (B + 1), 2 * n
    model = Families((Radtan, Fisheye), (1, 0, 1))
    lens = np.zeros((3, model.width))
    for number, family in enumerate(model.of_set):
        own = model.columns(family)
        lens[number, own] = rng.normal(0, 0.02, own.stop - own.start)
        lens[number, own.start : own.start + 2] += 1.0
    T = se3.perturb(np.eye(4), 0.2 * rng.standard_normal((views, 6)) + [0, 0, 3.0, 0, 0, 0])
    scene = Scene(T, rng.uniform(-1, 1, (points, 3)), lens)
    view, point = (a.ravel() for a in np.meshgrid(np.arange(views), np.arange(points)))
    keep = rng.random(len(view)) < 0.8
    seen = Observations(view[keep], point[keep], rng.normal(0, 0.3, (int(keep.sum()), 2)))
    free = freedom(model, scene, intrinsics=("p1", "f", "k1", "k4"))
    given = BundleProblem(model, scene, seen, np.arange(views) % 3, free)
    table = structure(given)
    weights = rng.uniform(0.5, 1, len(table.order))
    normal = normal_equations(model, table.state(given), table, weights, free.intrinsics)
    M = schur.point_factor(normal.C, np.ones((points, 3)), table.free_point)
    sizes = (table.links.view, table.columns, table.size, table.offsets)
    return (normal.B, normal.g_view, normal.g_point, normal.W, M, *sizes)


def for_point_steps(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    _, _, g_point, W, M, view, columns, _, offsets = for_schur(rng, B, n)
    return W, M, g_point, rng.normal(size=columns.shape), view, offsets


ROWS: dict[str, list[Callable[[Rng, int, int], tuple[Any, ...]]]] = {
    "bundle:polynomial_residuals": [for_residuals],
    "bundle:polynomial_normal": [for_normal],
    "bundle_schur:schur_complement": [
        for_schur,
        for_schur_of_nine,
        for_schur_shared,
        for_schur_held,
        for_schur_shared_held,
        for_schur_of_families,
    ],
    "bundle_schur:point_steps": [for_point_steps],
}


def meant(twin: str, outputs: list[np.ndarray]) -> list[np.ndarray]:
    """What of the outputs means something: of S the lower triangle."""
    if twin == "bundle_schur:schur_complement":
        return [np.tril(outputs[0]), *outputs[1:]]
    return outputs

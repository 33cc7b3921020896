"""Lenses of several families: derivatives, both backends, separate solves, the way back to the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vslam_ref import _kernels
from vslam_ref.estimation.bundle import (
    BundleProblem,
    Families,
    Freedom,
    Observations,
    Options,
    Scene,
    book,
    bundle_adjust,
    covariance,
    freedom,
    schur,
)
from vslam_ref.estimation.bundle.families import camera_of, own_columns
from vslam_ref.estimation.bundle.gauge import fix_gauge
from vslam_ref.estimation.bundle.normal import normal_equations
from vslam_ref.estimation.bundle.projection import BundleState, linearise, residuals
from vslam_ref.estimation.bundle.structure import structure
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.cameras import Fisheye, Fov, Pinhole, Radtan

from .conftest import CAMERAS, poses

OF_SET = (1, 0, 1, 2)
FAMILIES = Families((Radtan, Fisheye, Fov), OF_SET)
NAMES = ("k1", "f", "p2", "k4", "omega")
"""The first is of two families, the third of one, so that a column of the others is missing amid the rest."""
BACKENDS = [
    "numpy",
    pytest.param("numba", marks=pytest.mark.skipif("numba" not in _kernels.available(), reason="no Numba")),
]


def intrinsics() -> np.ndarray:
    table = np.zeros((len(OF_SET), FAMILIES.width))
    for number, name in enumerate(("fisheye", "radtan", "fisheye", "fov")):
        params = CAMERAS[name].params.copy()
        params[:4] *= 1.0 + 0.02 * number
        table[number, FAMILIES.columns(OF_SET[number])] = params
    return table


def pixels(scene: Scene, view: np.ndarray, point: np.ndarray, lens: np.ndarray) -> np.ndarray:
    """One camera and one point at a time, by the cameras' own methods."""
    rows = []
    for i, j in zip(view, point, strict=True):
        camera = camera_of(FAMILIES, scene.intrinsics, int(lens[i]))
        uv, valid = camera.pixel_from_world(scene.T_cam_world[i], scene.X_world[j])
        assert valid
        rows.append(uv)
    return np.array(rows)


def problem(
    rng: np.random.Generator,
    *,
    views: int = 8,
    points: int = 15,
    names: tuple[str, ...] = NAMES,
    noise: float = 0.0,
    moved: float = 0.01,
) -> tuple[BundleProblem, Scene]:
    """Views that share four lenses of three families; the problem starts away from the truth."""
    truth = Scene(poses(views), rng.uniform(-1.5, 1.5, (points, 3)), intrinsics())
    lens = np.arange(views) % len(OF_SET)
    view, point = (each.ravel() for each in np.meshgrid(np.arange(views), np.arange(points), indexing="ij"))
    keep = rng.uniform(size=len(view)) < 0.85
    view, point = view[keep], point[keep]
    uv = pixels(truth, view, point, lens) + noise * rng.standard_normal((len(view), 2))
    free = freedom(FAMILIES, truth, intrinsics=names)
    off = 1e-2 * (free.intrinsics @ rng.standard_normal(len(names)))
    K = truth.intrinsics + np.where(FAMILIES.own, off * np.where(truth.intrinsics > 1, 100.0, 0.3), 0.0)
    T = se3.perturb(truth.T_cam_world, moved * rng.standard_normal((views, 6)))
    start = Scene(T, truth.X_world + moved * rng.standard_normal(truth.X_world.shape), K)
    return BundleProblem(FAMILIES, start, Observations(view, point, uv), lens, free), truth


# --- derivatives -----------------------------------------------------------------------------------


def dense_jacobian(given: BundleProblem) -> np.ndarray:
    """Columns of the views' poses, of every set's own free directions, and of the points, by differences."""
    table = structure(given)
    state = table.state(given)
    links = table.links

    def r_of(state: BundleState) -> np.ndarray:
        return residuals(given.model, state, links).r.ravel()

    def pose(i: int, xi: np.ndarray) -> BundleState:
        R, t = state.R_cam_world.copy(), state.t_cam_world.copy()
        T = se3.exp(xi) @ se3.from_rt(R[i], t[i])
        R[i], t[i] = T[:3, :3], T[:3, 3]
        return state._replace(R_cam_world=R, t_cam_world=t)

    def moved(name: str, row: int, step: np.ndarray) -> BundleState:
        values = getattr(state, name).copy()
        values[row] += step
        return state._replace(**{name: values})

    columns, h = [], 1e-6
    for i in range(given.sizes[0]):
        for e in np.eye(6):
            columns.append((r_of(pose(i, h * e)) - r_of(pose(i, -h * e))) / (2 * h))
    for number in range(len(given.scene.intrinsics)):
        own = own_columns(given.model, len(given.scene.intrinsics))[number]
        for direction in given.free.intrinsics.T * own:
            if direction.any():
                # pixels are linear in all of them but omega: a longer step rounds less
                plus, minus = (moved("intrinsics", number, s * 1e-4 * direction) for s in (1, -1))
                columns.append((r_of(plus) - r_of(minus)) / 2e-4)
    for j in range(given.sizes[1]):
        for e in np.eye(3):
            plus, minus = (moved("X_world", j, s * h * e) for s in (1, -1))
            columns.append((r_of(plus) - r_of(minus)) / (2 * h))
    return np.array(columns).T


def columns_in_order(given: BundleProblem) -> np.ndarray:
    """Number in the dense Jacobian of every column of the reduced system."""
    table = structure(given)
    views = given.sizes[0]
    place = np.full(table.size + 1, -1)
    place[table.columns[:, :6].ravel()] = np.arange(6 * views)
    at = 6 * views
    for number in range(len(given.scene.intrinsics)):
        view = int(np.flatnonzero(given.lens_of_view == number)[0])
        mine = table.columns[view, 6:]
        mine = mine[mine < table.size]
        place[mine] = at + np.arange(len(mine))
        at += len(mine)
    return place[: table.size]


def test_the_jacobians_are_the_differences(rng: np.random.Generator) -> None:
    given, _ = problem(rng, views=4, points=6)
    table = structure(given)
    at = linearise(FAMILIES, table.state(given), table.links, given.free.intrinsics)
    J = dense_jacobian(given)
    order = columns_in_order(given)
    assert sorted(order) == list(range(table.size))
    n, links = len(at.r), table.links
    built = np.zeros((2 * n, table.size + 1))
    for k in range(n):
        for a, column in enumerate(table.columns[links.view[k]]):
            built[2 * k : 2 * k + 2, column] += at.J_view[k, :, a]
    np.testing.assert_allclose(built[:, :-1], J[:, order], rtol=0, atol=1e-4)  # pixels per unit; f is 500
    assert (built[:, -1] == 0.0).all()  # nothing is lost in the column that is thrown away
    for k in range(n):
        part = J[2 * k : 2 * k + 2, table.size + 3 * links.point[k] :][:, :3]
        np.testing.assert_allclose(at.J_point[k], part, rtol=0, atol=1e-4)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("views", [4, 8])
def test_the_reduced_system_is_that_of_the_dense_jacobian(
    rng: np.random.Generator, backend: str, views: int
) -> None:
    """With 8 views lenses are shared, and the first column of some is missing; with 4 each has its own."""
    given, _ = problem(rng, views=views, points=9, names=("p2", "k1", "f", "k4", "omega"))
    J = dense_jacobian(given)
    table = structure(given)
    order = np.concatenate([columns_in_order(given), np.arange(table.size, J.shape[1])])
    J = J[:, order]
    r = residuals(FAMILIES, table.state(given), table.links).r.ravel()
    damping = 0.1 * (J * J).sum(0)
    H, g, D = J.T @ J + np.diag(damping), J.T @ r, table.size
    S = H[:D, :D] - H[:D, D:] @ np.linalg.solve(H[D:, D:], H[D:, :D])
    rhs = -g[:D] + H[:D, D:] @ np.linalg.solve(H[D:, D:], g[D:])
    with _kernels.use_backend(backend):
        state, weights = table.state(given), np.ones(len(table.order))
        normal = normal_equations(FAMILIES, state, table, weights, given.free.intrinsics)
        M = schur.point_factor(normal.C, damping[D:].reshape(-1, 3), table.free_point)
        found = schur.reduce(normal, M, damping[:D], table)
    scale = np.sqrt(np.diag(S))
    off = np.tril(found.S - S) / np.outer(scale, scale)
    assert np.abs(off).max() < 1e-6  # differences know a derivative to 1e-7 or so of itself
    np.testing.assert_allclose(found.rhs / scale, rhs / scale, rtol=0, atol=1e-6 * np.abs(rhs / scale).max())


def test_both_backends_add_up_the_same(rng: np.random.Generator) -> None:
    if "numba" not in _kernels.available():
        pytest.skip("no Numba")
    given, _ = problem(rng)
    table = structure(given)
    weights = rng.uniform(0.2, 1.0, len(table.order))
    both = []
    for backend in ("numpy", "numba"):
        with _kernels.use_backend(backend):
            state = table.state(given)
            both.append(normal_equations(FAMILIES, state, table, weights, given.free.intrinsics))
    for one, other in zip(*both, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * np.abs(one).max())


# --- solutions -------------------------------------------------------------------------------------


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("views", [4, 12])
def test_a_moved_start_returns_to_the_truth(rng: np.random.Generator, backend: str, views: int) -> None:
    given, truth = problem(rng, views=views, points=40, names=("f", "k1", "omega"))
    anchors = Freedom(given.free.pose.copy(), given.free.point, given.free.intrinsics)
    anchors.pose[0] = anchors.pose[views - 1] = False
    T = given.scene.T_cam_world.copy()
    T[[0, -1]] = truth.T_cam_world[[0, -1]]
    held = replace(given, scene=replace(given.scene, T_cam_world=T), free=anchors)
    with _kernels.use_backend(backend):
        found = bundle_adjust(held, options=Options(cost=1e-16))
    assert found.converged
    scene = found.problem.scene
    assert found.rmse_px < 1e-7
    assert np.abs(scene.X_world - truth.X_world).max() < 1e-6
    assert (
        np.abs(so3.log(scene.T_cam_world[:, :3, :3] @ truth.T_cam_world[:, :3, :3].swapaxes(1, 2))).max()
        < 1e-7
    )
    off = np.abs(scene.intrinsics - truth.intrinsics) / np.maximum(1.0, truth.intrinsics)
    assert off.max() < 1e-6
    assert (scene.intrinsics[~FAMILIES.own] == 0.0).all()


def test_families_without_a_point_in_common_are_two_problems(rng: np.random.Generator) -> None:
    """Half the cameras see half the points: the minimum is that of each half by itself."""
    given, _ = problem(rng, views=8, points=30, names=("f", "k1"), noise=0.5)
    fisheye = np.isin(given.lens_of_view, (0, 2))
    seen = given.seen
    apart = seen.only(fisheye[seen.view] == (seen.point < 15))
    whole = replace(given, seen=apart)
    options = Options(cost=1e-14, gradient=1e-12)
    together = bundle_adjust(whole, options=options)
    total = 0.0
    for mine in (fisheye, ~fisheye):
        views = np.flatnonzero(mine)
        part = apart.only(mine[apart.view])
        part = replace(part, view=np.searchsorted(views, part.view))
        scene = replace(given.scene, T_cam_world=given.scene.T_cam_world[views])
        lens = given.lens_of_view[views]
        free = Freedom(given.free.pose[views], given.free.point, given.free.intrinsics)
        model, sets = FAMILIES, scene
        if mine is fisheye:  # a problem of one family, the usual way
            block = FAMILIES.columns(1)
            sets = replace(scene, intrinsics=scene.intrinsics[[0, 2]][:, block])
            lens, free = lens // 2, replace(free, intrinsics=free.intrinsics[block])
            alone = bundle_adjust(BundleProblem(Fisheye, sets, part, lens, free), options=options)
        else:
            alone = bundle_adjust(BundleProblem(model, sets, part, lens, free), options=options)
        assert alone.converged
        total += alone.cost
        rows = mine[apart.view]
        np.testing.assert_allclose(together.residual[rows], alone.residual, rtol=0, atol=1e-4)
    assert together.converged
    assert together.cost == pytest.approx(total, rel=1e-9)


def test_the_book_takes_the_same_steps(rng: np.random.Generator) -> None:
    given, _ = problem(rng, points=20, noise=0.3)
    slow = book.bundle_adjust_book(given, iterations=5)
    fast = bundle_adjust(given, options=Options(max_iterations=5, cost=0.0, gradient=0.0))
    np.testing.assert_allclose([step.cost for step in fast.history], slow.costs[1:], rtol=1e-9)
    np.testing.assert_allclose(fast.problem.scene.intrinsics, slow.scene.intrinsics, rtol=1e-7, atol=1e-9)


def test_columns_that_are_not_there_leave_the_covariance_regular(rng: np.random.Generator) -> None:
    given, _ = problem(rng, points=25, names=("f", "k1", "omega"), noise=0.3)
    found = bundle_adjust(given)
    held = fix_gauge(found.problem)
    views = [1, 3]
    ours = covariance(replace(found, problem=held), views)
    assert ours.reason == ""
    J = dense_jacobian(held)
    order = columns_in_order(replace(held, free=found.problem.free))
    table = structure(found.problem)
    free = np.ones(J.shape[1], dtype=np.bool_)
    free[: 6 * held.sizes[0]] = held.free.pose.ravel()
    H = np.linalg.inv(J[:, free].T @ J[:, free])
    where = np.cumsum(free) - 1
    rows = where[[6 * v + a for v in views for a in range(6)]]
    assert free[[6 * v + a for v in views for a in range(6)]].all()
    redundancy = 2 * len(found.residual) - int(free.sum())
    assert len(order) == table.size
    sigma = np.sqrt((found.residual**2).sum() / redundancy)
    assert ours.sigma == pytest.approx(sigma, rel=1e-9)
    assert ours.matrix is not None
    expected = sigma**2 * H[np.ix_(rows, rows)]
    np.testing.assert_allclose(ours.matrix, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


# --- what is refused -------------------------------------------------------------------------------


def test_what_makes_no_families_is_refused(rng: np.random.Generator) -> None:
    with pytest.raises(ValueError, match="two camera models or more"):
        Families((Radtan,), (0,))
    with pytest.raises(ValueError, match="all different"):
        Families((Radtan, Radtan), (0, 1))
    with pytest.raises(ValueError, match="there are 2, from 0"):
        Families((Radtan, Pinhole), (0, 2))
    given, _ = problem(rng)
    K = given.scene.intrinsics.copy()
    K[0, 0] = 500.0  # Radtan's fx, of a fisheye
    with pytest.raises(ValueError, match="zero outside the block"):
        replace(given, scene=replace(given.scene, intrinsics=K))
    with pytest.raises(ValueError, match=r"Radtan needs fx, .* and Fisheye needs"):
        replace(given, scene=replace(given.scene, intrinsics=K[:, 1:]))
    with pytest.raises(ValueError, match=r"intrinsics\[0\] make no Fisheye"):
        replace(given, scene=replace(given.scene, intrinsics=0.0 * K))
    with pytest.raises(ValueError, match=r"intrinsic 'g': Radtan has .*; Fisheye has .*; Fov has"):
        freedom(FAMILIES, given.scene, intrinsics=("g",))
    with pytest.raises(ValueError, match="families of 4 sets"):
        replace(given, scene=replace(given.scene, intrinsics=np.vstack([intrinsics(), intrinsics()])))

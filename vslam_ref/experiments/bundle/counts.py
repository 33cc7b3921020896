"""The arrow matrix of bundle adjustment, drawn; and what its elimination costs, counted in two orders."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets import catalogue
from vslam_ref.datasets.bundle_files import read_bal
from vslam_ref.estimation.bundle import BundleProblem, Freedom, Observations, Scene, reduced_system, schur
from vslam_ref.estimation.bundle.normal import Normal, normal_equations
from vslam_ref.estimation.bundle.structure import Structure, structure
from vslam_ref.experiments.bundle.elimination import (
    DAMPING,
    analytic,
    banded_cost,
    dense_cost,
    differenced,
    elimination_cost,
    factor_pattern,
    point_cost,
)
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.worlds import bundles
from vslam_ref.worlds.bundles import make_bundle

BAL_FILE = "problem-16-22106-pre.txt.bz2"


@dataclass(frozen=True)
class SparsityConfig:
    """What is drawn and counted."""

    seed: int = field(default=16, metadata={"reason": "any; fixed for repeatability"})
    drawn: int = field(default=40, metadata={"reason": "points in the drawing; more hide the blocks"})
    counted: int = field(
        default=300, metadata={"reason": "points in the count of both orders: views first fills everything"}
    )
    views: tuple[int, ...] = field(
        default=(15, 30, 60, 120), metadata={"reason": "lengths of the walk; a power law shows"}
    )
    points_per_view: int = field(default=12, metadata={"reason": "new points per keyframe of a small map"})
    reach: float = field(default=2.0, metadata={"reason": "a point is seen by some 8 views", "unit": "m"})

    def __post_init__(self) -> None:
        """Refuse what cannot be counted."""
        if self.drawn < 5 or self.counted < 20 or self.points_per_view < 4 or not 1 <= self.reach <= 3:
            raise ValueError("need drawn >= 5, counted >= 20, points_per_view >= 4 and 1 <= reach <= 3")
        if len(self.views) < 3 or min(self.views) < 10 or list(self.views) != sorted(set(self.views)):
            raise ValueError(f"views={self.views}: need three or more rising numbers from 10 on")


class DrawnSystem(NamedTuple):
    """One drawn problem: H, its columns of views first, and its factors.

    Attributes
    ----------
    H : ndarray, shape (d V + 3 N, d V + 3 N)
        J^T J, with J by central differences of all residuals in all unknowns.
    points_first, views_first : ndarray of bool, shape (d V + 3 N, d V + 3 N)
        Where the Cholesky factor has numbers.
    sees : ndarray of bool, shape (V, N)
    d : int
        Columns of a view.
    real : bool
    """

    H: Array
    points_first: NDArray[np.bool_]
    views_first: NDArray[np.bool_]
    sees: NDArray[np.bool_]
    d: int
    real: bool


class OperationCounts(NamedTuple):
    """Operations of one problem, by order of elimination.

    ``points_first`` and ``views_first`` are measured, ``predicted`` is for the former; ``whole`` is the
    dense matrix.
    """

    points_first: float
    predicted: float
    views_first: float
    whole: float


class Walk(NamedTuple):
    """Operations for one length of the walk, points eliminated first everywhere.

    Attributes
    ----------
    views : ndarray, shape ()
    points : ndarray, shape ()
        For the points alone.
    dense, banded, shuffled : ndarray, shape ()
        For S: as a dense matrix; in the package's order, measured; in the file's order, measured.
    predicted : ndarray, shape ()
        For S, in a band of the package's bandwidth.
    whole : ndarray, shape ()
        The dense matrix of all unknowns.
    difference : ndarray, shape ()
        Largest relative difference of the dense and the banded solution.
    missing, extra : ndarray, shape ()
        Pairs of views that share a point and have no block in S; and the other way round.
    """

    views: Array
    points: Array
    dense: Array
    banded: Array
    shuffled: Array
    predicted: Array
    whole: Array
    difference: Array
    missing: Array
    extra: Array


def real_problem(config: SparsityConfig) -> tuple[BundleProblem, bool]:
    """The BAL problem where it is found, else a simulated one; and whether it is real."""
    folder = catalogue.find("bal")
    if folder is not None and (folder / BAL_FILE).is_file():
        return read_bal(folder / BAL_FILE).problem, True
    rng = np.random.default_rng(config.seed)
    bundle = make_bundle(np.linspace(-0.7, 0.7, 16), 2 * config.counted, rng)
    rank = np.argsort(np.argsort(rng.uniform(size=(16, 2 * config.counted)), axis=0), axis=0)
    keep = rank[bundle.view, bundle.point] < 4  # every point is seen by four of the views
    seen = Observations(bundle.view[keep], bundle.point[keep], bundle.uv[keep])
    return BundleProblem(Pinhole, bundle.truth, seen), False


def with_points(problem: BundleProblem, chosen: IntArray) -> BundleProblem:
    """The problem with some of its points only."""
    table = np.full(problem.sizes[1], -1)
    table[chosen] = np.arange(len(chosen))
    keep = table[problem.seen.point] >= 0
    part = problem.seen.only(keep)
    scene = Scene(problem.scene.T_cam_world, problem.scene.X_world[chosen], problem.scene.intrinsics)
    free = Freedom(problem.free.pose, problem.free.point[chosen], problem.free.intrinsics)
    seen = Observations(part.view, table[part.point], part.uv)
    return BundleProblem(problem.model, scene, seen, problem.lens_of_view, free)


def walk(config: SparsityConfig, views: int) -> BundleProblem:
    """The walk of a length."""
    return bundles.walk(views, config.seed, config.points_per_view, config.reach)


def point_columns(problem: BundleProblem) -> tuple[IntArray, int]:
    """How many views see each point, and the columns of a view."""
    return np.bincount(problem.seen.point, minlength=problem.sizes[1]), 6 + problem.free.intrinsics.shape[1]


def arrow(problem: BundleProblem, real: bool, config: SparsityConfig) -> DrawnSystem:
    """The drawn matrices."""
    from scipy.sparse import csc_array

    counts, d = point_columns(problem)
    rng = np.random.default_rng([config.seed, 1])
    # seen often enough to be determined; by view, so that the drawing has an order
    chosen = np.sort(rng.choice(np.flatnonzero(counts >= 3), config.drawn, replace=False))
    part = with_points(problem, chosen)
    J, sees = differenced(part), np.zeros(part.sizes[:2], dtype=np.bool_)
    sees[part.seen.view, part.seen.point] = True
    H, D = csc_array(J.T @ J), d * part.sizes[0]
    everything = np.arange(H.shape[0])
    orders = (np.concatenate([everything[D:], everything[:D]]), everything)
    patterns = [factor_pattern(H, order).toarray() != 0 for order in orders]
    return DrawnSystem(H.toarray(), patterns[0], patterns[1], sees, d, real)


def _normal(problem: BundleProblem) -> tuple[Normal, Structure]:
    table = structure(problem)
    state, weights = table.state(problem), np.ones(problem.sizes[2])
    return normal_equations(problem.model, state, table, weights, problem.free.intrinsics), table


def views_system(problem: BundleProblem) -> tuple[Array, IntArray]:
    """S (D, D), slightly damped, in the file's order of views; and the columns in the package's order."""
    normal, table = _normal(problem)
    size = schur.diagonals(normal, table)
    M = schur.point_factor(normal.C, DAMPING * size.point, table.free_point)
    S, _ = schur.reduce(normal, M, DAMPING * size.view, table)
    S = np.tril(S) + np.tril(S, -1).T
    own = table.columns.ravel()
    return S[np.ix_(own, own)], np.argsort(own)


def count_orders(problem: BundleProblem, config: SparsityConfig) -> OperationCounts:
    """Points first and views first, on a part of the problem."""
    chosen = np.arange(min(config.counted, problem.sizes[1]))
    part = with_points(problem, chosen)
    J = analytic(part)
    H, (seen, d) = (J.T @ J).tocsc(), point_columns(part)
    D = d * part.sizes[0]
    everything = np.arange(H.shape[0])
    first = elimination_cost(H, np.concatenate([everything[D:], everything[:D]]))[0]
    last = elimination_cost(H, everything)[0]
    return OperationCounts(first, point_cost(seen, d) + dense_cost(D), last, dense_cost(len(everything)))


def simulate(config: SparsityConfig, views: int, unit: None) -> Walk:
    """All counts for one length of the walk."""
    problem = walk(config, views)
    J, table = analytic(problem), structure(problem)
    H = (J.T @ J).tocsc()
    D = (6 + problem.free.intrinsics.shape[1]) * views
    S, by_rank = views_system(problem)
    points = np.arange(D, H.shape[0])
    sorted_cost, counts = elimination_cost(H, np.concatenate([points, by_rank]))
    shuffled_cost, _ = elimination_cost(H, np.concatenate([points, np.arange(D)]))
    for_points = float(np.sum(counts[: len(points)].astype(np.float64) ** 2))
    rhs = np.random.default_rng([config.seed, views, 1]).standard_normal(D)
    difference = _dense_against_banded(S[np.ix_(by_rank, by_rank)], rhs, table)
    missing, extra = fill_against_covisibility(S, problem)
    numbers = (
        views, for_points, dense_cost(D), sorted_cost - for_points, shuffled_cost - for_points,
        banded_cost(D, table.bandwidth), dense_cost(H.shape[0]), difference, missing, extra,
    )  # fmt: skip
    return Walk(*(np.array(number) for number in numbers))


def _dense_against_banded(S: Array, rhs: Array, table: Structure) -> float:
    """Largest relative difference of the package's two solutions."""
    solved = []
    methods: tuple[reduced_system.Method, ...] = ("dense", "banded")
    for method in methods:
        factor = reduced_system.factor(S, table.border, table.bandwidth, method)
        if factor is None:
            raise ValueError("the reduced system is not positive definite")
        solved.append(factor.solve(rhs))
    return float(np.abs(solved[0] - solved[1]).max() / np.abs(solved[0]).max())


def fill_against_covisibility(S: Array, problem: BundleProblem) -> tuple[int, int]:
    """Pairs of views that share a point and have no block in S; and pairs with a block and no such point."""
    V, N, _ = problem.sizes
    sees = np.zeros((V, N), dtype=np.int64)
    sees[problem.seen.view, problem.seen.point] = 1
    together = sees @ sees.T > 0
    d = len(S) // V
    blocks = np.abs(S.reshape(V, d, V, d)).max(axis=(1, 3)) > 0.0
    return int(np.sum(together & ~blocks)), int(np.sum(blocks & ~together))

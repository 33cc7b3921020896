"""``vslam-ref bench posegraph``: pose graphs on this machine, beside GTSAM and g2o.

===== =============================================================================================
goal  what is measured, on one thread, in CPU seconds, medians of paired ratios
===== =============================================================================================
PG-1  Gauss-Newton from the same start, ours (ordering and pattern included) over GTSAM's, with both its
      orderings, to the same chi²; over g2o's for the same number of steps, in g2o's convention
===== =============================================================================================

Building a problem is not timed.  Where the public graphs are not found, a robot that goes round a block is
solved in their place.  Peers that are not installed are named and left out (``pip install ".[peers]"``,
``pip install g2opy``).
"""

from __future__ import annotations

import contextlib
import importlib
from collections import defaultdict
from collections.abc import Callable
from importlib.util import find_spec
from statistics import median
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from vslam_ref import _kernels
from vslam_ref._kernels import available
from vslam_ref.bench.bundle import Timed, cpu
from vslam_ref.bench.rows import Part, Row, each_backend, measured, row
from vslam_ref.datasets import catalogue
from vslam_ref.datasets.pose_graph_files import read_pose_graph
from vslam_ref.estimation.posegraph import Options, PoseGraph, odometry_start, solve_graph
from vslam_ref.estimation.posegraph.errors import Convention
from vslam_ref.estimation.posegraph.system import GraphProblem
from vslam_ref.worlds.rounds import make_rounds

GOALS_PG_1 = {"intel": 1.0, "manhattan": 1.0, "sphere2500": 1.3}
ORDERINGS = ("COLAMD", "METIS")
GTSAM_TOLERANCE = Options(damping=0.0, cost=1e-5)
"""GTSAM ends where a step decreases the cost by less than 1e-5 of it: so do we, here."""
PEERS = ("gtsam", "g2opy")

Solver = Callable[[], np.ndarray]
"""Solves once and returns the poses."""


def run(quick: bool = False) -> dict[str, Any]:
    """Measure everything; ``rows`` is a list of flat records, one per figure."""
    missing = [name for name in PEERS if find_spec(name) is None]
    for name in ("scipy.sparse.linalg", "scipy.sparse.csgraph", *PEERS):
        with contextlib.suppress(ImportError):
            importlib.import_module(name)  # a limit of threads holds for what is loaded
    for backend in each_backend():
        if backend == "numba":
            _kernels.warm("fronts")
        solve_graph(make_rounds("se2", np.random.default_rng(0)).graph)
    graphs, pairs = known_graphs(quick), 2 if quick else 7
    parts: dict[str, Part] = {}
    if "gtsam" not in missing:
        parts["GTSAM"] = lambda: against_gtsam(graphs, pairs)
    if "g2opy" not in missing:
        parts["g2o"] = lambda: against_g2o(graphs, pairs)
    with threadpool_limits(1):
        rows = measured("posegraph", parts)
    return {"rows": rows, "threads": 1, "missing peers": ", ".join(missing) or "none"}


def known_graphs(quick: bool) -> dict[str, PoseGraph]:
    """Public graphs with their starts; simulated ones where these are not found."""
    folder = catalogue.find("pose_graphs")
    if folder is None:
        rng = np.random.default_rng(1)
        rounds = 3 if quick else 30
        return {f"rounds in {s}": make_rounds(s, rng, rounds=rounds).graph for s in ("se2", "se3")}
    graphs = {}
    for name in list(GOALS_PG_1)[: 1 if quick else None]:
        file = read_pose_graph(folder / f"{name}.g2o")
        graph = file.graph
        graphs[name] = graph if file.placed.all() else graph.at(odometry_start(graph))
    return graphs


def chi2(graph: PoseGraph, T_world: np.ndarray, convention: Convention = "log") -> float:
    """chi² of poses: the one function that judges every solver's result."""
    return float(GraphProblem(graph, convention).at(T_world).squares.sum())


def ours(graph: PoseGraph, backend: str, convention: Convention, options: Options) -> Timed:
    """Our solution from the graph's poses."""
    with _kernels.use_backend(backend):
        return cpu(lambda: solve_graph(graph, convention=convention, options=options))


def against_gtsam(graphs: dict[str, PoseGraph], pairs: int) -> list[Row]:
    """PG-1."""
    rows = []
    for name, graph in graphs.items():
        ratios, excess, steps = defaultdict(list), -1.0, 0
        solvers = {ordering: gtsam_gauss_newton(graph, ordering) for ordering in ORDERINGS}
        for _ in range(pairs):
            theirs = {ordering: cpu(solve) for ordering, solve in solvers.items()}
            for backend in available():
                mine = ours(graph, backend, "log", GTSAM_TOLERANCE)
                steps = len(mine.value.history)
                for ordering, peer in theirs.items():
                    ratios[backend, ordering].append(mine.seconds / peer.seconds)
                    excess = max(excess, mine.value.chi2 / chi2(graph, peer.value) - 1.0)
        for (backend, ordering), found in ratios.items():
            case, goal = f"ours / GTSAM, {ordering}, {name}", GOALS_PG_1.get(name)
            rows.append(row("PG-1", case, backend, median(found), "x", goal))
        case = f"our chi² over GTSAM's, less 1, {name}, {steps} steps"
        rows.append(row("PG-1", case, "-", excess, "", 1e-3))
    return rows


def against_g2o(graphs: dict[str, PoseGraph], pairs: int) -> list[Row]:
    """PG-1, beside it: as many steps in the same convention; no goal."""
    rows = []
    for name, graph in graphs.items():
        ratios, options = defaultdict(list), Options(damping=0.0, cost=1e-5)
        steps = len(ours(graph, available()[-1], "g2o", options).value.history)
        excess = -1.0
        for _ in range(pairs):
            peer = cpu(g2o_gauss_newton(graph, steps))
            for backend in available():
                mine = ours(graph, backend, "g2o", options)
                ratios[backend].append(mine.seconds / peer.seconds)
                excess = max(excess, mine.value.chi2 / chi2(graph, peer.value, "g2o") - 1.0)
        for backend, found in ratios.items():
            rows.append(row("PG-1", f"ours / g2o, {name}", backend, median(found), "x"))
        rows.append(row("PG-1", f"our chi² over g2o's, less 1, {name}, {steps} steps", "-", excess, ""))
    return rows


def gtsam_gauss_newton(graph: PoseGraph, ordering: str) -> Solver:
    """GTSAM's Gauss-Newton with its usual tolerances, the first pose held by a prior."""
    import gtsam

    space = graph.space == "se3"
    turned = [3, 4, 5, 0, 1, 2] if space else [0, 1, 2]  # GTSAM: rotation first, in space
    kind = "Pose3" if space else "Pose2"
    pose = gtsam.Pose3 if space else (lambda x: gtsam.Pose2(*x))
    between, prior = (getattr(gtsam, f"{name}Factor{kind}") for name in ("Between", "Prior"))
    start, factors = gtsam.Values(), gtsam.NonlinearFactorGraph()
    for i, T in enumerate(graph.T_world):
        start.insert(i, pose(T))
    edges = zip(graph.tail.tolist(), graph.head.tolist(), graph.measured, graph.information, strict=True)
    for i, j, Z, Omega in edges:
        noise = gtsam.noiseModel.Gaussian.Information(Omega[np.ix_(turned, turned)])
        factors.add(between(i, j, pose(Z), noise))
    sure = gtsam.noiseModel.Isotropic.Sigma(len(turned), 1e-3)
    for i in np.flatnonzero(graph.fixed).tolist():
        factors.add(prior(i, pose(graph.T_world[i]), sure))
    options = gtsam.GaussNewtonParams()
    options.setOrderingType(ordering)

    def solve() -> np.ndarray:
        found = gtsam.GaussNewtonOptimizer(factors, start, options).optimize()
        if space:
            return np.array([found.atPose3(i).matrix() for i in range(len(graph.T_world))])
        poses = [found.atPose2(i) for i in range(len(graph.T_world))]
        return np.array([[T.x(), T.y(), T.theta()] for T in poses])

    return solve


def g2o_gauss_newton(graph: PoseGraph, steps: int) -> Solver:
    """g2o's Gauss-Newton with Eigen's sparse Cholesky factor, for a number of steps; solves once."""
    import g2opy as g2o

    space = graph.space == "se3"
    kind = "SE3" if space else "SE2"
    solver = getattr(g2o, f"BlockSolver{kind}")(getattr(g2o, f"LinearSolverEigen{kind}")())
    vertex, edge = getattr(g2o, f"Vertex{kind}"), getattr(g2o, f"Edge{kind}")
    pose = g2o.Isometry3d if space else (lambda x: g2o.SE2(*map(float, x)))
    optimiser = g2o.SparseOptimizer()
    optimiser.set_algorithm(g2o.OptimizationAlgorithmGaussNewton(solver))
    nodes = [vertex() for _ in graph.T_world]
    for i, (node, T) in enumerate(zip(nodes, graph.T_world, strict=True)):
        node.set_id(i)
        node.set_estimate(pose(T))
        node.set_fixed(bool(graph.fixed[i]))
        optimiser.add_vertex(node)
    edges = zip(graph.tail.tolist(), graph.head.tolist(), graph.measured, graph.information, strict=True)
    for i, j, Z, Omega in edges:
        one = edge()
        one.set_vertex(0, nodes[i])
        one.set_vertex(1, nodes[j])
        one.set_measurement(pose(Z))
        one.set_information(Omega.copy())
        optimiser.add_edge(one)

    def solve() -> np.ndarray:
        optimiser.initialize_optimization()
        optimiser.optimize(steps)
        found = [node.estimate() for node in nodes]
        return np.array([T.matrix() if space else T.to_vector() for T in found])

    return solve

"""Conventions of other libraries: against their definitions, and against the libraries themselves."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from vslam_ref import interop
from vslam_ref.geometry import quaternion, se2, se3, sim3

EPS = float(np.finfo(float).eps)
MODULES: dict[str, ModuleType] = {"SE2": se2, "SE3": se3, "Sim3": sim3}
Retract = Callable[[np.ndarray, np.ndarray], np.ndarray]  # matrix, their tangent vector -> matrix
H = 2e-3
"""Step of the differences below, of sixth order: truncation about h^6 / 140 times the 7th derivative, 1e-18;
rounding eps |T| |T^-1| / h, below 3e-12 for the poses here."""


def pose(name: str, seed: int = 0) -> np.ndarray:
    return MODULES[interop.CONVENTIONS[name].group].random(np.random.default_rng(seed), spread=2.0)


def our_order(xi: np.ndarray, order: tuple[str, ...], sizes: dict[str, int]) -> np.ndarray:
    parts, start = {}, 0
    for block in order:
        parts[block] = xi[start : start + sizes[block]]
        start += sizes[block]
    return np.concatenate([parts[block] for block in sizes])


def unit(half: np.ndarray) -> np.ndarray:
    """Rotation whose quaternion has this vector part: by SciPy."""
    return Rotation.from_quat([*half, np.sqrt(1 - half @ half)]).as_matrix()


def by_definition(name: str) -> Retract:
    """What the library does with a tangent vector, from its documentation."""
    kind = interop.CONVENTIONS[name]
    group, sizes = MODULES[kind.group], interop.BLOCKS[kind.group]
    n = sizes["rho"]

    def retract(T: np.ndarray, xi: np.ndarray) -> np.ndarray:
        xi = our_order(xi, kind.order, sizes)
        step = expm(group.hat(xi))
        if kind.angle_unit == 0.5:
            step = np.eye(4)
            step[:3, :3], step[:3, 3] = unit(xi[3:6]), xi[:3]
        if kind.side != "split":
            return step @ T if kind.side == "left" else T @ step
        new = T.copy()
        new[:n, :n] = step[:n, :n] @ T[:n, :n]
        new[:n, n] = T[:n, n] + xi[:n]
        return new

    return retract


def differentiate(f: Callable[[np.ndarray], np.ndarray], n: int) -> np.ndarray:
    columns = []
    for e in np.eye(n):
        slopes = [(f(h * e) - f(-h * e)) / (2 * h) for h in (H, 2 * H, 3 * H)]
        columns.append(1.5 * slopes[0] - 0.6 * slopes[1] + 0.1 * slopes[2])
    return np.stack(columns, -1)


def check_retraction(name: str, T: np.ndarray, retract: Retract, *, of_inverse: bool = False) -> None:
    """Their small step, seen as our left perturbation, is the inverse of ``tangent_matrix``."""
    kind = interop.CONVENTIONS[name]
    group = MODULES[kind.group]
    ours = {"SE2": "vslam_ref.se2", "SE3": "vslam_ref.se3", "Sim3": "vslam_ref.sim3"}[kind.group]
    matrix = group.matrix(T)
    start = np.linalg.inv(matrix) if of_inverse else matrix

    def seen(xi: np.ndarray) -> np.ndarray:
        new = retract(start, xi)
        new = np.linalg.inv(new) if of_inverse else new
        return group.log(group.nearest(new @ np.linalg.inv(matrix)))

    M = interop.tangent_matrix(ours, name, group.adjoint(T), of_inverse=of_inverse)
    numeric = differentiate(seen, len(M))
    np.testing.assert_allclose(np.linalg.inv(M), numeric, rtol=0, atol=1e-10)
    # sharp: the identity, our own convention, is far off unless it is the same
    if M.shape == numeric.shape and not np.allclose(M, np.eye(len(M))):
        assert np.abs(np.eye(len(M)) - numeric).max() > 0.1


@pytest.mark.parametrize("of_inverse", [False, True])
@pytest.mark.parametrize("name", interop.CONVENTIONS)
def test_tangent_matrix_is_the_derivative_of_the_definition(name: str, of_inverse: bool) -> None:
    for seed in (0, 1):
        check_retraction(name, pose(name, seed), by_definition(name), of_inverse=of_inverse)


def test_gtsam_does_what_the_table_says() -> None:
    gtsam = pytest.importorskip("gtsam", reason="the wheel of GTSAM is not installed")

    def pose3(T: np.ndarray, xi: np.ndarray) -> np.ndarray:
        return gtsam.Pose3(T).retract(xi).matrix()

    def similarity(S: np.ndarray, xi: np.ndarray) -> np.ndarray:
        M = interop.similarity_to_gtsam(S)
        start = gtsam.Similarity3(gtsam.Rot3(M[:3, :3]), M[:3, 3], 1 / M[3, 3])
        # their default retraction of a similarity is checked as the exponential that the table promises
        return interop.similarity_from_gtsam(start.compose(gtsam.Similarity3.Expmap(xi)).matrix())

    def pose2(T: np.ndarray, xi: np.ndarray) -> np.ndarray:
        return gtsam.Pose2(T[0, 2], T[1, 2], np.arctan2(T[1, 0], T[0, 0])).retract(xi).matrix()

    for seed in (2, 3):
        check_retraction("gtsam.Pose3", pose("gtsam.Pose3", seed), pose3)
        check_retraction("gtsam.Pose3", pose("gtsam.Pose3", seed), pose3, of_inverse=True)
        check_retraction("gtsam.Pose2", pose("gtsam.Pose2", seed), pose2)
        check_retraction("gtsam.Similarity3", pose("gtsam.Similarity3", seed), similarity)


def test_a_covariance_from_gtsam_is_ours_after_conversion() -> None:
    """A prior of our covariance on T_cam_world, one on T_world_cam, through GTSAM's marginals and error."""
    gtsam = pytest.importorskip("gtsam", reason="the wheel of GTSAM is not installed")
    rng = np.random.default_rng(5)
    T = se3.random(rng)
    root = rng.normal(size=(6, 6))
    cov = 1e-4 * root @ root.T
    for of_inverse in (False, True):
        held = se3.inverse(T) if of_inverse else T
        M = interop.tangent_matrix("vslam_ref.se3", "gtsam.Pose3", se3.adjoint(T), of_inverse=of_inverse)
        noise = gtsam.noiseModel.Gaussian.Covariance(interop.convert_covariance(cov, M))
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        graph.add(gtsam.PriorFactorPose3(0, gtsam.Pose3(held), noise))
        values.insert(0, gtsam.Pose3(held))
        theirs = gtsam.Marginals(graph, values).marginalCovariance(0)
        back = interop.convert_covariance(theirs, np.linalg.inv(M))
        np.testing.assert_allclose(back, cov, rtol=0, atol=1e-12)
        # the factor's error of a pose that we moved by xi has the squared length xi^T cov^-1 xi / 2
        xi = 1e-2 * rng.normal(size=6)
        moved = se3.perturb(T, xi)
        values.update(0, gtsam.Pose3(se3.inverse(moved) if of_inverse else moved))
        assert abs(graph.error(values) / (xi @ np.linalg.solve(cov, xi) / 2) - 1) < 1e-9


def test_g2o_does_what_the_table_says() -> None:
    g2o = pytest.importorskip("g2opy", reason="the wheel of g2o is not installed")

    def moved(vertex: Any, start: Any, xi: np.ndarray) -> Any:
        vertex.set_estimate(start)
        vertex.oplus(xi)
        return vertex.estimate()

    def se3_vertex(T: np.ndarray, xi: np.ndarray) -> np.ndarray:
        return np.asarray(moved(g2o.VertexSE3(), g2o.Isometry3d(T), xi).matrix())

    def expmap(T: np.ndarray, xi: np.ndarray) -> np.ndarray:
        start = g2o.SE3Quat(np.asfortranarray(T[:3, :3]), T[:3, 3].copy())
        return np.asarray(moved(g2o.VertexSE3Expmap(), start, xi).to_homogeneous_matrix())

    def se2_vertex(T: np.ndarray, xi: np.ndarray) -> np.ndarray:
        start = g2o.SE2(T[0, 2], T[1, 2], np.arctan2(T[1, 0], T[0, 0]))
        return se2.matrix(np.ravel(moved(g2o.VertexSE2(), start, xi).to_vector()))

    def similarity(S: np.ndarray, xi: np.ndarray) -> np.ndarray:
        start = g2o.Sim3(sim3.rotation(S), sim3.translation(S).copy(), float(sim3.scale(S)))
        end = moved(g2o.VertexSim3Expmap(), start, xi)
        origin = np.ravel(end.map(np.zeros(3)))
        columns = [np.ravel(end.map(e)) - origin for e in np.eye(3)]
        return np.vstack([np.column_stack([*columns, origin]), [0, 0, 0, 1]])

    for seed in (2, 3):
        check_retraction("g2o.VertexSE3", pose("g2o.VertexSE3", seed), se3_vertex)
        check_retraction("g2o.VertexSE3Expmap", pose("g2o.VertexSE3Expmap", seed), expmap)
        check_retraction("g2o.VertexSE2", pose("g2o.VertexSE2", seed), se2_vertex)
        check_retraction("g2o.VertexSim3Expmap", pose("g2o.VertexSim3Expmap", seed), similarity)


def test_conversions_compose_and_leave_what_is_physical() -> None:
    """Mahalanobis distance, predicted change of a measurement, and information times covariance stay."""
    rng = np.random.default_rng(1)
    T = se3.random(rng, (4,))
    Ad = se3.adjoint(T)
    root = rng.normal(size=(4, 6, 6))
    cov, xi, J = root @ np.swapaxes(root, -1, -2), rng.normal(size=(4, 6)), rng.normal(size=(4, 2, 6))
    for target in ("gtsam.Pose3", "g2o.VertexSE3", "ceres.Quaternion+R3"):
        M = interop.tangent_matrix("vslam_ref.se3", target, Ad)
        theirs = np.einsum("nij,nj->ni", M, xi)
        there = np.einsum("ni,nij,nj->n", theirs, interop.convert_information(np.linalg.inv(cov), M), theirs)
        here = np.einsum("ni,nij,nj->n", xi, np.linalg.inv(cov), xi)
        condition = np.linalg.cond(cov).max()
        np.testing.assert_allclose(there, here, rtol=64 * EPS * condition)
        change = np.einsum("nij,nj->ni", interop.convert_jacobian(J, M), theirs)
        np.testing.assert_allclose(change, np.einsum("nij,nj->ni", J, xi), rtol=0, atol=1e-12)
        product = interop.convert_information(np.linalg.inv(cov), M) @ interop.convert_covariance(cov, M)
        one = np.broadcast_to(np.eye(6), (4, 6, 6))
        np.testing.assert_allclose(product, one, rtol=0, atol=256 * EPS * condition)
        back = interop.tangent_matrix(target, "vslam_ref.se3", Ad)
        np.testing.assert_allclose(back @ M, one, rtol=0, atol=1e-12)


def test_an_information_of_400_in_a_g2o_file_is_100_per_square_radian() -> None:
    M = interop.tangent_matrix("g2o.VertexSE3", "manif.SE3", np.eye(6))
    information = interop.convert_information(np.diag([100.0] * 3 + [400.0] * 3), M)
    np.testing.assert_allclose(information, 100 * np.eye(6), rtol=8 * EPS)


def test_gtsams_similarity_maps_points_alike() -> None:
    S = sim3.random(np.random.default_rng(4), (3,))
    M = interop.similarity_to_gtsam(S)
    X = np.array([1.0, -2.0, 3.0])
    theirs = (np.einsum("nij,j->ni", M[:, :3, :3], X) + M[:, :3, 3]) / M[:, 3, 3, None]
    np.testing.assert_allclose(theirs, sim3.act(S, X), rtol=0, atol=64 * EPS * 10)
    np.testing.assert_allclose(np.linalg.det(M[:, :3, :3]), 1.0, rtol=16 * EPS)
    np.testing.assert_allclose(interop.similarity_from_gtsam(M), S, rtol=0, atol=8 * EPS * 10)
    gtsam = pytest.importorskip("gtsam", reason="the wheel of GTSAM is not installed")
    one = gtsam.Similarity3(gtsam.Rot3(M[0, :3, :3]), M[0, :3, 3], 1 / M[0, 3, 3])
    np.testing.assert_allclose(one.transformFrom(X), sim3.act(S[0], X), rtol=0, atol=64 * EPS * 10)
    np.testing.assert_allclose(one.matrix(), M[0], rtol=0, atol=16 * EPS * 10)


def test_quaternion_orders_and_products() -> None:
    q = quaternion.random(np.random.default_rng(6), (5,))
    R = quaternion.matrix(q)
    xyzw = interop.quaternion_from_wxyz(q, "xyzw")
    np.testing.assert_allclose(Rotation.from_quat(xyzw).as_matrix(), R, rtol=0, atol=8 * EPS)
    assert np.array_equal(interop.quaternion_to_wxyz(xyzw, "xyzw"), q)
    assert np.array_equal(interop.quaternion_to_wxyz(q, "wxyz"), q)
    # JPL: C(q) = (2 w^2 - 1) I - 2 w hat(v) + 2 v v^T, xyzw; the minus is Hamilton's plus
    jpl = interop.quaternion_from_wxyz(q, "xyzw", product="jpl")
    v, w = jpl[:, :3], jpl[:, 3, None, None]
    hat = np.cross(np.eye(3), v[:, None, :])  # rows e_i x v: the matrix of v x
    C = (2 * w**2 - 1) * np.eye(3) - 2 * w * hat + 2 * v[:, :, None] * v[:, None, :]
    np.testing.assert_allclose(C, R, rtol=0, atol=16 * EPS)
    assert np.array_equal(interop.quaternion_to_wxyz(jpl, "xyzw", product="jpl"), q)


@pytest.mark.parametrize("name", ["opengl", "ros-body", "ned"])
def test_axes_are_right_handed_and_keep_their_promise(name: str) -> None:
    R = interop.camera_axes(name)
    assert np.linalg.det(R) == 1.0
    right, down, ahead = R.T
    told = {
        "opengl": ([1, 0, 0], [0, -1, 0], [0, 0, -1]),
        "ros-body": ([0, -1, 0], [0, 0, -1], [1, 0, 0]),
        "ned": ([0, 1, 0], [0, 0, 1], [1, 0, 0]),
    }[name]
    assert [right.tolist(), down.tolist(), ahead.tolist()] == [list(map(float, v)) for v in told]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: interop.tangent_matrix("gtsam.Pose4", "vslam_ref.se3", np.eye(6)), "unknown; there are"),
        (lambda: interop.tangent_matrix("gtsam.Pose2", "vslam_ref.se3", np.eye(3)), "need one group"),
        (
            lambda: interop.tangent_matrix("gtsam.Pose3", "vslam_ref.se3", np.eye(3)),
            r"needs \(\.\.\., 6, 6\)",
        ),
        (lambda: interop.quaternion_to_wxyz([1, 0, 0], "wxyz"), r"need \(\.\.\., 4\)"),
        (lambda: interop.quaternion_to_wxyz([1, 0, 0, 0], "zyxw"), "need wxyz or xyzw"),
        (lambda: interop.quaternion_from_wxyz([1, 0, 0, 0], "zyxw"), "need wxyz or xyzw"),
        (lambda: interop.quaternion_to_wxyz([1, 0, 0, 0], "wxyz", product="jlp"), "hamilton or jpl"),
        (lambda: interop.camera_axes("unity"), "unknown; there are"),
    ],
)
def test_what_cannot_be_converted_is_told(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()

"""GTSAM under the vectors (an optional wheel).

Its convention stands in ``gtsam_convention.json``: a camera's pose is T_world_cam, perturbed from the right,
rotation first.  ``ExpmapDerivative`` is the *right* Jacobian; the left one is that of the negative vector.
A ``Similarity3`` maps x to s (R x + t), so our translation is s times its own.

What it reveals stands in ``docs/what-the-vectors-found.md``.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from motion_models import drive, heading_wrapped, sight
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers, answer_from

Array = NDArray[np.float64]


def answer(function: str, inputs: dict[str, Any]) -> Any:
    """Answer one question with GTSAM."""
    return answer_from(table(), function, inputs)


@functools.cache
def table() -> Answers:
    """What GTSAM can answer: nothing where it is absent."""
    try:
        import gtsam as g
    except ModuleNotFoundError:
        return {}

    parts = (_plane, _rotations, _motions, _similarities, _cameras, _views, _estimation, _rest)
    return {name: function for part in parts for name, function in part(g).items()}


# --- chapter 2 ---------------------------------------------------------------------------------


def _plane(g: Any) -> Answers:
    def pose(x: Array) -> Any:
        return g.Pose2(*x)

    def numbers(T: Any) -> list[float]:
        return [T.x(), T.y(), T.theta()]

    return {
        "so2.exp": lambda angle: g.Rot2.fromAngle(angle).matrix(),
        "so2.wrap": lambda angle: g.Rot2.fromAngle(angle).theta(),
        "se2.exp": lambda xi: numbers(g.Pose2.Expmap(xi)),
        "se2.log": lambda x: g.Pose2.Logmap(pose(x)),
        "se2.compose": lambda a, b: numbers(pose(a).compose(pose(b))),
        "se2.inverse": lambda x: numbers(pose(x).inverse()),
        "se2.adjoint": lambda x: pose(x).AdjointMap(),
        "se2.left_jacobian": lambda xi: g.Pose2.ExpmapDerivative(-xi),
    }


def _rotations(g: Any) -> Answers:
    def quaternion(R: Array) -> list[float]:
        q = g.Rot3(R).toQuaternion()
        return [q.w(), q.x(), q.y(), q.z()]

    return {
        "so3.exp": lambda phi: g.Rot3.Expmap(phi).matrix(),
        "so3.log": lambda R: g.Rot3.Logmap(g.Rot3(R)),
        "so3.left_jacobian": lambda phi: g.Rot3.ExpmapDerivative(-phi),
        "so3.left_jacobian_inverse": lambda phi: np.linalg.inv(g.Rot3.ExpmapDerivative(-phi)),
        "so3.interpolate": lambda a, b, fraction: g.Rot3(a).slerp(fraction, g.Rot3(b)).matrix(),
        "so3.nearest": lambda M: g.Rot3.ClosestTo(M).matrix(),
        "quaternion.from_rotation": quaternion,
        "quaternion.to_rotation": lambda q: g.Rot3.Quaternion(*q).matrix(),
    }


def _motions(g: Any) -> Answers:
    pose = g.Pose3
    return {
        "se3.exp": lambda xi: pose.Expmap(xi).matrix(),
        "se3.log": lambda T: pose.Logmap(pose(T)),
        "se3.compose": lambda a, b: pose(a).compose(pose(b)).matrix(),
        "se3.inverse": lambda T: pose(T).inverse().matrix(),
        "se3.act": lambda T, x: pose(T).transformFrom(x),
        "se3.adjoint": lambda T: pose(T).AdjointMap(),
        "se3.left_jacobian": lambda xi: pose.ExpmapDerivative(-xi),
        "se3.left_jacobian_inverse": lambda xi: np.linalg.inv(pose.ExpmapDerivative(-xi)),
        "se3.interpolate": lambda a, b, fraction: (
            pose(a).compose(pose.Expmap(fraction * pose.Logmap(pose(a).between(pose(b))))).matrix()
        ),
    }


def _similarities(g: Any) -> Answers:
    def theirs(S: Array) -> Any:
        s = float(np.cbrt(np.linalg.det(S[:3, :3])))
        return g.Similarity3(g.Rot3(S[:3, :3] / s), S[:3, 3] / s, s)

    def ours(S: Any) -> Array:
        M = np.eye(4)
        M[:3, :3], M[:3, 3] = S.scale() * S.rotation().matrix(), S.scale() * S.translation()
        return M

    return {
        "sim3.exp": lambda xi: ours(g.Similarity3.Expmap(xi)),
        "sim3.log": lambda S: g.Similarity3.Logmap(theirs(S)),
        "sim3.compose": lambda a, b: ours(theirs(a).compose(theirs(b))),
        "sim3.inverse": lambda S: ours(theirs(S).inverse()),
        "sim3.act": lambda S, x: theirs(S).transformFrom(x),
        "sim3.adjoint": lambda S: theirs(S).AdjointMap(),
    }


# --- chapter 3 ---------------------------------------------------------------------------------


def _calibration(g: Any, model: str, params: Array) -> tuple[Any, Any]:
    """Classes of camera and calibration of a model; skew 0 stands third."""
    fx, fy, cx, cy, *k = map(float, params)
    if model == "pinhole":
        return g.PinholeCameraCal3_S2, g.Cal3_S2(fx, fy, 0.0, cx, cy)
    if model == "radtan" and not any(k[4:]):
        return g.PinholeCameraCal3DS2, g.Cal3DS2(fx, fy, 0.0, cx, cy, *k[:4])
    if model == "fisheye":
        return g.PinholeCameraCal3Fisheye, g.Cal3Fisheye(fx, fy, 0.0, cx, cy, *k, 1e-12)
    raise NotImplementedError(model)


def _cameras(g: Any) -> Answers:
    def seen(model: str, params: Array, pose: Array, X: Array) -> tuple[Array, Array, Array, Array]:
        """Pixel, and its Jacobians in the pose, the point and the parameters."""
        camera, lens = _calibration(g, model, params)
        size = 5 if model == "pinhole" else 9
        J = [np.zeros((2, n), order="F") for n in (6, 3, size)]
        uv = camera(g.Pose3(pose), lens).project(X, *J)
        known = np.delete(J[2], 2, axis=1)  # without the skew
        return uv, J[0], J[1], np.hstack([known, np.full((2, 9), np.nan)])[:, : len(params)]

    def project(model: str, params: Array, X_cam: Array) -> dict[str, Any]:
        camera, lens = _calibration(g, model, params)
        uv, safe = camera(g.Pose3(), lens).projectSafe(X_cam)
        return {"uv": uv, "valid": bool(safe)}

    def unproject(model: str, params: Array, uv: Array) -> dict[str, Any]:
        lens = _calibration(g, model, params)[1]
        ray = np.array([*lens.calibrate(uv), 1.0])
        return {"bearing": ray / np.linalg.norm(ray), "valid": True}

    def rig(model: str, params: Array, T_cam_rig: Array, pose: Array, X_world: Array) -> Array:
        T_rig_cam = g.Pose3(T_cam_rig).inverse()
        T_world_cam = g.Pose3(pose).compose(T_rig_cam)
        J = seen(model, params, T_world_cam.matrix(), X_world)[1]
        return np.asarray(J @ T_rig_cam.inverse().AdjointMap())

    origin = np.eye(4)
    return {
        "camera.project": project,
        "camera.unproject": unproject,
        "camera.jacobian_point": lambda model, params, X_cam: seen(model, params, origin, X_cam)[2],
        "camera.jacobian_intrinsics": lambda model, params, X_cam: seen(model, params, origin, X_cam)[3],
        "camera.jacobian_pose": lambda model, params, pose, X_world: seen(model, params, pose, X_world)[1],
        "camera.jacobian_rig": rig,
    }


# --- chapter 1 ---------------------------------------------------------------------------------


def _views(g: Any) -> Answers:
    def world_poses(T_cams: Array) -> Any:
        return [g.Pose3(T) for T in T_cams]  # T_world_cam, as declared

    def triangulate(T_cams: Array, bearings: Array) -> Array:
        if not (bearings[:, 2] > 0).all():
            raise NotImplementedError("GTSAM takes pixels")
        x = list(bearings[:, :2] / bearings[:, 2:])
        return np.asarray(g.triangulatePoint3(world_poses(T_cams), g.Cal3_S2(1, 1, 0, 0, 0), x, 1e-9, False))

    def optimal(T_cams: Array, params: Array, uv: Array) -> dict[str, Any]:
        poses, K = world_poses(T_cams), _calibration(g, "pinhole", params)[1]
        graph, values, unit = g.NonlinearFactorGraph(), g.Values(), g.noiseModel.Isotropic.Sigma(2, 1.0)
        for pose, z in zip(poses, uv, strict=True):
            graph.push_back(g.TriangulationFactorCal3_S2(g.PinholeCameraCal3_S2(pose, K), z, unit, 0))
        values.insert(0, g.triangulatePoint3(poses, K, list(uv), 1e-9, False))
        rules = g.LevenbergMarquardtParams()  # triangulateNonlinear stops earlier: gtsam_usual
        rules.setRelativeErrorTol(1e-16)
        rules.setAbsoluteErrorTol(1e-16)
        values = g.LevenbergMarquardtOptimizer(graph, values, rules).optimize()
        X = values.atPoint3(0)
        return {"X": X, "covariance": g.Marginals(graph, values).marginalCovariance(0)}

    def umeyama(source: Array, target: Array, with_scale: bool) -> dict[str, Any]:
        pairs = list(zip(target, source, strict=True))
        found = g.Similarity3.Align(pairs) if with_scale else g.Pose3.Align(pairs)
        scale = found.scale() if with_scale else 1.0
        return {"scale": scale, "R": found.rotation().matrix(), "t": scale * found.translation()}

    def essential(T_b_a: Array) -> Array:
        T = g.Pose3(T_b_a)
        return np.asarray(g.EssentialMatrix(T.rotation(), g.Unit3(T.translation())).matrix())

    def camera_from_world(R_cam_world: Array, p_world: Array, X_world: Array) -> Array:
        return np.asarray(g.Pose3(g.Rot3(R_cam_world.T), p_world).transformTo(X_world))

    return {
        "multiview.triangulate": triangulate,
        "multiview.triangulate_optimal": optimal,
        "multiview.umeyama": umeyama,
        "multiview.essential": essential,
        "multiview.camera_from_world": camera_from_world,
    }


# --- chapters 4, 5, 6 --------------------------------------------------------------------------


def _estimation(g: Any) -> Answers:
    robust = g.noiseModel.mEstimator
    names = {"huber": "Huber", "cauchy": "Cauchy", "geman-mcclure": "GemanMcClure", "tukey": "Tukey"}

    def estimator(name: str, c: float) -> Any:
        return robust.Null() if name == "l2" else getattr(robust, names[name]).Create(c)

    def solution(J: Array, r: Array, damping: float = 0.0, scale: Array | None = None) -> Array:
        graph, unit = g.GaussianFactorGraph(), g.noiseModel.Unit.Create
        graph.add(0, J, -r, unit(len(r)))
        if scale is not None:
            graph.add(0, np.sqrt(damping) * np.diag(scale), 0.0 * scale, unit(len(scale)))
        return np.asarray(graph.optimize().at(0))

    def factor(model: str, params: Array, X: Array, uv: Array, cov: Array) -> tuple[Any, Any]:
        kinds = {"pinhole": "Cal3_S2", "radtan": "Cal3DS2", "fisheye": "Cal3Fisheye"}
        lens = _calibration(g, model, params)[1]
        kind = getattr(g, f"GenericProjectionFactor{kinds[model]}")
        return kind(uv, g.noiseModel.Gaussian.Covariance(cov), 0, 1, lens), X

    def values(pose: Array, X: Array) -> Any:
        at = g.Values()
        at.insert(0, g.Pose3(pose))
        at.insert(1, X)
        return at

    def residual(model: str, params: Array, pose: Array, X_world: Array, uv: Array) -> Array:
        pairs = zip(X_world.reshape(-1, 3), uv.reshape(-1, 2), strict=True)
        factors = [factor(model, params, X, z, np.eye(2)) for X, z in pairs]
        return np.stack([f.unwhitenedError(values(pose, X)) for f, X in factors]).reshape(uv.shape)

    def cost(model: str, params: Array, pose: Array, X_world: Array, uv: Array, cov: Array) -> float:
        rows = zip(X_world.reshape(-1, 3), uv.reshape(-1, 2), cov.reshape(-1, 2, 2), strict=True)
        factors = [factor(model, params, *row) for row in rows]
        return sum(float(f.error(values(pose, X))) for f, X in factors)

    return {
        "loss.cost": lambda name, c, x: [estimator(name, c).loss(v) for v in np.atleast_1d(x)],
        "loss.weight": lambda name, c, x: [estimator(name, c).weight(v) for v in np.atleast_1d(x)],
        "loss.influence": lambda name, c, x: [estimator(name, c).weight(v) * v for v in np.atleast_1d(x)],
        "least_squares.gauss_newton_step": lambda J, r: solution(J, r),
        "least_squares.lm_step": solution,
        "bundle.residual": residual,
        "bundle.cost": cost,
    }


# --- chapters 15, 17, 23 -----------------------------------------------------------------------


def _rest(g: Any) -> Answers:
    def predict(
        x: Array, P: Array, control: Array, cov_u: Array, wheelbase: float, dt: float
    ) -> dict[str, Any]:
        moved, F, Q = drive(x, control, cov_u, wheelbase, dt)
        kalman = g.KalmanFilter(len(x))
        ahead = kalman.predictQ(kalman.init(x, P), F, np.eye(len(x)), moved - F @ x, Q)
        return {"x": heading_wrapped(ahead.mean()), "P": ahead.covariance()}

    def update(x: Array, P: Array, ids: Array, z: Array, cov_z: Array) -> dict[str, Any]:
        predicted, H = sight(x, ids)
        kalman = g.KalmanFilter(len(x))
        cov = np.kron(np.eye(len(ids)), cov_z)
        after = kalman.updateQ(kalman.init(x, P), H, z.ravel() - predicted + H @ x, cov)
        return {"x": heading_wrapped(after.mean()), "P": after.covariance()}

    def ate(estimate: Array, truth: Array, align: str) -> dict[str, float]:
        scale, pairs = 1.0, list(zip(truth, estimate, strict=True))
        if align != "none":
            found = g.Similarity3.Align(pairs) if align == "sim3" else g.Pose3.Align(pairs)
            scale = found.scale() if align == "sim3" else 1.0
            estimate = np.stack([found.transformFrom(x) for x in estimate])
        e = np.linalg.norm(estimate - truth, axis=1)
        values = {"mean": e.mean(), "median": np.median(e), "max": e.max(), "scale": scale}
        return {"rmse": np.sqrt((e**2).mean()), **values}

    def rpe(estimate: Array, truth: Array) -> dict[str, float]:
        a, b = ([g.Pose3(T) for T in Ts] for Ts in (estimate, truth))
        steps = zip(a[:-1], a[1:], b[:-1], b[1:], strict=True)
        errors = [c.between(d).between(p.between(q)) for p, q, c, d in steps]
        moved = [np.linalg.norm(E.translation()) for E in errors]
        turned = [np.degrees(E.rotation().axisAngle()[1]) for E in errors]
        return {
            "trans_rmse": np.sqrt(np.mean(np.square(moved))),
            "rot_rmse_deg": np.sqrt(np.mean(np.square(turned))),
        }

    def nees(error: Array, P: Array) -> float:
        return float(g.noiseModel.Gaussian.Covariance(P).squaredMahalanobisDistance(error))

    return {
        "ekf.predict": predict,
        "ekf.update": update,
        "consistency.nees": nees,
        "trajectory.ate": ate,
        "trajectory.rpe": rpe,
    }

# ruff: noqa: E501
"""Programs with one mistake each: a change in the text of a plain program, and what its name must say.

The plain programs are right and share no code with the library.  ``truth`` is a pattern: a name that does not
have it is false, and a name that locates the mistake only (entries, cases, digits) has it among its words.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from vslam_ref.conformance import vectors_format as form
from vslam_ref.conformance.adapters.table import answer_from
from vslam_ref.conformance.catalogue import functions
from vslam_ref.conformance.diagnosis import NOTHING, name_functions
from vslam_ref.conformance.program import InProcess
from vslam_ref.conformance.runner import run

HERE = Path(__file__).parent
OTHERS = {"grid.update": "grid_update"}
"""Functions that have another name in their module."""


class Wrong(NamedTuple):
    """One mistake: the function that is asked, where its text is, what is changed, what the name must say."""

    function: str
    module: str
    old: str
    new: str
    truth: str


class Fate(NamedTuple):
    """What became of a wrong program: failed cases of all, and its name."""

    failed: int
    cases: int
    name: str

    @property
    def slips(self) -> bool:
        """Whether no case noticed it."""
        return self.failed == 0

    @property
    def named(self) -> bool:
        """Whether the name says something."""
        return not self.slips and not self.name.startswith(NOTHING)


def program(wrong: Wrong) -> Callable[..., Any]:
    """The function, with its mistake."""
    text = (HERE / f"{wrong.module}.py").read_text("utf-8")
    if text.count(wrong.old) != 1:
        raise ValueError(f"{wrong}: the text stands {text.count(wrong.old)} times in {wrong.module}")
    module = ModuleType(wrong.module)
    exec(compile(text.replace(wrong.old, wrong.new), f"{wrong.module}.py", "exec"), module.__dict__)
    table = module.__dict__.get("PROGRAM", {})
    name = wrong.function.rpartition(".")[2]
    found: Callable[..., Any] = table.get(wrong.function) or getattr(module, OTHERS.get(wrong.function, name))
    return found


@functools.cache
def vectors(function: str) -> form.VectorFile:
    """The cases of one function."""
    about = functions()[function]
    file = form.load(f"{about.chapter:02d}/{about.topic}.json")
    return file._replace(cases=[case for case in file.cases if case.function == function])


def judge(function: str, answering: Callable[..., Any]) -> Fate:
    """Ask all cases of a function, and name what is wrong."""
    module = ModuleType("wrong")
    module.answer = lambda name, inputs: answer_from({function: answering}, name, inputs)  # type: ignore[attr-defined]
    asked = InProcess(module)
    report = run(asked, [vectors(function)])

    def ask(name: str, inputs: dict[str, Any]) -> Any:
        reply = asked.ask("again", name, inputs)
        return reply.value if reply.what == "value" else None

    bad = report.count("failed") + report.count("error")
    names = name_functions(report.outcomes, ask)
    return Fate(bad, len(report.outcomes) - report.count("unsupported"), names.get(function, ""))


def true_name(wrong: Wrong, fate: Fate) -> bool:
    """Whether the name says what was done."""
    return bool(re.search(wrong.truth, fate.name))


B, M, F = "plain_branches", "plain_motions", "plain_filters"
V, C, E, G, TV = "plain_views", "plain_cameras", "plain_estimates", "plain_grids", "plain_two_views"

FIRST = [
    Wrong("se3.inverse", B, "out[:3, 3] = -R.T @ t", "out[:3, 3] = -R @ t", "turned forward"),
    Wrong("se3.exp", B, "T[:3, 3] = so3_left_jacobian(phi) @ rho", "T[:3, 3] = so3_left_jacobian(-phi) @ rho", "V has the wrong sign"),
    Wrong("se3.exp", B, "rho, phi = xi[:3], xi[3:]", "phi, rho = xi[:3], xi[3:]", "rotation_first"),
    Wrong("se3.adjoint", B, "A[:3, 3:] = hat(t) @ R", "A[:3, 3:] = hat(t) @ R; A[0, 4] = -A[0, 4]", r"\(0, 4\)"),
    Wrong("se3.adjoint", B, "A[:3, 3:] = hat(t) @ R", "A[:3, 3:] = hat(t) @ R; A = A.T", "transposed"),
    Wrong("se3.adjoint", B, "A[:3, 3:] = hat(t) @ R", "A[:3, 3:] = -hat(t) @ R", r"sign of hat\(t\) R|0-2, 3-5"),
    Wrong("so3.exp", B, "np.eye(3) + a * W + b * W @ W\n\n\ndef quaternion_from", "np.eye(3) + a * W - b * W @ W\n\n\ndef quaternion_from", r"sign of hat\(phi\)\^2"),
    Wrong("so3.left_jacobian", B, "np.eye(3) + b * W + c * W @ W", "np.eye(3) - b * W + c * W @ W", "right.Jacobian|right one"),
    Wrong("so3.left_jacobian", B, "0.5 - q / 24 +", "0.5 + q / 24 +", "small_angle|digits"),
    Wrong("so3.left_jacobian", B, "if angle < SMALL:", "if angle < 1.0:", "digits|above|below"),
    Wrong("so3.left_jacobian_inverse", B, "- 0.5 * W + d * W @ W", "+ 0.5 * W + d * W @ W", "right.Jacobian|transposed|group_jacobian.*right"),
    Wrong("so3.left_jacobian_inverse", B, "half * np.cos(half) / np.sin(half)", "half * np.sin(half) / np.cos(half)", "above|angle|sin|small_angle|flag"),
    Wrong("so3.log", B, "        q = -q\n", "        q = +q\n", "long way|minus sign of '-q'|rotation_angle.*2pi"),
    Wrong("so3.log", B, "2 * np.arctan2(n, q[0]) / n * q[1:]", "np.arctan2(n, q[0]) / n * q[1:]", "1/2 times"),
    Wrong("so3.log", B, "2 * np.arctan2(n, q[0]) / n * q[1:]", "2 * np.arcsin(n) / n * q[1:]", "digits|near_pi|pi"),
    Wrong("quaternion.from_rotation", B, "(R[2, 1] - R[1, 2]) / s, (R[0, 2] - R[2, 0]) / s", "(R[2, 1] - R[1, 2]) / s, (R[2, 0] - R[0, 2]) / s", "entry 2"),
    Wrong("quaternion.from_rotation", B, "q[0] = (R[k, j] - R[j, k]) / s", "q[0] = (R[j, k] - R[k, j]) / s", "entry 0|conjugated"),
    Wrong("quaternion.to_rotation", B, "2 * (y * z - w * x)]", "2 * (y * z + w * x)]", r"\(1, 2\)|y \* z - w \* x"),
    Wrong("quaternion.to_rotation", B, "w, x, y, z = q", "x, y, z, w = q", "xyzw"),
    Wrong("so2.wrap", B, "return np.arctan2(np.sin(angle), np.cos(angle))", "return np.fmod(angle + np.pi, 2 * np.pi) - np.pi", "fmod|not wrapped into"),
    Wrong("so2.wrap", B, "return np.arctan2(np.sin(angle), np.cos(angle))", "return angle - 2 * np.pi * np.sign(angle)", "wrapped-once|whole turns"),
    Wrong("so3.interpolate", B, "return a @ so3_exp(fraction * so3_log(a.T @ b))", "return a @ so3_exp(fraction * so3_log(b.T @ a))", "a.T @ b|transposed|first factor|exchanged|fraction is taken with the other sign"),
    Wrong("so3.interpolate", B, "return a @ so3_exp(fraction * so3_log(a.T @ b))", "return (1 - fraction) * a + fraction * b", "blended"),
    Wrong("se3.log", B, "so3_left_jacobian_inverse(phi) @ T[:3, 3]", "T[:3, 3]", "straight|copied"),
    Wrong("se3.log", B, "np.concatenate([so3_left_jacobian_inverse(phi) @ T[:3, 3], phi])", "np.concatenate([phi, so3_left_jacobian_inverse(phi) @ T[:3, 3]])", "rotation_first"),
    Wrong("camera.jacobian_pose", B, "fx + fx * x**2 / z**2", "fx - fx * x**2 / z**2", r"\(0, 4\)"),
    Wrong("camera.jacobian_pose", B, "-fx * y / z]", "fx * y / z]", r"\(0, 5\)"),
    Wrong("camera.jacobian_pose", B, "fx, fy = params[:2]", "fy, fx = params[:2]", "entries 0 and 1 of the input params"),
    Wrong("grid.ray_cells", B, "if high - low > 1e-13", "if high - low > 0.3", "missing|nothing"),
    Wrong("ekf.predict", F, "else [-ds * s, ds * c]", "else [ds * s, ds * c]", "minus|sign"),
    Wrong("ekf.predict", F, "noise = G @ Q @ G.T", "noise = 2 * G @ Q @ G.T", "cov_u is taken twice"),
    Wrong("ekf.predict", F, "ds * (1 + t * t) / wheelbase", "ds * (1 - t * t) / wheelbase", "other sign|tan"),
    Wrong("ekf.update", F, "S = H @ P @ H.T + block_diag(*[cov_z] * len(ids))", "S = H @ P @ H.T + 2 * block_diag(*[cov_z] * len(ids))", "cov_z is taken twice"),
    Wrong("ekf.update", F, "slope = np.array([[-s, c], [-c, -s]]) @ d", "slope = np.array([[-s, c], [c, -s]]) @ d", "sign|minus"),
    Wrong("ekf.update", F, "for k, i in enumerate(map(int, ids)):", "for k, i in enumerate(map(int, list(ids)[:1])):", "broadcast"),
    Wrong("ekf.augment", F, "own, cross = G @ P @ G.T + R @ cov_z @ R.T, G @ P", "own, cross = G @ P @ G.T + R.T @ cov_z @ R, G @ P", "turned the wrong way"),
    Wrong("ekf.augment", F, "turned, slope = R @ z, np.array([[-s, -c], [c, -s]]) @ z", "turned, slope = R @ z, np.array([[-s, c], [c, -s]]) @ z", "new landmark's Jacobian|P"),
    Wrong("vehicle.ackermann", F, "dx, dy = ds * np.cos(along), ds * np.sin(along)", "dx, dy = ds * np.cos(along), -ds * np.sin(along)", "sign|minus|entry 1"),
    Wrong("vehicle.ackermann", F, "(px, py, th), (v, phi) = x, control", "(px, py, th), (v, phi) = x, control; phi = np.degrees(phi)", "degrees|radians"),
    Wrong("vehicle.place", F, "{\"landmark\": x[:2] + moved}", "{\"landmark\": moved - x[:2]}", "sign|-"),
    Wrong("multiview.pose_from_centre", V, "else -R_cam_world @ p_world)", "else p_world)", "centre.(is taken )?for.(the )?translation"),
    Wrong("multiview.umeyama", V, "    if wrong == \"target-to-source\":\n        return align(target, source, with_scale)\n", "    source, target = target, source\n", "wrong way round|exchanged|target-to-source"),
    Wrong("multiview.umeyama", V, "np.linalg.det(U @ Vt)])", "1.0])", "mirrored"),
    Wrong("multiview.alignment_error", V, "np.sqrt(np.sum(e**2) / (1 if wrong == \"sum-not-divided\" else len(e)))", "np.sqrt(np.sum(e**2) / (3 * len(e)))", "single coordinates|1/sqrt"),
    Wrong("multiview.essential", V, "wrong or \"\", H @ R\n", "wrong or \"\", H.T @ R\n", "sign"),
    Wrong("multiview.triangulate", V, "        raise ValueError(\"behind\")", "        pass", "must be refused"),
    Wrong("multiview.sampson_distance", V, "np.hypot(in_a, in_b)))", "in_a + in_b))", "nothing|sqrt|plus"),
    Wrong("camera.project", C, "G = polynomial([k1, k2, k3], q) /", "G = polynomial([k1, k2, 0 * k3], q) /", "k3|entry 8 of the input params|radtan|rational"),
    Wrong("camera.project", C, "p2 * (q + 2 * x * x), p1 *", "p2 * (q + x * x), p1 *", "entry 0"),
    Wrong("camera.unproject", C, "ray[2] if wrong == \"not-unit\" else np.linalg.norm(ray)", "ray[2]", "not-unit|unit length"),
    Wrong("camera.project", C, "uv = params[:2] * lens(model, params[4:], X, wrong) + params[2:4]", "uv = params[:2] * lens(model, params[4:], X, wrong) + params[2:4] + 0.5", "corner|half a pixel"),
    Wrong("loss.cost", E, "else c * (a - 0.5 * c))", "else c * (a - c))", "without the half"),
    Wrong("loss.weight", E, "np.where(a <= c, 1.0, c / np.where(a > 0, a, 1.0))", "np.where(a <= c, 1.0, np.sqrt(c / np.where(a > 0, a, 1.0)))", "huber"),
    Wrong("least_squares.covariance", E, "wrong or \"\", r @ r / (m - n))", "wrong or \"\", r @ r / (m - n - 1))", "nothing|factor|m - n|as if"),
    Wrong("least_squares.lm_step", E, "damping * scale**2)", "damping * scale**3)", "scale|2 were 3"),
    Wrong("bundle.normal_equations", E, "\"B\": np.einsum(\"nai,nab,nbj->ij\", J, A, J)", "\"B\": 0.5 * np.einsum(\"nai,nab,nbj->ij\", J, A, J)", "B"),
    Wrong("bundle.schur", E, "\"rhs\": -g_view + sign * V @ g_point", "\"rhs\": g_view + sign * V @ g_point", "rhs|g_view"),
    Wrong("consistency.band", G, "return {\"low\": chi2.ppf(tail, n * dof) / scale, \"high\": chi2.isf(tail, n * dof) / scale}", "return {\"low\": chi2.ppf(tail, n * dof) / dof, \"high\": chi2.isf(tail, n * dof) / dof}", "by the degrees of freedom"),
    Wrong("consistency.nees", G, "right = float(e @ np.linalg.solve(P, e))", "right = float(e @ np.linalg.solve(P, e)) / 2", "1/2"),
    Wrong("grid.update", G, "wrongs.get(wrong, logit(p) + logit(q))", "wrongs.get(wrong, logit(q) - logit(p))", "sign|prior"),
    Wrong("grid.probability", G, "return {\"value\": \"nan\" if np.isnan(value) else float(value)}", "return {\"value\": float(np.float32(value))}", "single precision"),
    Wrong("two_views.draws", TV, "share**size", "size * share", "math domain"),
]  # fmt: skip
"""Those on which the names were built."""

A, P, L, TR = "plain_features", "plain_mapping", "plain_lift", "plain_tracking"

SECOND = [
    Wrong("so3.exp", B, "np.eye(3) + a * W + b * W @ W\n\n\ndef quaternion_from", "np.eye(3) + a * W + b * W * W\n\n\ndef quaternion_from", r"W \* W|matmul|hat|Phi|element|diagonal"),
    Wrong("so3.exp", B, "1 - q / 6 + q * q / 120 - q**3 / 5040", "1 + q / 6 + q * q / 120 - q**3 / 5040", "digits|below|small_angle"),
    Wrong("so3.exp", B, "2 * np.sin(angle / 2) ** 2 / q", "(1 - np.cos(angle)) / angle", "above|hat|angle"),
    Wrong("so3.exp", B, "[v[2], 0.0, -v[0]]", "[v[2], 0.0, v[0]]", r"\(1, 2\)|sign|minus|\|phi\[0\]\|"),
    Wrong("so3.log", B, "if n < 1e-12:", "if n < 1e-4:", "zero|digits|small|left|below|1/2|nothing"),
    Wrong("so3.log", B, "2 * np.arctan2(n, q[0]) / n * q[1:]", "2 * np.arctan2(n, q[0]) / n * q[1:] * [1, 1, -1]", "entry 2"),
    Wrong("so3.log", B, "    q = quaternion_from_rotation(R)\n", "    q = quaternion_from_rotation(R.T)\n", "sign|transposed|invert|vectors.*rows"),
    Wrong("so3.log", B, "2 * np.arctan2(n, q[0]) / n * q[1:]", "2 * np.arccos(min(q[0], 1.0)) / n * q[1:]", "digits|small|below"),
    Wrong("so3.left_jacobian", B, "np.eye(3) + b * W + c * W @ W", "np.eye(3) + b * W", r"hat\(phi\)\^2"),
    Wrong("so3.left_jacobian", B, "    _, b, c = weights(np.linalg.norm(phi))", "    b, c, _ = weights(np.linalg.norm(phi))", "exponential"),
    Wrong("so3.left_jacobian_inverse", B, "d = (1 - half * np.cos(half) / np.sin(half)) / angle**2", "d = (1 - half / np.sin(half)) / angle**2", "above|angle|flag"),
    Wrong("so3.left_jacobian_inverse", B, "q / 720 + q * q / 30240", "q / 720 - q * q / 30240", "digits"),
    Wrong("quaternion.from_rotation", B, "    if trace > 0:", "    if trace > -2:", "digits|near|pi|beyond|above|finite"),
    Wrong("quaternion.from_rotation", B, "(R[2, 1] - R[1, 2]) / s, (R[0, 2] - R[2, 0]) / s, (R[1, 0] - R[0, 1]) / s", "(R[1, 2] - R[2, 1]) / s, (R[2, 0] - R[0, 2]) / s, (R[0, 1] - R[1, 0]) / s", "conjugated|entries 1-3"),
    Wrong("quaternion.from_rotation", B, "q[1 + j], q[1 + k] = s / 4, (R[j, i] + R[i, j]) / s", "q[1 + j], q[1 + k] = s / 4, (R[j, i] - R[i, j]) / s", "entr|near|pi|beyond|above|angle of R"),
    Wrong("quaternion.to_rotation", B, "w, x, y, z = q\n    return", "w, x, y, z = q / 2\n    return", "q is taken half"),
    Wrong("so2.wrap", B, "return np.arctan2(np.sin(angle), np.cos(angle))", "return np.arctan2(np.cos(angle), np.sin(angle))", "cos|sin|exchanged|minus|beyond_pi|above|below"),
    Wrong("so2.wrap", B, "return np.arctan2(np.sin(angle), np.cos(angle))", "return np.fmod(angle, 2 * np.pi)", "fmod|whole turns"),
    Wrong("so2.wrap", B, "return np.arctan2(np.sin(angle), np.cos(angle))", "return np.arctan(np.tan(angle))", "wrapped-by-pi"),
    Wrong("so3.interpolate", B, "a @ so3_exp(fraction * so3_log(a.T @ b))", "so3_exp(fraction * so3_log(a.T @ b)) @ a", "exchanged|left|side"),
    Wrong("se3.exp", B, "T[:3, 3] = so3_left_jacobian(phi) @ rho", "T[:3, 3] = so3_left_jacobian_inverse(phi) @ rho", "V|J|inverse"),
    Wrong("se3.exp", B, "T[:3, 3] = so3_left_jacobian(phi) @ rho", "T[:3, 3] = so3_exp(phi) @ rho", "rotation itself"),
    Wrong("se3.log", B, "so3_left_jacobian_inverse(phi) @ T[:3, 3], phi])", "so3_left_jacobian_inverse(-phi) @ T[:3, 3], phi])", "V|[rR]ight|sign|transposed"),
    Wrong("se3.log", B, "so3_left_jacobian_inverse(phi) @ T[:3, 3], phi])", "so3_left_jacobian(phi) @ T[:3, 3], phi])", "V|[jJ]acobian|inverse|entries 0-2"),
    Wrong("se3.inverse", B, "out[:3, 3] = -R.T @ t", "out[:3, 3] = R.T @ t", "minus sign|sign"),
    Wrong("se3.inverse", B, "out[:3, :3] = R.T", "out[:3, :3] = R", "not transposed|transposed"),
    Wrong("se3.adjoint", B, "A[:3, 3:] = hat(t) @ R", "A[3:, :3] = hat(t) @ R", "rotation.first"),
    Wrong("se3.adjoint", B, "A[:3, 3:] = hat(t) @ R", "A[:3, 3:] = R @ hat(t)", "adjoint-block|exchanged"),
    Wrong("camera.jacobian_pose", B, "-fx * x * y / z**2, fx +", "-fx * x * y / z, fx +", r"\(0, 3\)"),
    Wrong("camera.jacobian_pose", B, "[0.0, fy / z,", "[0.0, fx / z,", r"\(1, 1\)"),
    Wrong("camera.jacobian_pose", B, "x, y, z = pose[:3, :3] @ X_world + pose[:3, 3]", "x, y, z = pose[:3, :3].T @ (X_world - pose[:3, 3])", "pose is taken inverted|world_from_cam"),
    Wrong("grid.ray_cells", B, "a + (low + high) / 2 * (b - a))]", "a + (low + high) / 2 * (b - a) + 0.5)]", "constant|added|half|rows|start|round"),
    Wrong("ekf.predict", F, "[dt * t / wheelbase, ds * (1 + t * t) / wheelbase]]", "[dt * t / wheelbase, ds / wheelbase]]", r"alone|\(2, 1\)|control"),
    Wrong("ekf.predict", F, "after = F.T @ P @ F + noise if wrong == \"gtpg\" else F @ P @ F.T + noise", "after = F @ P + noise", "P|transposed|nothing"),
    Wrong("ekf.predict", F, "x[:3] += [ds * c, ds * s, turn]", "x[:3] += [ds * c, ds * s, -turn]", "entry 2 of x|minus|other sign"),
    Wrong("ekf.update", F, "P - K @ S @ K.T\n    if wrong == \"pose-only\"", "P + K @ S @ K.T\n    if wrong == \"pose-only\"", "sign|only P"),
    Wrong("ekf.update", F, "S = H @ P @ H.T + block_diag(*[cov_z] * len(ids))", "S = H @ P @ H.T + block_diag(*[cov_z + np.diag([0.09, 0.0025])] * len(ids))", "process noise as sensor noise"),
    Wrong("ekf.update", F, "H[2 * k : 2 * k + 2, :3] = np.column_stack([-A, slope])", "H[2 * k : 2 * k + 2, :3] = np.column_stack([A, slope])", "column|sighting's Jacobian|-J_landmark"),
    Wrong("ekf.augment", F, "own, cross = G @ P @ G.T + R @ cov_z @ R.T, G @ P", "own, cross = G @ P @ G.T, G @ P", "cov_z is left out"),
    Wrong("ekf.augment", F, "np.concatenate([x, x[:2] + turned])", "np.concatenate([x, turned])", "only .*x|alone"),
    Wrong("ekf.from_polar", F, "grown, along, across = np.exp(v / 2), s", "grown, along, across = np.exp(-v / 2), s", "minus|sign|only z|/ 2"),
    Wrong("vehicle.front_wheel", F, "px + V * dt * np.cos(th + G)", "px + V * dt * np.cos(th - G)", "sign|entry 0"),
    Wrong("vehicle.relative", F, "    d = landmark - x[:2]\n", "    d = x[:2] - landmark\n", "sign is flipped"),
    Wrong("multiview.camera_from_world", V, "wrong or \"\", R @ (X - p))", "wrong or \"\", R @ X + p)", "centre is taken for the translation"),
    Wrong("multiview.umeyama", V, "wrong or \"\", top / moves_x", "wrong or \"\", (top / moves_x) ** 2", "scale"),
    Wrong("multiview.epipolar_distance", V, "np.hypot(*(F @ a)[:2])\n    )\n    return float(b @ F @ a / length)", "np.hypot(*(F @ a)[:2])\n    )\n    return float(abs(b @ F @ a) / length)", "sign"),
    Wrong("multiview.triangulate_optimal", V, "\"covariance\": H if wrong == \"information\" else np.linalg.inv(H)", "\"covariance\": H if wrong == \"information\" else np.linalg.inv(H) * 2", "covariance: a constant factor: 2"),
    Wrong("camera.project", C, "theta = np.arctan(rho / X[2])", "theta = np.arcsin(rho / np.sqrt(rho**2 + X[2] ** 2))", "beyond_90"),
    Wrong("camera.project", C, "moved = [2 * p1 * x * y + p2 * (q + 2 * x * x), p1 * (q + 2 * y * y) + 2 * p2 * x * y]", "moved = [2 * p2 * x * y + p1 * (q + 2 * x * x), p2 * (q + 2 * y * y) + 2 * p1 * x * y]", "tangential-swapped"),
    Wrong("camera.project", C, "params[:2] * lens(model, params[4:], X, wrong) + params[2:4]", "params[0] * lens(model, params[4:], X, wrong) + params[2:4]", "params|entry 1"),
    Wrong("camera.jacobian_point", C, "    if wrong == \"depth-column-sign\":\n", "    if True:\n", "depth-column-sign|column 2"),
    Wrong("loss.cost", E, "value = 0.5 * c * c * np.log1p(u)", "value = c * c * np.log1p(u)", "cauchy|log1p"),
    Wrong("loss.weight", E, "    return np.where(a < c, 1 - u, 0.0) ** power", "    return np.where(a < c, 1 - u, 0.0) ** 3", "tukey|2 were 3"),
    Wrong("scale.norm", E, "    sizes = np.abs(errors) if errors.ndim == 1 else np.linalg.norm(errors, axis=1)", "    sizes = np.abs(errors) if errors.ndim == 1 else np.abs(errors).sum(axis=1)", "nothing|sum|abs"),
    Wrong("least_squares.gauss_newton_step", E, "step = -np.linalg.lstsq(J, r, rcond=None)[0]", "step = np.linalg.lstsq(J, r, rcond=None)[0]", "uphill|sign"),
    Wrong("least_squares.nielsen_factor", E, "return max(1 / 3, 1", "return max(1 / 2, 1", r"3|/ 3|above|below|nothing|constant"),
    Wrong("bundle.cost", E, "squares.sum() if wrong == \"not-halved\" else 0.5 * squares.sum()", "squares.mean() if wrong == \"not-halved\" else 0.5 * squares.mean()", "nothing|mean|factor|divided"),
    Wrong("consistency.bound", G, "{\"high\": chi2.isf(tail, n * dof) / (1 if wrong == \"not-divided\" else n)}", "{\"high\": chi2.isf(tail / 2, n * dof) / (1 if wrong == \"not-divided\" else n)}", "half-tail"),
    Wrong("consistency.pose_error", G, "d[2] = np.arctan2(np.sin(d[2]), np.cos(d[2]))", "d[2] = np.fmod(d[2], 2 * np.pi)", "not wrapped|whole turns|entry 2|heading-not-wrapped"),
    Wrong("grid.log_odds", G, "else np.log(p / (1 - p))", "else np.log(1 - p) - np.log(p)", "sign"),
    Wrong("trajectory.rpe", V, "np.sqrt(np.mean(shift**2)), \"rot", "np.sqrt(np.mean(shift**2) / 3), \"rot", "trans_rmse: a constant factor"),
    Wrong("trajectory.ate", V, "np.median(e)\n", "np.sort(e)[(len(e) - 1) // 2]\n", "even.*median|median"),
    Wrong("two_views.homography_of_plane", TV, "d = 1.0 if wrong == \"distance-forgotten\" else -d", "d = 1.0 / d if wrong != \"distance-forgotten\" else -d", "d is taken inverted"),
    Wrong("two_views.fundamental", TV, "F = np.linalg.solve(K_b.T, np.linalg.solve(K_a.T, E.T).T)", "F = np.linalg.solve(K_b.T, np.linalg.solve(K_b.T, E.T).T)", "params_b is used for params_a"),
    Wrong("features.finest_from_level", A, "return 2.0**level * uv + _half(level, wrong)", "return 2.0**level * (uv + _half(level, wrong))", "nothing|as if|had"),
    Wrong("features.zncc", A, "return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])", "return float(np.corrcoef(a.ravel(), b.ravel())[0, 1] ** 2)", "square"),
    Wrong("mapping.depth_sigma", P, "np.sqrt(own**2 + (depths[1] * eps_b) ** 2) / under", "(own + depths[1] * eps_b) / under", "nothing"),
    Wrong("mapping.ray_depths", P, "np.cross(b, t) @ n, np.cross(ra, t) @ n", "np.cross(b, t) @ n, -np.cross(ra, t) @ n", "entry 1"),
    Wrong("lift.vehicle", L, "2 * s * c, -2 * s * c, px * c, -px * s,", "2 * s * c, -2 * s * c, px * c, px * s,", "P_Z|sign|minus"),
    Wrong("lift.pose", L, "J[2] /= s * s + c * c", "J[2] /= (s * s + c * c) ** 0.5", "off_lift|power|P"),
    Wrong("tracking.predict", TR, "T_now @ np.linalg.inv(T_before)", "np.linalg.inv(T_before) @ T_now", "exchanged|as if|factors"),
]  # fmt: skip
"""Those that were written after the names, to measure them."""

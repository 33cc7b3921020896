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
        return not self.slips and self.name != NOTHING


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
    Wrong("so3.left_jacobian_inverse", B, "- 0.5 * W + d * W @ W", "+ 0.5 * W + d * W @ W", "right.Jacobian|transposed"),
    Wrong("so3.left_jacobian_inverse", B, "half * np.cos(half) / np.sin(half)", "half * np.sin(half) / np.cos(half)", "above|angle|sin|small_angle|flag"),
    Wrong("so3.log", B, "        q = -q\n", "        q = +q\n", "long way|minus sign of '-q'"),
    Wrong("so3.log", B, "2 * np.arctan2(n, q[0]) / n * q[1:]", "np.arctan2(n, q[0]) / n * q[1:]", "1/2 times"),
    Wrong("so3.log", B, "2 * np.arctan2(n, q[0]) / n * q[1:]", "2 * np.arcsin(n) / n * q[1:]", "digits|near_pi|pi"),
    Wrong("quaternion.from_rotation", B, "(R[2, 1] - R[1, 2]) / s, (R[0, 2] - R[2, 0]) / s", "(R[2, 1] - R[1, 2]) / s, (R[2, 0] - R[0, 2]) / s", "entry 2"),
    Wrong("quaternion.from_rotation", B, "q[0] = (R[k, j] - R[j, k]) / s", "q[0] = (R[j, k] - R[k, j]) / s", "entry 0|conjugated"),
    Wrong("quaternion.to_rotation", B, "2 * (y * z - w * x)]", "2 * (y * z + w * x)]", r"\(1, 2\)|y \* z - w \* x"),
    Wrong("quaternion.to_rotation", B, "w, x, y, z = q", "x, y, z, w = q", "xyzw"),
    Wrong("so2.wrap", B, "return np.arctan2(np.sin(angle), np.cos(angle))", "return np.fmod(angle + np.pi, 2 * np.pi) - np.pi", "fmod"),
    Wrong("so2.wrap", B, "return np.arctan2(np.sin(angle), np.cos(angle))", "return angle - 2 * np.pi * np.sign(angle)", "wrapped-once|whole turns"),
    Wrong("so3.interpolate", B, "return a @ so3_exp(fraction * so3_log(a.T @ b))", "return a @ so3_exp(fraction * so3_log(b.T @ a))", "a.T @ b|transposed|first factor|exchanged|fraction is taken with the other sign"),
    Wrong("so3.interpolate", B, "return a @ so3_exp(fraction * so3_log(a.T @ b))", "return (1 - fraction) * a + fraction * b", "blended"),
    Wrong("se3.log", B, "so3_left_jacobian_inverse(phi) @ T[:3, 3]", "T[:3, 3]", "straight"),
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
    Wrong("camera.project", C, "p2 * (q + 2 * x * x), p1 *", "p2 * (q + x * x), p1 *", "radtan|rational|x"),
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

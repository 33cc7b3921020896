# ruff: noqa: E501
"""Wrong programs once more: short ones of another style, written before the names were asked for.

Asked once, all 66 failed; 56 were named, one falsely: a limit that was squared twice stood out in no vector.
The kinds were mended then, and the vectors got what was missing; now 61 are named.
"""

from __future__ import annotations

from wrong_programs import Wrong

S = "plain_short"

THIRD = [
    # sign
    Wrong("se2.exp", S, "[[0.0, -w, u], [w, 0.0, v]", "[[0.0, w, u], [-w, 0.0, v]", r"sign|minus|inverted|entry 2"),
    Wrong("se2.adjoint", S, "A[:2, 2] = x[1], -x[0]", "A[:2, 2] = -x[1], x[0]", r"sign|column 2|entr|inverted|minus|one sign"),
    Wrong("se2.inverse", S, "s * x[0] - c * x[1], wrapped(-x[2])", "s * x[0] + c * x[1], wrapped(-x[2])", r"sign|entry 1|minus"),
    Wrong("sim3.adjoint", S, "A[:3, 6] = -t", "A[:3, 6] = t", r"sign|column 6|\(0-2, 6\)|minus"),
    Wrong("se3.act_jacobian", S, "np.hstack([np.eye(3), -skew(moved)])", "np.hstack([np.eye(3), skew(moved)])", r"sign|3-5|minus|block"),
    Wrong("ekf.predict_additive", S, "F[0, 2], F[1, 2] = -way * np.sin(x[2])", "F[0, 2], F[1, 2] = way * np.sin(x[2])", r"sign|minus|only .*P"),
    Wrong("range_bearing.update", S, "h[1, 2] = -1.0", "h[1, 2] = 1.0", r"sign|minus|heading|bearing|-1"),
    Wrong("grid.recursion", S, "table - transition + prediction", "table + transition - prediction", r"sign|minus|transition|exchanged"),
    Wrong("multiview.epipolar_distance", S, "line = F @ [uv_a[0], uv_a[1], 1.0]", "line = F.T @ [uv_a[0], uv_a[1], 1.0]", r"transposed|F\.T|exchanged|vectors are rows"),
    # transpose / order
    Wrong("se2.compose", S, "M = frame(a) @ frame(b)", "M = frame(b) @ frame(a)", r"exchanged|reversed|order"),
    Wrong("tracking.predict", S, "step = T_now @ np.linalg.inv(T_before)", "step = np.linalg.inv(T_now) @ T_before", r"exchanged|sign|invert|body|as if|transposed"),
    Wrong("trajectory.chain", S, "poses.append(poses[-1] @ step)", "poses.append(step @ poses[-1])", r"exchanged|order|reversed|left|wrong side"),
    Wrong("bundle.schur", S, "S = S - w @ np.linalg.inv(block) @ w.T", "S = S - w @ block @ w.T", r"C is taken inverted|inv|as if|only S is wrong"),
    Wrong("features.sampling", S, "np.linalg.inv(A)", "np.linalg.inv(A).T", r"transposed"),
    Wrong("features.sampling", S, "2.0 ** (target_level - source_level)", "2.0 ** (source_level - target_level)", r"exchanged|level|power|sign"),
    Wrong("two_views.homography_distance", S, "np.eye(2) + J @ J.T", "np.eye(2) + J.T @ J", r"transposed|exchanged|factors|J"),
    Wrong("ekf.gate", S, "turn = np.array([[c, s], [-s, c]])", "turn = np.array([[c, -s], [s, c]])", r"turn|rotat|transposed|sign|minus|heading|entry 2 of the input x"),
    Wrong("camera.jacobian_rig", S, "np.hstack([np.eye(3), -skew(X_rig)])", "np.hstack([-skew(X_rig), np.eye(3)])", r"rotation.first|rotation comes before"),
    # frame
    Wrong("camera.jacobian_rig", S, "@ T_cam_rig[:3, :3] @ np.hstack", "@ np.hstack", r"extrinsic|rig"),
    Wrong("camera.jacobian_rig", S, "-skew(X_rig)", "-skew(X_cam)", r"rig|cam|3-5|extrinsic"),
    Wrong("mapping.keyframe_distance", S, "centre = -pose[:3, :3].T @ pose[:3, 3]\n    others = np.array([-T[:3, :3].T @ T[:3, 3] for T in T_kfs])", "centre = pose[:3, 3]\n    others = T_kfs[:, :3, 3]", r"centre|translation|t"),
    Wrong("bundle.residual", S, "pose[:3, :3] @ X_world + pose[:3, 3]) - uv", "pose[:3, :3].T @ (X_world - pose[:3, 3])) - uv", r"pose is taken inverted|pose-inverted|world_from_cam"),
    Wrong("trajectory.rpe", S, "true = np.linalg.inv(truth[k]) @ truth[k + 1]\n        E = np.linalg.inv(true) @ np.linalg.inv(estimate[k]) @ estimate[k + 1]", "true = truth[k + 1] @ np.linalg.inv(truth[k])\n        E = estimate[k + 1] @ np.linalg.inv(estimate[k]) @ np.linalg.inv(true)", r"world|side|trans_rmse|frame|left"),
    Wrong("trajectory.rpe", S, "true = np.linalg.inv(truth[k]) @ truth[k + 1]\n        E = np.linalg.inv(true) @ np.linalg.inv(estimate[k]) @ estimate[k + 1]", "E = np.linalg.inv(truth[k]) @ estimate[k]", r"absolute|not relative|step|nothing"),
    # unit
    Wrong("trajectory.rpe", S, "np.degrees(np.sqrt(np.mean(turns)))", "np.sqrt(np.mean(turns))", r"degrees|radians"),
    Wrong("vehicle.front_wheel", S, "V, G = control", "V, G = control[0], np.radians(control[1])", r"degrees|radians"),
    Wrong("vehicle.yaw_rate", S, "wrapped(x[2] + w * dt)", "wrapped(x[2] + w * dt * np.pi / 180)", r"degrees|radians|pi/180"),
    # half pixel
    Wrong("features.level_from_finest", S, "(uv + 0.5) / 2**level - 0.5", "uv / 2**level", r"half|centre|corner|pixel"),
    Wrong("features.level_from_finest", S, "(uv + 0.5) / 2**level - 0.5", "(uv - 0.5) / 2**level + 0.5", r"half|corner|pixel|sign|level"),
    Wrong("camera.unproject", S, "(uv[0] - params[2]) / params[0]", "(uv[0] + 0.5 - params[2]) / params[0]", r"half|entry 0|0\.5|corner"),
    Wrong("camera.unproject", S, "(uv[1] - params[3]) / params[1]", "(uv[1] - params[3]) / params[0]", r"entry 0 of the input params is used for entry 1|params|entry 1"),
    # normalisation
    Wrong("scale.mad", S, "1.482602218505602 * np.median(np.abs(errors))", "np.median(np.abs(errors)) / 1.482602218505602", r"1/1\.4826|factor|0\.45"),
    Wrong("scale.mad", S, "np.median(np.abs(errors))", "np.median(np.abs(errors - np.median(errors)))", r"median|centred|about"),
    Wrong("features.zmssd", S, "d = a - a.mean() - (b - b.mean())", "d = a - b", r"mean"),
    Wrong("features.zmssd", S, "float((d * d).sum())", "float((d * d).mean())", r"1/64|mean|factor"),
    Wrong("two_views.truncated_cost", S, "np.mean(np.minimum(squared, most))", "np.mean(np.minimum(squared, most**2))", r"squared|most"),
    Wrong("two_views.model_criterion", S, "np.log(4) * dimension * n", "np.log(4) * dimension", r"n|dimension|factor|as if"),
    Wrong("two_views.model_criterion", S, "np.log(4 * n) * unknowns", "np.log10(4 * n) * unknowns", r"log|unknowns|nothing|ln 10"),
    Wrong("two_views.nearest_essential", S, "np.diag([1.0, 1.0, 0.0])", "np.diag([_[0], _[1], 0.0])", r"singular|norm|mean|nothing|factor"),
    # small-angle, wrapping, special values
    Wrong("consistency.pose_error", S, "[d[0], d[1], wrapped(d[2])]", "[d[0], d[1], d[2]]", r"wrapped"),
    Wrong("so3.nearest", S, "last = np.sign(np.linalg.det(u) * np.linalg.det(vt))", "last = 1.0", r"mirror|det"),
    Wrong("se2.exp", S, "M = expm(np.array([[0.0, -w, u], [w, 0.0, v], [0.0, 0.0, 0.0]]))\n    return pose(M)", "return [u, v, wrapped(w)]", r"V|straight|copied|translation|unchanged|turned|x, y|entries 0-1"),
    Wrong("sim3.inverse", S, "out[:3, 3] = -(R.T @ t) / s", "out[:3, 3] = -(R.T @ t)", r"scale|/ s|1/s|alone|divided"),
    Wrong("sim3.act", S, "s * (R @ x) + t", "s * (R @ x + t)", r"scale|s|translation"),
    Wrong("sim3.exp", S, "skew(xi[3:6]) + xi[6] * np.eye(3)\n    G[:3, 3] = xi[:3]\n    return expm(G)", "skew(xi[3:6])\n    G[:3, 3] = xi[:3]\n    out = expm(G)\n    out[:3, :3] *= np.exp(xi[6])\n    return out", r"scale|V|W|SE\(3\)|translation|entr"),
    # missing terms
    Wrong("ekf.predict_additive", S, "after[:3, :3] += cov_pose", "after[:3, :3] += cov_pose * dt", r"dt|cov_pose"),
    Wrong("ekf.predict_additive", S, "after = F @ P @ F.T", "after = P.copy()", r"F|P|as if|Jacobian|identity|unchanged"),
    Wrong("range_bearing.update", S, "wrapped(b - np.arctan2(dy, dx) + x[2])", "b - np.arctan2(dy, dx) + x[2]", r"wrap|whole turns|angle"),
    Wrong("range_bearing.update", S, "np.array([dy, -dx, -dy, dx]) / q", "np.array([dy, -dx, -dy, dx]) / np.sqrt(q)", r"q|range|power|bearing|as if|square"),
    Wrong("lift.landmark", S, "[X, Y, s * X, c * X, s * Y, c * Y]", "[X, Y, s * X, s * Y, c * X, c * Y]", r"exchanged|order|entries"),
    Wrong("vehicle.velocity_arc", S, "np.array([v * dt, 0.0, w * dt])", "np.array([v, 0.0, w * dt])", r"dt|v|control"),
    Wrong("vehicle.yaw_rate", S, "return [x[0] + v * dt * np.cos(x[2]), x[1] + v * dt * np.sin(x[2])", "x = x + [0, 0, w * dt]\n    return [x[0] + v * dt * np.cos(x[2]), x[1] + v * dt * np.sin(x[2])", r"turn|new heading|after|twice|before|heading"),
    # off by one, loops
    Wrong("trajectory.rpe", S, "range(len(truth) - 1)", "range(len(truth) - 2)", r"last"),
    Wrong("trajectory.chain", S, "for step in steps:", "for step in steps[1:]:", r"first|shape|steps"),
    Wrong("bundle.back_substitute", S, "zip(C, rhs.reshape(-1, 3), strict=True)", "zip(C[[0] * len(C)], rhs.reshape(-1, 3), strict=True)", r"first|C|block"),
    Wrong("bundle.schur", S, "rhs = rhs + w @", "rhs = -g_view + w @", r"last|only|rhs"),
    Wrong("features.halve", S, "(whole + 2) // 4", "whole // 4", r"round|half|down|cut"),
    Wrong("grid.follow", S, "start + np.cumsum(evidence)", "start + np.cumsum(evidence) - evidence", r"shift|before|previous|first|one|evidence|nothing"),
    Wrong("mapping.keyframe_distance", S, "depth = np.median(", "depth = np.mean(", r"mean|median"),
    Wrong("mapping.keyframe_distance", S, ".min()\n", ".max()\n", r"max|farthest|min|nearest|last|first"),
    Wrong("multiview.midpoint", S, "(p_a + s * b_a + p_b + t * b_b) / 2", "p_a + s * b_a", r"first|only|alone|a"),
    Wrong("least_squares.nielsen_factor", S, "max(1 / 3, 1 - rho**3)", "max(1 / 3, 1 - abs(rho) ** 3)", r"sign|only|below|abs|gain"),
    Wrong("loss.influence", S, "np.clip(x, -c, c)", "np.clip(x, 0, c)", r"negative|below|sign|only"),
    Wrong("se3.interpolate", S, "a @ expm(fraction * np.real(logm(step)))", "b @ expm(fraction * np.real(logm(step)))", r"exchanged|b is used for a|a|start|fraction"),
    Wrong("camera.jacobian_intrinsics", S, "[[x, 0.0, 1.0, 0.0], [0.0, y, 0.0, 1.0]]", "[[x, 0.0, 1.0, 0.0], [0.0, x, 0.0, 1.0]]", r"\(1, 1\)|entry 0 of the input X_cam is used for entry 1"),
    Wrong("two_views.depths", S, "-T_b_a[:3, 3]", "T_b_a[:3, 3]", r"sign"),
]  # fmt: skip
"""One mistake each, in each topic."""

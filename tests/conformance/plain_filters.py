"""EKF-SLAM as a program would write it: closed formulas in doubles, and their mistakes.

Nothing of the library and nothing of the vectors' generator is used here.  Without a mistake these functions
are one more oracle of the vectors; with one, they are the deliberately wrong program that must be found out.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

Array = NDArray[np.float64]
Answer = dict[str, Any]


def arrays(*values: Any) -> list[Array]:
    return [np.array(v, dtype=np.float64) for v in values]


def wrap(angle: float) -> float:
    return float(np.pi - (np.pi - angle) % (2 * np.pi))


# -- vehicles ----------------------------------------------------------------------------------------


def ackermann(x: Any, control: Any, wheelbase: float, track: float, dt: float, wrong: str = "") -> Answer:
    (px, py, th), (v, phi) = x, control
    if wrong == "front-wheel":
        return front_wheel(x, control, wheelbase, dt)
    ds = v * dt
    turn = ds * np.tan(phi) / (track if wrong == "track-width" else wheelbase)
    if wrong == "sine-for-tangent":
        turn = ds * np.sin(phi) / wheelbase
    along = th + {"turn-first": turn, "half-turn-first": turn / 2}.get(wrong, 0.0)
    dx, dy = ds * np.cos(along), ds * np.sin(along)
    if wrong == "exact-arc":
        chord, middle = ds * np.sinc(turn / 2 / np.pi), th + turn / 2
        dx, dy = chord * np.cos(middle), chord * np.sin(middle)
    if wrong == "sin-cos-swapped":
        dx, dy = dy, dx
    heading = th + turn if wrong == "heading-not-wrapped" else wrap(th + turn)
    return {"x": [px + dx, py + dy, heading]}


def front_wheel(x: Any, control: Any, wheelbase: float, dt: float, wrong: str = "") -> Answer:
    (px, py, th), (V, G) = x, control
    if wrong == "rear-axle":
        return ackermann(x, control, wheelbase, wheelbase, dt)
    yaw = np.sin(G / wheelbase) if wrong == "sine-of-the-ratio" else np.sin(G) / wheelbase
    heading = th + V * dt * yaw
    heading = heading if wrong == "heading-not-wrapped" else wrap(heading)
    return {"x": [px + V * dt * np.cos(th + G), py + V * dt * np.sin(th + G), heading]}


def turn(angle: float) -> Array:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def relative(x: Any, landmark: Any, wrong: str = "") -> Answer:
    x, landmark = arrays(x, landmark)
    d = landmark - x[:2]
    return {"z": {"not-turned": d, "transposed-rotation": turn(x[2]) @ d}.get(wrong, turn(-x[2]) @ d)}


def place(x: Any, z: Any, wrong: str = "") -> Answer:
    x, z = arrays(x, z)
    moved = {"not-turned": z, "transposed-rotation": turn(-x[2]) @ z}.get(wrong, turn(x[2]) @ z)
    return {"landmark": x[:2] + moved}


# -- EKF-SLAM ----------------------------------------------------------------------------------------


def predict(x: Any, P: Any, control: Any, cov_u: Any, wheelbase: float, dt: float, wrong: str = "") -> Answer:
    x, P, (v, phi), Q = arrays(x, P, control, cov_u)
    n, c, s, t = len(x), np.cos(x[2]), np.sin(x[2]), np.tan(phi)
    ds, turn = v * dt, v * dt * t / wheelbase
    F, G = np.eye(n), np.zeros((n, 2))
    F[:2, 2] = [-ds * c, ds * s] if wrong == "sin-cos-swapped" else [-ds * s, ds * c]
    G[:3] = [[dt * c, 0], [dt * s, 0], [dt * t / wheelbase, ds * (1 + t * t) / wheelbase]]
    if wrong == "cov-u-as-increment":
        G[:3] = [[c, 0], [s, 0], [0, 1]]
    noise = G @ Q @ G.T * (wrong != "no-process-noise")
    after = F.T @ P @ F + noise if wrong == "gtpg" else F @ P @ F.T + noise
    if wrong == "cross-not-moved":
        after[:3, 3:], after[3:, :3] = P[:3, 3:], P[3:, :3]
    x[:3] += [ds * c, ds * s, turn]
    return {"x": _wrapped(x, wrong), "P": after}


def _wrapped(x: Array, wrong: str) -> Array:
    if wrong != "heading-not-wrapped":
        x[2] = wrap(x[2])
    return x


def update(x: Any, P: Any, ids: Any, z: Any, cov_z: Any, wrong: str = "") -> Answer:
    x, P, z, cov_z = arrays(x, P, z, cov_z)
    if not len(ids):
        return {"x": x, "P": P}
    if wrong == "one-at-a-time" and len(ids) > 1:
        for i, row in zip(ids, z, strict=True):
            x, P = update(x, P, [i], [row], cov_z).values()
        return {"x": x, "P": P}
    c, s = np.cos(x[2]), np.sin(x[2])
    H, predicted = np.zeros((2 * len(ids), len(x))), []
    for k, i in enumerate(map(int, ids)):
        d = x[3 + 2 * i : 5 + 2 * i] - x[:2]
        A = np.array([[c, s], [-s, c]])
        slope = np.array([[-s, c], [-c, -s]]) @ d
        if wrong == "global-measurement":
            A, slope = np.eye(2), np.zeros(2)
        if wrong == "transposed-rotation":
            A, slope = A.T, np.array([[-s, -c], [c, -s]]) @ d
        if wrong == "heading-column-sign":
            slope = -slope
        H[2 * k : 2 * k + 2, :3] = np.column_stack([-A, slope])
        H[2 * k : 2 * k + 2, 3 + 2 * i : 5 + 2 * i] = A
        predicted += list(A @ d)
    nu = z.ravel() - predicted
    S = H @ P @ H.T + block_diag(*[cov_z] * len(ids))
    K = np.linalg.solve(S, H @ P).T
    after, kept = x + K @ nu * (-1 if wrong == "innovation-sign" else 1), P - K @ S @ K.T
    if wrong == "pose-only":
        after[3:], whole = x[3:], P.copy()
        whole[:3, :3] = kept[:3, :3]
        kept = whole
    return {"x": _wrapped(after, wrong), "P": kept}


def augment(x: Any, P: Any, z: Any, cov_z: Any, wrong: str = "") -> Answer:
    x, P, z, cov_z = arrays(x, P, z, cov_z)
    c, s = np.cos(x[2]), np.sin(x[2])
    R = np.array([[c, -s], [s, c]])
    turned, slope = R @ z, np.array([[-s, -c], [c, -s]]) @ z
    if wrong == "placed-unrotated":
        R, turned, slope = np.eye(2), z, np.zeros(2)
    G = np.zeros((2, len(x)))
    G[:, :2], G[:, 2] = np.eye(2), slope
    if wrong == "noise-not-turned":
        R = np.eye(2)
    own, cross = G @ P @ G.T + R @ cov_z @ R.T, G @ P
    if wrong == "sensor-noise-only":
        own = R @ cov_z @ R.T
    if wrong == "identity-landmark":
        own = np.eye(2)
    if wrong in ("identity-landmark", "no-cross-covariance"):
        cross = 0 * cross
    if wrong == "cross-with-pose-only":
        cross[:, 3:] = 0
    return {"x": np.concatenate([x, x[:2] + turned]), "P": np.block([[P, cross.T], [cross, own]])}


def from_polar(polar: Any, sigma_range: float, sigma_bearing: float, wrong: str = "") -> Answer:
    (r, b), s, v = polar, sigma_range**2, sigma_bearing**2
    grown, along, across = np.exp(v / 2), s, r * r * v
    if not wrong:
        along = s * (1 + np.expm1(2 * v) / 2) - r * r * np.expm1(v) ** 2 / 2
        across = (r * r - s) * np.expm1(2 * v) / 2
    if min(r, along, across) <= 0:
        raise ValueError("no positive variance")
    R = np.array([[np.cos(b), -np.sin(b)], [np.sin(b), np.cos(b)]])
    z = (1.0 if wrong else grown) * r * R[:, 0]
    return {"z": z, "cov": R @ np.diag([along, across]) @ R.T}


def yaw_rate(x: Any, control: Any, dt: float, wrong: str = "") -> Answer:
    (px, py, th), (v, omega) = x, control
    if wrong == "exact-arc":
        return velocity_arc(x, control, dt)
    if wrong:
        return yaw_rate([px, py, th + omega * dt], [v, 0.0], dt)
    return {"x": [px + v * dt * np.cos(th), py + v * dt * np.sin(th), wrap(th + omega * dt)]}


def velocity_arc(x: Any, control: Any, dt: float, wrong: str = "") -> Answer:
    (px, py, th), (v, omega) = x, control
    if wrong:
        return yaw_rate(x, control, dt, "" if wrong == "ahead-then-turn" else wrong)
    chord, middle = v * dt * np.sinc(omega * dt / 2 / np.pi), th + omega * dt / 2
    return {"x": [px + chord * np.cos(middle), py + chord * np.sin(middle), wrap(th + omega * dt)]}


def predict_additive(
    x: Any, P: Any, control: Any, cov_pose: Any, wheelbase: float, dt: float, wrong: str = ""
) -> Answer:
    found = predict(x, P, control, np.zeros((2, 2)), wheelbase, dt)
    R = block_diag(turn(x[2]), 1.0) if wrong else np.eye(3)
    found["P"][:3, :3] += R @ np.array(cov_pose) @ R.T
    return found


def gate(x: Any, P: Any, id: int, z: Any, cov_z: Any, wrong: str = "") -> Answer:
    x, P, z, cov_z = arrays(x, P, z, cov_z)
    d, R, at = x[3 + 2 * id : 5 + 2 * id] - x[:2], turn(-x[2]), 3 + 2 * id
    H = np.zeros((2, len(x)))
    H[:, :2], H[:, 2], H[:, at : at + 2] = -R, [(R @ d)[1], -(R @ d)[0]], R
    S = cov_z if wrong == "noise-alone" else H @ P @ H.T + cov_z
    value = float((z - R @ d) @ np.linalg.inv(S) @ (z - R @ d))
    return {"value": value**0.5 if wrong == "distance-not-squared" else value}


def update_polar(x: Any, P: Any, ids: Any, polar: Any, cov: Any, wrong: str = "") -> Answer:
    """Jacobians by complex numbers: r e^(ib) is the relative place."""
    x, P, polar, cov = arrays(x, P, polar, cov)
    if not len(ids):
        return {"x": x, "P": P}
    H, nu = np.zeros((2 * len(ids), len(x))), []
    for k, (i, (r, b)) in enumerate(zip(map(int, ids), polar, strict=True)):
        at = 3 + 2 * i
        w = complex(*(x[at : at + 2] - x[:2]))
        size = abs(w)
        H[2 * k, at : at + 2] = w.real / size, w.imag / size
        H[2 * k + 1, at : at + 2] = -w.imag / size**2, w.real / size**2
        H[2 * k : 2 * k + 2, :2] = -H[2 * k : 2 * k + 2, at : at + 2]
        H[2 * k + 1, 2] = -1
        off = b - wrap(np.angle(w) - x[2])
        nu += [r - size, off if wrong == "bearing-not-wrapped" else wrap(off)]
    if wrong == "bearing-sign":
        H[1::2] *= -1
    S = H @ P @ H.T + block_diag(*[cov] * len(ids))
    K = np.linalg.solve(S, H @ P).T
    return {"x": _wrapped(x + K @ nu, ""), "P": P - K @ S @ K.T}


def trace(
    x: Any,
    P: Any,
    wheelbase: float,
    dt: float,
    controls: Any,
    cov_u: Any,
    sightings: Any,
    cov_z: Any,
    wrong: str = "",
    spoiled: int = -1,
) -> Answer:
    """A run; ``spoiled`` is a step after which the first entry of P is 0.1 % too large."""
    state: Answer = {"x": x, "P": P}
    places: dict[int, int] = {}
    steps = []
    sensor = cov_u if wrong == "process-noise-as-sensor-noise" else cov_z
    for k, (u, seen) in enumerate(zip(controls, sightings, strict=True)):
        state = predict(**state, control=u, cov_u=cov_u, wheelbase=wheelbase, dt=dt, wrong=wrong)
        both = list(zip(seen["ids"], seen["z"], strict=True))
        known = [(places[i], z) for i, z in both if i in places]
        if known:
            ids, z = [i for i, _ in known], [z for _, z in known]
            state = update(**state, ids=ids, z=z, cov_z=sensor, wrong=wrong)
        for i, z in both:
            if i not in places:
                places[i] = len(places)
                state = augment(**state, z=z, cov_z=sensor, wrong=wrong)
        if k == spoiled:
            state["P"][0, 0] *= 1.001
        steps.append({key: np.array(value).tolist() for key, value in state.items()})
    return {"steps": steps}


def anchored_trace(x: Any, P: Any, wrong: str = "", spoiled: int = -1, **run: Any) -> Answer:
    x, P = arrays(x, P)
    steps = []
    c, s = np.cos(x[2]), np.sin(x[2])
    for local in trace(np.zeros(3), np.zeros((3, 3)), spoiled=spoiled, **run)["steps"]:
        (a, b, angle), own = local["x"][:3], np.array(local["P"])[:3, :3]
        J0 = np.array([[1, 0, -s * a - c * b], [0, 1, c * a - s * b], [0, 0, 1]])
        J = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        first = P if wrong == "start-not-carried" else J0 @ P @ J0.T
        second = own if wrong == "own-not-turned" else J @ own @ J.T
        pose = [x[0] + c * a - s * b, x[1] + s * a + c * b, wrap(x[2] + angle)]
        steps.append({"x": pose, "P": (first + second).tolist()})
    return {"steps": steps}


def ideal_trace(
    x: Any, P: Any, wheelbase: float, dt: float, controls: Any, cov_u: Any, sightings: Any, cov_z: Any,
    truth: Any, landmarks: Any, spoiled: int = -1,
) -> Answer:  # fmt: skip
    """As one linear Kalman filter on the errors, with F, G, H typed in at the truth."""
    x, P, cov_u, cov_z, truth, landmarks = arrays(x, P, cov_u, cov_z, truth, landmarks)
    order: list[int] = []
    steps = []
    for k, ((v, phi), seen) in enumerate(zip(controls, sightings, strict=True)):
        (hx, hy, ht), (tx, ty, tt), n = truth[k], truth[k + 1], len(x)
        t = np.tan(phi)
        D = np.array([[dt, 0], [dt * t / wheelbase, v * dt * (1 + t * t) / wheelbase]])
        F, G = np.eye(n), np.zeros((n, 2))
        ds = (tx - hx) * np.cos(ht) + (ty - hy) * np.sin(ht)
        F[:2, 2] = -ds * np.sin(ht), ds * np.cos(ht)
        G[:3] = [[np.cos(ht), 0], [np.sin(ht), 0], [0, 1]]
        x[:3] += v * dt * np.cos(x[2]), v * dt * np.sin(x[2]), v * dt * t / wheelbase
        P = F @ P @ F.T + G @ D @ cov_u @ D.T @ G.T
        both = list(zip(seen["ids"], map(np.array, seen["z"]), strict=True))
        H, nu = [], []
        for i, z in both:
            if i in order:
                at = 3 + 2 * order.index(i)
                row, r = np.zeros((2, n)), turn(-tt) @ (landmarks[i] - [tx, ty])
                row[:, :2], row[:, 2], row[:, at : at + 2] = -turn(-tt), [r[1], -r[0]], turn(-tt)
                H.append(row)
                nu.append(z - turn(-x[2]) @ (x[at : at + 2] - x[:2]))
        if H:
            A = np.vstack(H)
            S = A @ P @ A.T + block_diag(*[cov_z] * len(H))
            K = np.linalg.solve(S, A @ P).T
            x, P = x + K @ np.concatenate(nu), P - K @ S @ K.T
        x[2] = wrap(x[2])
        for i, z in both:
            if i not in order:
                order.append(i)
                d = landmarks[i] - [tx, ty]
                J = np.zeros((2, len(x)))
                J[:, :2], J[:, 2] = np.eye(2), [-d[1], d[0]]
                own = J @ P @ J.T + turn(tt) @ cov_z @ turn(tt).T
                P = np.block([[P, P @ J.T], [J @ P, own]])
                x = np.concatenate([x, x[:2] + turn(x[2]) @ z])
        if k == spoiled:
            P[0, 0] *= 1.001
        steps.append({"x": x[:3].tolist(), "P": P[:3, :3].tolist()})
    return {"steps": steps}

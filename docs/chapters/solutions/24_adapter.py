"""Solution of exercise 24.1: an adapter for a small library that was handed over, and its one fault.

Degrees, columns first and the lens's dictionary are packing: the adapter sees to them.  Where a pose leads,
on which side a step stands and in which order is meaning: it is declared, and the runner converts.
The adapter works out nothing itself, so the fault that shows is the library's.

The commonest cause in the report is a transposed matrix.  It cannot be that: larger angles pass.  For tiny
angles the transpose of I + hat(phi) / 2 + ... and I - hat(phi) / 2 are the same to the last digit.
"""

import numpy as np

# --- the library, as it was handed to you; it is not to be changed ---------------------------------


def lib_turn(degrees):
    """Rotation matrix of a rotation vector in degrees, as nine numbers column by column."""
    return _rodrigues(np.radians(degrees))[0].flatten("F")


def lib_smear(degrees):
    """Left Jacobian of a rotation vector in degrees: nine numbers column by column.

    J with turn(v + d) = turn(J d) turn(v) to first order.
    """
    v = np.radians(degrees)
    J = np.eye(3) - _cross(v) / 2 if np.linalg.norm(v) < 1e-4 else _rodrigues(v)[1]
    return J.flatten("F")


def lib_move(step):
    """Rigid motion of a step (rotation in radians, then translation): sixteen numbers column by column."""
    T = np.eye(4)
    T[:3, :3], V = _rodrigues(step[:3])
    T[:3, 3] = V @ step[3:]
    return T.flatten("F")


def lib_see(lens, seat, X_world):
    """Pixel of a world point, None if it is not in front.

    ``lens`` is {"focal": (fx, fy), "centre": (cx, cy)}; ``seat`` is where the camera sits in the world,
    T_world_cam, sixteen numbers column by column.
    """
    x = _in_camera(seat, X_world)
    if x[2] <= 0:
        return None
    return np.array(lens["focal"]) * x[:2] / x[2] + lens["centre"]


def lib_slope(lens, seat, X_world):
    """Jacobian (2, 6) of the pixel in a step on the right, seat move(step): rotation, then translation."""
    x = _in_camera(seat, X_world)
    J_x = np.array(lens["focal"])[:, None] * np.array([[1, 0, -x[0] / x[2]], [0, 1, -x[1] / x[2]]]) / x[2]
    return np.hstack([J_x @ _cross(x), -J_x])


def _cross(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def _rodrigues(v):
    """Rotation matrix of a rotation vector, and its mean over the way there."""
    a, W = np.linalg.norm(v), _cross(v)
    half = np.sinc(a / (2 * np.pi)) ** 2 / 2  # (1 - cos a) / a^2
    rest = (a - np.sin(a)) / a**3 if a > 0.01 else 1 / 6 - a**2 / 120 + a**4 / 5040
    return np.eye(3) + np.sinc(a / np.pi) * W + half * W @ W, np.eye(3) + half * W + rest * W @ W


def _in_camera(seat, X_world):
    T = np.reshape(seat, (4, 4), order="F")
    return T[:3, :3].T @ (X_world - T[:3, 3])


# --- what you write ------------------------------------------------------------------------------


def convention() -> dict[str, str]:
    """What this library has to declare, as in the file of ``--convention``."""
    return {
        "transform": "world_from_cam",
        "perturbation": "right",
        "tangent_order": "rotation_first",
    }


def answer(function: str, inputs: dict) -> dict:
    """Answer one question with the library."""
    if function == "so3.exp":
        return {"R": unpacked(lib_turn(np.degrees(inputs["phi"])), 3)}
    if function == "so3.left_jacobian":
        return {"J": unpacked(lib_smear(np.degrees(inputs["phi"])), 3)}
    if function == "se3.exp":
        return {"T": unpacked(lib_move(np.array(inputs["xi"])), 4)}
    if function in ("camera.project", "camera.jacobian_pose") and inputs["model"] == "pinhole":
        fx, fy, cx, cy = inputs["params"]
        lens = {"focal": (fx, fy), "centre": (cx, cy)}
        if function == "camera.project":
            uv = lib_see(lens, np.eye(4).flatten("F"), np.array(inputs["X_cam"]))  # at home: camera is world
            if uv is None:
                raise ValueError("the point is not in front of the camera")
            return {"uv": uv.tolist(), "valid": True}
        seat = np.array(inputs["pose"]).flatten("F")
        return {"J": lib_slope(lens, seat, np.array(inputs["X_world"])).tolist()}
    raise NotImplementedError(function)


def fault() -> tuple[str, str]:
    """The left Jacobian: below 1e-4 rad it is I - hat(phi) / 2 for I + hat(phi) / 2."""
    return "so3.left_jacobian", "small-angle-sign"


def unpacked(numbers: np.ndarray, size: int) -> list:
    """Rows of a square matrix that came column by column."""
    return np.reshape(numbers, (size, size), order="F").tolist()

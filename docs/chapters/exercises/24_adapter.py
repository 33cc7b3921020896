"""Exercise 24.1: an adapter for a small library that was handed to you, and its one fault.

Functions of the catalogue to answer: so3.exp, so3.left_jacobian, se3.exp, camera.project and
camera.jacobian_pose, the last two for the model "pinhole".  All else is unsupported.  To run the vectors:

    vslam-ref verify --module 24_adapter       # in the folder of this file, with PYTHONPATH=.

What is declared in convention() goes into a JSON file for --convention.
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
    """What this library has to declare, as in the file of ``--convention``.

    Only what differs from the house; keys and words are those of ``vslam_ref.conformance.conventions``.
    """
    raise NotImplementedError


def answer(function: str, inputs: dict) -> dict:
    """Answer one question with the library.

    Parameters
    ----------
    function : str
        Name in the catalogue.
    inputs : dict
        Numbers and nested lists by the catalogue's names, in the convention that is declared.

    Returns
    -------
    dict
        The outputs by the catalogue's names, in the convention that is declared.

    Raises
    ------
    NotImplementedError
        Where the library has no such function or model.
    ValueError
        Where it refuses the inputs.
    """
    raise NotImplementedError


def fault() -> tuple[str, str]:
    """The catalogue's function in which the library is wrong, and the id of the note that says how."""
    raise NotImplementedError

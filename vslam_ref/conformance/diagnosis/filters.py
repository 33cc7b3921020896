# ruff: noqa: E501
"""EKF-SLAM with one entry of one Jacobian spoiled: a sign in F, a zero in H, a noise turned the wrong way.

::

    F  d after / d before (3, 3)   G  d after / d control (3, 2)     predict
    H  d sighting / d pose (2, 3), L  d sighting / d landmark (2, 2)  update
    A  d landmark / d pose (2, 3), R  d landmark / d sighting (2, 2)  augment
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.diagnosis.changes import FAILURES
from vslam_ref.conformance.diagnosis.evidence import Answer, AnsweredCase, Evidence, Guess, array
from vslam_ref.conformance.vectors_format import Case

Spoil = Callable[[str, Array], Array]
SHAPES = {
    "ekf.predict": {"F": (3, 3), "G": (3, 2)},
    "ekf.update": {"H": (2, 3), "L": (2, 2)},
    "ekf.augment": {"A": (2, 3), "R": (2, 2)},
}
MEANING = {
    "F": "the pose's Jacobian F in the pose", "G": "its Jacobian G in the control", "H": "the sighting's Jacobian in the pose",
    "L": "the sighting's Jacobian in the landmark", "A": "the new landmark's Jacobian in the pose",
    "R": "the new landmark's Jacobian in the sighting",
}  # fmt: skip


def spoiled(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """One entry of a Jacobian with the other sign, or zero; a Jacobian transposed, or without its wrapping."""
    name = evidence.function.name
    for letter, shape in SHAPES.get(name, {}).items():
        for at in np.ndindex(shape):
            for words, factor in (("has the other sign", -1.0), ("is zero", 0.0), ("is twice as large", 2.0)):
                yield f"entry {at} of {MEANING[letter]} {words}", _of(name, _entry(letter, at, factor))
        if shape[0] == shape[1] and letter != "F":
            yield f"{MEANING[letter]} is transposed", _of(name, _turned(letter))
        for column in range(shape[1]):
            words = f"column {column} of {MEANING[letter]}"
            yield f"{words} has the other sign", _of(name, _column(letter, column, -1.0))
            yield f"{words} is zero", _of(name, _column(letter, column, 0.0))


def _entry(letter: str, at: tuple[int, ...], factor: float) -> Spoil:
    def spoil(name: str, J: Array) -> Array:
        if name == letter:
            J = J.copy()
            J[at] *= factor
        return J

    return spoil


def _column(letter: str, column: int, factor: float) -> Spoil:
    def spoil(name: str, J: Array) -> Array:
        return J * np.where(np.arange(J.shape[1]) == column, factor, 1.0) if name == letter else J

    return spoil


def _turned(letter: str) -> Spoil:
    return lambda name, J: J.T if name == letter else J


def _of(function: str, spoil: Spoil) -> Guess:
    steps: dict[str, Callable[..., dict[str, Array]]] = {
        "ekf.predict": predict,
        "ekf.update": update,
        "ekf.augment": augment,
    }
    formula = steps[function]

    def guess(case: Case, got: Answer) -> Answer | None:
        try:
            found = formula(spoil, **{name: array(value) for name, value in case.inputs.items()})
            return {name: np.asarray(value).tolist() for name, value in found.items()}
        except FAILURES:
            return None

    return guess


def _wrapped(x: Array) -> Array:
    x = x.copy()
    x[2] = np.pi - (np.pi - x[2]) % (2 * np.pi)
    return x


def predict(
    spoil: Spoil, x: Any, P: Any, control: Any, cov_u: Any, wheelbase: Any, dt: Any
) -> dict[str, Array]:
    """One prediction, with its Jacobians as they are spoiled."""
    (v, steering), (c, s), n = control, (np.cos(x[2]), np.sin(x[2])), len(x)
    ahead, tan = v * dt, np.tan(steering)
    F, G = np.eye(n), np.zeros((n, 2))
    F[:3, :3] = spoil("F", np.array([[1, 0, -ahead * s], [0, 1, ahead * c], [0, 0, 1]]))
    G[:3] = spoil(
        "G", np.array([[dt * c, 0], [dt * s, 0], [dt * tan / wheelbase, ahead * (1 + tan**2) / wheelbase]])
    )
    moved = x.copy()
    moved[:3] += ahead * c, ahead * s, ahead * tan / wheelbase
    return {"x": _wrapped(moved), "P": F @ P @ F.T + G @ cov_u @ G.T}


def stacked(spoil: Spoil, x: Array, ids: Array, z: Array) -> tuple[Array, Array]:
    """Jacobian of all sightings, and the innovation."""
    c, s = np.cos(x[2]), np.sin(x[2])
    A, H, nu = np.array([[c, s], [-s, c]]), np.zeros((2 * len(ids), len(x))), np.zeros(2 * len(ids))
    for k, i in enumerate(ids.astype(int)):
        rows, at = slice(2 * k, 2 * k + 2), slice(3 + 2 * i, 5 + 2 * i)
        h = A @ (x[at] - x[:2])
        H[rows, :3] = spoil("H", np.column_stack([-A, [h[1], -h[0]]]))
        H[rows, at] = spoil("L", A)
        nu[rows] = z[k] - h
    return H, nu


def update(spoil: Spoil, x: Any, P: Any, ids: Any, z: Any, cov_z: Any) -> dict[str, Array]:
    """One update, with its Jacobian as it is spoiled."""
    H, nu = stacked(spoil, x, ids, z)
    S = H @ P @ H.T + np.kron(np.eye(len(ids)), cov_z)
    K = np.linalg.solve(S, H @ P).T
    return {"x": _wrapped(x + K @ nu), "P": P - K @ S @ K.T}


def augment(spoil: Spoil, x: Any, P: Any, z: Any, cov_z: Any) -> dict[str, Array]:
    """One new landmark, with its Jacobians as they are spoiled."""
    c, s = np.cos(x[2]), np.sin(x[2])
    R = np.array([[c, -s], [s, c]])
    moved = R @ z
    A, R = spoil("A", np.array([[1, 0, -moved[1]], [0, 1, moved[0]]])), spoil("R", R)
    cross = A @ P[:3]
    own = A @ P[:3, :3] @ A.T + R @ cov_z @ R.T
    return {"x": np.concatenate([x, x[:2] + moved]), "P": np.block([[P, cross.T], [cross, own]])}


def added_noise(evidence: Evidence) -> str:
    """A block added to S in single updates beside the sensor's noise, read off the covariances.

    P - P' = P H^T S^-1 H P, so H (P - P') H^T = A S^-1 A with A = H P H^T, and S = A (H (P - P') H^T)^-1 A.
    """
    if evidence.function.name != "ekf.update":
        return ""
    found = [block for block in map(_block, evidence.failed) if block is not None]
    if len(found) < 3 or len(found) <= 0.5 * sum(len(s.case.inputs["ids"]) == 1 for s in evidence.failed):
        return ""
    blocks = np.array(found)
    middle = np.median(blocks, axis=0)
    if np.abs(blocks - middle).max() > 1e-4 * np.abs(middle).max() or np.abs(middle).max() == 0:
        return ""
    rows = "; ".join(" ".join(f"{x:.4g}" for x in row) for row in middle)
    return f"a block is added to S beside H P H^T and cov_z, the same in all cases: [{rows}]: process noise as sensor noise"


def _block(seen: AnsweredCase) -> Array | None:
    """What is in S beside H P H^T and cov_z, for one sighting."""
    given: dict[str, Any] = {name: array(value) for name, value in seen.case.inputs.items()}
    after: Any = array(seen.got.get("P"))
    if any(value is None for value in given.values()) or len(given["ids"]) != 1 or after is None:
        return None
    if after.shape != given["P"].shape:
        return None
    try:
        H, _ = stacked(lambda _, J: J, given["x"], given["ids"], given["z"])
        A = H @ given["P"] @ H.T
        return np.asarray(A @ np.linalg.inv(H @ (given["P"] - after) @ H.T) @ A - A - given["cov_z"])
    except FAILURES:
        return None

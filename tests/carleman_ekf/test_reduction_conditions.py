"""What a user may do to the lifted filter from outside without losing the reduction, and what not.

Allowed: everything that depends on the measurement, on the innovation and on S.  Not allowed:
anything that reads or writes lifted states outside the reduced ones, or treats them unevenly.
Tolerances as in ``test_reduction_theorem``.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from vslam_ref.filters.carleman_ekf import LiftedCarlemanEkf, ReducedCarlemanEkf, lift

EQUAL, BROKEN = 2e-11, 2e-8
Array = np.ndarray


def pair(drive: Any) -> tuple[LiftedCarlemanEkf, ReducedCarlemanEkf]:
    return LiftedCarlemanEkf(drive.mean, drive.cov), ReducedCarlemanEkf(drive.mean, drive.cov)


def seen_r(slam: Any, ids: Array, cov_z: Array) -> Array:
    """Predicted r_i (B, m, 2) of known landmarks, through the public door only."""
    zero = np.zeros((len(slam.pose().mean), len(ids), 2))
    return -copy.deepcopy(slam).update(ids, zero, cov_z).innovation.reshape(zero.shape)


def lifted_map(slam: LiftedCarlemanEkf, ids: Array, cov_z: Array) -> Array:
    known = slam.landmarks()
    return known.mean[:, [known.ids.tolist().index(i) for i in ids]]


def composed_map(slam: ReducedCarlemanEkf, ids: Array, cov_z: Array) -> Array:
    pose, r = slam.pose().mean, seen_r(slam, ids, cov_z)
    h = np.exp(1j * pose[:, 2])[:, None]
    world = pose[:, :1] + 1j * pose[:, 1:2] + h * (r[..., 0] + 1j * r[..., 1])
    return np.stack([world.real, world.imag], -1)


def run(slam: Any, drive: Any, known_ids: set[int], update: Callable[[Any, Array, Array], None]) -> None:
    """Run one filter; ``update`` gets the known part of each sighting, new landmarks enter as usual."""
    for step in drive.steps:
        slam.predict(step.increment)
        old = np.array([i in known_ids for i in step.ids], dtype=bool)
        if old.any():
            update(slam, step.ids[old], step.z[:, old])
        if (~old).any():
            slam.update(step.ids[~old], step.z[:, ~old], drive.cov_z)
            known_ids |= set(step.ids[~old].tolist())


# --- the measurement covariance -----------------------------------------------------------------------


def by_distance(drive: Any, place: Callable[[Any, Array], Array]) -> Callable[[Any, Array, Array], None]:
    """Noise that grows with |place| (the batch's mean), as for a converted range."""

    def update(slam: Any, ids: Array, z: Array) -> None:
        size = np.linalg.norm(place(slam, ids).mean(0), axis=-1)
        slam.update(ids, z, drive.cov_z * (1 + 0.2 * size[:, None, None]))

    return update


def test_covariance_may_depend_on_the_predicted_measurement(drive: Any, largest_difference: Any) -> None:
    slams = pair(drive)
    for slam in slams:
        run(slam, drive, set(), by_distance(drive, lambda s, ids: seen_r(s, ids, drive.cov_z)))
    assert largest_difference(*slams) < EQUAL


def test_covariance_must_not_depend_on_the_landmark_in_the_world(drive: Any, largest_difference: Any) -> None:
    slams = pair(drive)
    for slam, world in zip(slams, (lifted_map, composed_map), strict=True):
        run(slam, drive, set(), by_distance(drive, lambda s, ids, f=world: f(s, ids, drive.cov_z)))
    assert largest_difference(*slams) > BROKEN


# --- gates --------------------------------------------------------------------------------------------


def gated(drive: Any, accept: Callable[[Any, Array, Array], bool]) -> Callable[[Any, Array, Array], None]:
    def update(slam: Any, ids: Array, z: Array) -> None:
        for j in range(len(ids)):
            if accept(slam, ids[j : j + 1], z[:, j : j + 1]):
                slam.update(ids[j : j + 1], z[:, j : j + 1], drive.cov_z)

    return update


def test_gate_through_innovation_and_s_keeps_the_equality(new_drive: Any, largest_difference: Any) -> None:
    drive = new_drive(batch=1)
    decisions: list[list[bool]] = [[], []]
    slams = pair(drive)
    for slam, taken in zip(slams, decisions, strict=True):

        def accept(s: Any, ids: Array, z: Array, taken: list[bool] = taken) -> bool:
            seen = copy.deepcopy(s).update(ids, z, drive.cov_z)
            nis = float(seen.innovation[0] @ np.linalg.solve(seen.S[0], seen.innovation[0]))
            taken.append(nis < 2.0)  # cuts often: the median of chi2(2) is 1.39
            return taken[-1]

        run(slam, drive, set(), gated(drive, accept))
    assert decisions[0] == decisions[1]
    assert {True, False} == set(decisions[0])
    assert largest_difference(*slams) < EQUAL


def test_gate_in_the_world_frame_breaks_it(new_drive: Any, largest_difference: Any) -> None:
    """|placed measurement - landmark| in world coordinates: the maps differ, so a gate can fall between.

    A first run accepts all and writes the distances down; the second rejects, at the sighting where they
    differ most, what lies beyond their middle.
    """
    drive = new_drive(batch=1)

    def distances(threshold: float, at: int) -> tuple[Any, list[list[float]]]:
        slams, found = pair(drive), ([], [])
        for slam, world, own in zip(slams, (lifted_map, composed_map), found, strict=True):

            def accept(s: Any, ids: Array, z: Array, world: Any = world, own: list[float] = own) -> bool:
                pose = s.pose().mean[0]
                zc = (z[0, 0, 0] + 1j * z[0, 0, 1]) * np.exp(1j * pose[2]) + pose[0] + 1j * pose[1]
                place = world(s, ids, drive.cov_z)[0, 0]
                own.append(float(np.hypot(zc.real - place[0], zc.imag - place[1])))
                return len(own) - 1 != at or own[-1] < threshold

            run(slam, drive, set(), gated(drive, accept))
        return slams, found

    slams, (a, b) = distances(np.inf, -1)
    assert largest_difference(*slams) < EQUAL
    at = int(np.argmax(np.abs(np.subtract(a, b))))
    slams, _ = distances((a[at] + b[at]) / 2, at)
    assert largest_difference(*slams) > BROKEN


# --- tampering with the lifted state ------------------------------------------------------------------


def project(slam: LiftedCarlemanEkf) -> None:
    """Put the lifted mean back on the manifold: the lift of its own (x, y, theta, x_i, y_i)."""
    slam.state()
    pose, places = slam.pose().mean, slam.landmarks().mean
    slam._z[:, :11] = lift.lift_vehicle(pose)
    slam._z[:, 11 : slam.size] = lift.lift_landmark(pose[:, None], places).reshape(len(pose), -1)


def renormalise_lifted(slam: LiftedCarlemanEkf) -> None:
    slam._z[:, 2:4] /= np.linalg.norm(slam._z[:, 2:4], axis=1, keepdims=True)


def renormalise_reduced(slam: ReducedCarlemanEkf) -> None:
    slam.blocks.x_p[:, 2:] /= np.linalg.norm(slam.blocks.x_p[:, 2:], axis=1, keepdims=True)


def jitter_lifted(slam: LiftedCarlemanEkf) -> None:
    slam.state()
    slam._P[:, : slam.size, : slam.size] += 1e-6 * np.eye(slam.size)


def jitter_reduced(slam: ReducedCarlemanEkf) -> None:
    state = slam.blocks.state
    state.P_pp[:] += 1e-6 * np.eye(4)
    state.P_mm[:] += 1e-6 * np.eye(state.P_mm.shape[1])


def nothing(slam: Any) -> None:
    pass


@pytest.mark.parametrize(
    ("to_lifted", "to_reduced", "equal"),
    [
        pytest.param(nothing, nothing, True, id="nothing"),
        pytest.param(project, nothing, False, id="projection"),
        pytest.param(project, renormalise_reduced, False, id="projection, reduced renormalised"),
        pytest.param(renormalise_lifted, nothing, False, id="renormalisation of one form"),
        pytest.param(
            renormalise_lifted, renormalise_reduced, True, id="renormalisation of both: s, c are kept"
        ),
        pytest.param(jitter_lifted, jitter_reduced, False, id="the same jitter on both"),
    ],
)
def test_tampering(
    drive: Any,
    largest_difference: Any,
    to_lifted: Callable[[Any], None],
    to_reduced: Callable[[Any], None],
    equal: bool,
) -> None:
    slams = pair(drive)
    for slam, tamper in zip(slams, (to_lifted, to_reduced), strict=True):
        known: set[int] = set()
        for step in drive.steps:
            slam.predict(step.increment)
            if len(step.ids):
                slam.update(step.ids, step.z, drive.cov_z)
                known |= set(step.ids.tolist())
                tamper(slam)
    off = largest_difference(*slams)
    assert off < EQUAL if equal else off > BROKEN


def test_debiased_polar_measurements_keep_the_equality(drive: Any, largest_difference: Any) -> None:
    """Range and bearing, converted with a covariance of the *measurement* only: one per landmark and step."""

    def converted(slam: Any, ids: Array, z: Array) -> None:
        zc = z.mean(0)
        reach, bearing = np.linalg.norm(zc, axis=1), np.arctan2(zc[:, 1], zc[:, 0])
        ahead = np.stack([np.cos(bearing), np.sin(bearing)], -1)
        across = np.stack([-ahead[:, 1], ahead[:, 0]], -1)
        cov = 0.01 * ahead[:, :, None] * ahead[:, None] + (0.02 * reach[:, None, None]) ** 2 * (
            across[:, :, None] * across[:, None]
        )
        slam.update(ids, z * np.exp(0.02**2 / 2), cov)

    slams = pair(drive)
    for slam in slams:
        run(slam, drive, set(), converted)
    assert largest_difference(*slams) < EQUAL

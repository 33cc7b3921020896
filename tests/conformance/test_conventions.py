"""A program with conventions of its own passes when it declares them."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vslam_ref.conformance.catalogue import Function
from vslam_ref.conformance.conventions import Convention, read
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Pinhole, projection
from vslam_ref.testing import check_jacobian

JACOBIAN = Function(
    "camera.jacobian_pose", 3, {"pose": "pose", "X_world": "plain"}, {"J": "pose_jacobian"}, ""
)
COVARIANCE = Function("x.y", 3, {"pose": "pose", "P": "pose_covariance"}, {"P": "pose_covariance"}, "")
PARAMS, X = np.array([480.0, 500, 320, 240]), np.array([0.3, -0.4, 5.0])
POSE = se3.exp([0.3, -0.2, 0.5, 0.4, -0.3, 0.2])
SWAP = [3, 4, 5, 0, 1, 2]
EVERY = list(
    itertools.product(
        ("cam_from_world", "world_from_cam"), ("left", "right"), ("translation_first", "rotation_first")
    )
)


def programs_pixel(convention: Convention, pose: np.ndarray, eta: np.ndarray) -> np.ndarray:
    """Pixel after the program's own step: its pose, its side, its order."""
    xi = eta[SWAP] if convention.tangent_order == "rotation_first" else eta
    step = se3.exp(xi)
    moved = step @ pose if convention.perturbation == "left" else pose @ step
    T_cam_world = se3.inverse(moved) if convention.transform == "world_from_cam" else moved
    return projection.pixel_from_world(PARAMS, T_cam_world, X, lens=Pinhole.lens).uv


@pytest.mark.parametrize(("transform", "side", "order"), EVERY)
def test_jacobians_of_every_convention_come_home(transform: Any, side: Any, order: Any) -> None:
    """The program's Jacobian is checked by differences in its own step, and turned into the house's."""
    convention = Convention(transform, side, order)
    inputs = {"pose": POSE.tolist(), "X_world": X.tolist()}
    sent = convention.inputs(JACOBIAN, inputs)
    pose = np.array(sent["pose"])
    assert np.abs(pose - (se3.inverse(POSE) if transform == "world_from_cam" else POSE)).max() < 1e-15
    house = projection.pixel_from_world_with_jacobians(PARAMS, POSE, X, lens=Pinhole.lens).J_pose
    theirs = np.array(convention.converted("pose_jacobian", house.tolist(), inputs))
    check_jacobian(lambda eta: programs_pixel(convention, pose, eta), np.zeros(6), theirs, method="central")
    home = convention.outputs(JACOBIAN, {"J": theirs.tolist()}, inputs)["J"]
    assert np.abs(np.array(home) - house).max() < 1e-11


@pytest.mark.parametrize(("transform", "side", "order"), EVERY)
def test_covariances_of_every_convention_come_home(transform: Any, side: Any, order: Any) -> None:
    """J P J^T, the covariance of a pixel, is the same in every convention; and back is back."""
    convention = Convention(transform, side, order)
    rng = np.random.default_rng(1)
    A = rng.standard_normal((6, 6))
    inputs = {"pose": POSE.tolist(), "P": (A @ A.T).tolist(), "X_world": X.tolist()}
    theirs = np.array(convention.inputs(COVARIANCE, inputs)["P"])
    house = projection.pixel_from_world_with_jacobians(PARAMS, POSE, X, lens=Pinhole.lens).J_pose
    J = np.array(convention.converted("pose_jacobian", house.tolist(), inputs))
    assert np.allclose(J @ theirs @ J.T, house @ A @ A.T @ house.T, rtol=1e-12)
    home = convention.outputs(COVARIANCE, {"P": theirs.tolist()}, inputs)["P"]
    assert np.allclose(home, A @ A.T, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("convention", "kind", "house", "program"),
    [
        (Convention(quaternion_order="xyzw"), "quaternion", [1, 2, 3, 4], [2, 3, 4, 1]),
        (Convention(tangent_order="rotation_first"), "tangent", [1, 2, 3, 4, 5, 6], [4, 5, 6, 1, 2, 3]),
        (
            Convention(tangent_order="rotation_first"),
            "tangent_sim3",
            [1, 2, 3, 4, 5, 6, 7],
            [4, 5, 6, 1, 2, 3, 7],
        ),
        (Convention(pixel_origin="corner"), "pixel", [10.0, 20.0], [10.5, 20.5]),
        (
            Convention(pixel_origin="corner"),
            "intrinsics",
            [500, 500, 320, 240, 0.9],
            [500, 500, 320.5, 240.5, 0.9],
        ),
        (Convention(residual="measured_minus_predicted"), "residual", [1.0, -2.0], [-1.0, 2.0]),
        (Convention(), "quaternion", [1, 2, 3, 4], [1, 2, 3, 4]),
        (Convention("world_from_cam"), "motion", np.eye(4).tolist(), np.eye(4).tolist()),
    ],
)
def test_there_and_back(convention: Convention, kind: str, house: Any, program: Any) -> None:
    assert np.array_equal(convention.converted(kind, house, {}), program)
    assert np.array_equal(convention.converted(kind, program, {}, home=True), house)


def test_tangent_matrices_are_permuted_on_both_sides() -> None:
    """Ad T in the other order acts as in ours."""
    convention = Convention(tangent_order="rotation_first")
    A = se3.adjoint(POSE)
    theirs = np.array(convention.converted("tangent_matrix", A.tolist(), {}))
    xi = np.arange(6.0)
    assert np.allclose(theirs @ xi[SWAP], (A @ xi)[SWAP])
    assert np.array_equal(convention.converted("tangent_matrix", theirs.tolist(), {}, home=True), A)


def test_convention_files(tmp_path: Path) -> None:
    path = tmp_path / "mine.json"
    path.write_text(json.dumps({"transform": "world_from_cam", "perturbation": "right"}))
    assert read(path) == Convention("world_from_cam", "right")
    for text, told in (
        ("{", "not JSON"),
        ("[]", "need an object"),
        ('{"transfrom": "x"}', "unknown convention 'transfrom'"),
        ('{"transform": "backwards"}', "expected cam_from_world or world_from_cam"),
    ):
        path.write_text(text)
        with pytest.raises(ValueError, match=told) as caught:
            read(path)
        assert str(path) in str(caught.value)

"""The worlds and measures of the PTAM experiments are what they say."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vslam_ref import cli
from vslam_ref.experiments.framework import load
from vslam_ref.experiments.ptam import fig2_3, passes, wrong_matches
from vslam_ref.experiments.ptam.passes import PassesConfig
from vslam_ref.experiments.ptam.recorded import open_recorded, recorded
from vslam_ref.experiments.ptam.turning_runs import TurningConfig, new_ground, path
from vslam_ref.experiments.ptam.wrong_matches import WrongMatchesConfig, displacement
from vslam_ref.experiments.visual_slam.overlay import Stage
from vslam_ref.features import level_from_finest
from vslam_ref.geometry import se3
from vslam_ref.geometry.alignment import Alignment
from vslam_ref.geometry.camera_pose import centre_from_pose
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.metrics.trajectory import Trajectory
from vslam_ref.systems.ptam.look import prepare
from vslam_ref.systems.ptam.settings import FeatureSettings
from vslam_ref.systems.visual_map import VisualMap
from vslam_ref.worlds.rendered import scene


def still(t: Any) -> Any:
    return np.zeros((*np.shape(t), 6))


@pytest.mark.parametrize("arm", [0.0, 0.3])
def test_the_turn_keeps_its_arm(arm: float) -> None:
    """All places of the turn are ``arm`` from one point; the whole way round is what was asked."""
    config = TurningConfig()
    t = np.linspace(config.moving / 30, (config.moving + config.turning) / 30, 50)
    T = path(config, arm, still)(t)
    centres = centre_from_pose(T)
    axis = T[:, 2, :3]  # the direction in which the camera looks, in the world
    pivot = centres - arm * axis
    np.testing.assert_allclose(pivot, np.broadcast_to(pivot[0], pivot.shape), atol=1e-12)
    R = T[-1, :3, :3] @ T[0, :3, :3].T
    turned = np.degrees(np.arccos((np.trace(R) - 1) / 2))
    assert turned == pytest.approx(config.turn, abs=1e-9)
    assert np.allclose(centre_from_pose(path(config, arm, still)(t[0] - 1e-9)), centres[0], atol=1e-6)


def test_the_prediction_is_as_far_off_as_asked() -> None:
    config = WrongMatchesConfig()
    rng = np.random.default_rng(3)
    X = np.column_stack([rng.uniform(-1, 1, (200, 2)), rng.uniform(2, 4, 200)])
    off = [displacement(wrong_matches._prediction(config, X, rng), np.eye(4), X) for _ in range(20)]
    np.testing.assert_allclose(off, config.off, rtol=0.02)  # four steps of a secant on a smooth function


def test_displacement_is_that_of_the_picture() -> None:
    """A turn about the optical axis by a small angle moves a point by its radius times the angle."""
    X = np.array([[0.5, 0.0, 1.0], [0.0, 0.5, 1.0]])
    moved = displacement(se3.exp(np.array([0, 0, 0, 0, 0, 1e-4])), np.eye(4), X)
    assert moved == pytest.approx(0.5 * 520 * 1e-4, rel=1e-6)


def test_comparisons_are_counted_one_by_one() -> None:
    rng = np.random.default_rng(0)
    picture = prepare(0, rng.integers(0, 256, (120, 160)).astype(np.uint8), FeatureSettings())
    uv, level = rng.uniform(10, 100, (30, 2)), rng.integers(0, 3, 30)
    done = SimpleNamespace(seen=SimpleNamespace(uv=uv, level=level))
    slow = 0
    for place, k in zip(uv, level, strict=True):
        at = level_from_finest(place, int(k))
        slow += int((np.hypot(*(picture.corners[k].xy - at).T) <= 9.0 / 2**k).sum())
    assert passes.comparisons(done, picture, 9.0) == slow > 100  # type: ignore[arg-type]


def test_a_jump_moves_the_middle_by_so_many_pixels() -> None:
    made = scene("desk", 3, frames=1)
    for size in PassesConfig().pixels:
        turn = passes._turn(made, size, np.random.default_rng(1))
        middle = made.camera.unproject(np.array([319.5, 239.5])).bearing
        uv = made.camera.project(turn[:3, :3] @ middle).uv
        assert np.hypot(*(uv - [319.5, 239.5])) == pytest.approx(size, abs=1e-9)


@pytest.mark.parametrize("tilt", [0.0, 3.0])
def test_plane_error_is_the_angle_and_the_height(tilt: float) -> None:
    """A map in another frame and scale; its plane lies tilted, 10 mm over the desk."""
    S = Alignment(0.5, np.eye(3)[[1, 2, 0]], np.array([0.3, -0.2, 0.1]), 0.0, "", True)
    c, s = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
    R_world_plane = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    origin = np.array([0.1, 0.4, 0.01])
    R_map_plane = S.R_target_source.T @ R_world_plane
    t_map_plane = S.R_target_source.T @ (origin - S.t_target_source) / S.scale
    stage = Stage(se3.inverse(se3.from_rt(R_map_plane, t_map_plane)), 0.1)
    np.testing.assert_allclose(fig2_3.plane_error(stage, S), [tilt, 0.01], atol=1e-6)


def test_a_house_drawn_with_true_poses_does_not_slip() -> None:
    """And one whose poses tremble by a milliradian slips by half a pixel, 520 px times 1e-3."""
    rng = np.random.default_rng(2)
    made = scene("desk", 3, frames=30)
    T = made.T_cam_world
    shaken = se3.exp(np.concatenate([np.zeros((30, 3)), 1e-3 * rng.standard_normal((30, 3))], 1)) @ T
    trajectory = made.trajectory()
    stage = Stage(se3.from_rt(np.eye(3), np.array([0.0, -0.4, 0.0])), 0.05)
    slip = []
    for poses in (T, shaken):
        system = SimpleNamespace(trajectory=lambda poses=poses: (np.arange(30), poses))
        sequence = SimpleNamespace(truth=Trajectory(*trajectory_parts(trajectory)), camera=made.camera)
        slip.append(fig2_3.slips(SimpleNamespace(sequence=sequence, system=system), stage))  # type: ignore[arg-type]
    assert slip[0].shape == (4, 30)
    assert slip[0].max() < 1e-6
    assert 0.2 < np.sqrt(np.mean(slip[1] ** 2)) < 1.5


def trajectory_parts(trajectory: Trajectory) -> tuple[Any, Any, Any]:
    return trajectory.times, trajectory.t_world_body, trajectory.R_world_body


def test_new_ground_is_outside_of_all_old_pictures() -> None:
    visual_map = VisualMap(Pinhole(100.0, 100.0, 49.5, 49.5), (100, 100), 1)
    grey = prepare(0, np.zeros((100, 100), np.uint8), FeatureSettings(levels=1))
    visual_map.add_keyframe(np.eye(4), grey)
    visual_map.add_points(
        np.array([[0, 0, 1.0], [0.4, 0, 1.0], [0.6, 0, 1.0], [0, 0, -1.0]]), 0, 0, np.zeros((4, 2))
    )
    assert new_ground(visual_map, 1) == 2  # one aside, one behind


def test_scenes_are_their_seeds() -> None:
    desk = recorded()["desk"]
    a, b = open_recorded(desk, 101, 2), open_recorded(desk, 102, 2)
    assert len(a) == 2
    assert a.truth is not None
    assert not np.array_equal(a.image(0).grey, b.image(0).grey)


def test_a_small_study_writes_its_files(tmp_path: Any, capsys: Any) -> None:
    arguments = ["ptam-tukey", "--runs", "3", "--jobs", "1", "--out", str(tmp_path / "out")]
    assert cli.main(["reproduce", *arguments]) == 0
    assert "ptam-tukey/least-squares-follows-them" in capsys.readouterr().out
    first = (tmp_path / "out" / "ptam-tukey" / "runs.npz").read_bytes()
    assert cli.main(["reproduce", *arguments]) == 0
    assert (tmp_path / "out" / "ptam-tukey" / "runs.npz").read_bytes() == first


@pytest.mark.slow
@pytest.mark.parametrize(
    "id", ["ptam-coarse-to-fine", "ptam-fig2.2", "ptam-fig2.3", "ptam-rotation", "ptam-scenes"]
)
def test_quick_runs(id: str, tmp_path: Any) -> None:
    assert cli.main(["reproduce", id, "--quick", "--jobs", "1", "--out", str(tmp_path / "out")]) == 0
    assert sorted(p.name for p in (tmp_path / "out" / id).iterdir()) == [
        "figure.png", "figure.svg", "result.json", "runs.npz",
    ]  # fmt: skip


def test_all_calls_what_lacks_data_not_run(
    tmp_path: Any, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With --all it is told and the status is 0; asked for by name it is an error."""
    from vslam_ref.experiments import registry

    monkeypatch.delenv("VSLAM_REF_DATA", raising=False)
    only = [s for s in registry.summaries() if s.id == "ptam-offsets"]
    monkeypatch.setattr(registry, "summaries", lambda: only)
    target = tmp_path / "numbers.json"
    assert cli.main(["reproduce", "--all", "--out", str(tmp_path / "out"), "--json", str(target)]) == 0
    out = capsys.readouterr().out
    assert "not run         ptam-offsets: needs the data sets 7scenes_redkitchen, new_tsukuba_150" in out
    assert "1 experiment not run" in out
    assert '"missing"' in target.read_text()
    assert cli.main(["reproduce", "ptam-offsets", "--out", str(tmp_path / "out")]) == 2
    assert "needs the data sets" in capsys.readouterr().err
    assert load("ptam-offsets").id == "ptam-offsets"

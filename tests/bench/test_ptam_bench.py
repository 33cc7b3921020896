"""The parts of ``bench ptam`` do what their names say; times are not asserted."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.bench import ptam
from vslam_ref.estimation.pose_tracking import track_pose
from vslam_ref.systems.ptam import STAGES, PictureOutcome, Ptam
from vslam_ref.worlds.rendered import scene


def test_the_mappers_stages_are_stages() -> None:
    assert set(ptam.MAPPER) < set(STAGES)


def test_the_pose_that_is_timed_is_found() -> None:
    """The guess is off by centimetres; noise of 0.5 px in 1000 points moves the answer by 0.2 mm or so."""
    given = ptam.sighted()
    assert np.abs(given.T_guess - np.eye(4)).max() > 0.005
    found = track_pose(given.camera, given.X_world, given.uv, given.T_guess)
    error = np.abs(found.T_cam_world - np.eye(4)).max()
    assert error < 6 * np.sqrt(np.diag(found.cov_pose)).max()


def test_only_pictures_with_a_map_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """Five pictures before there is a map, then two, of which one is a keyframe; stages are made up."""
    world = scene("desk", 3, size=(320, 240), frames=180)
    shown = [world.frame(4 * k) for k in range(12)]
    system = Ptam(world.camera)
    true = [system.step(k, picture) for k, picture in enumerate(shown)]
    tracked = [o for o in true if o.tracked is not None]
    assert 0 < len(tracked) < len(shown)

    def step(self: Ptam, number: int, grey: object) -> PictureOutcome:
        mapped = true[number].mapped
        return true[number]._replace(mapped=mapped, stages={"prepare": 1.0, "rest": 2.0, "local": 4.0})

    monkeypatch.setattr(Ptam, "step", step)
    times = ptam.timed(ptam.FilmedPlace("desk", world.camera, shown))
    assert times.tracking.tolist() == [3.0] * len(tracked)
    assert times.mapping.tolist() == [4.0] * len(tracked)
    assert times.tried.tolist() == [len(o.tracked.fine.seen.point) for o in tracked if o.tracked]
    assert times.keyframes == sum(o.mapped is not None for o in tracked)

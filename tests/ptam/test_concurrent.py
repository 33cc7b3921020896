"""The mapper in a thread of its own: the same bounds, nothing lost between the threads, no way to hang."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from vslam_ref.geometry import camera_pose, se3
from vslam_ref.geometry.alignment import align
from vslam_ref.systems.ptam import ConcurrentPtam, Quality, Settings, concurrent
from vslam_ref.worlds.rendered import scene

from .conftest import Film, Run
from .test_system import LARGEST_SHARE, path_error

PATIENCE = 60.0
"""Seconds after which something hangs."""


def mappers() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == "mapper"]


@pytest.fixture(autouse=True)
def nothing_is_left_running() -> Iterator[None]:
    """Every test ends with all mappers ended."""
    yield
    assert mappers() == []


def settings(**mapper: Any) -> Settings:
    return replace(Settings(), mapper=replace(Settings().mapper, **mapper))


def begun(film: Film, made: Settings | None = None) -> tuple[ConcurrentPtam, int]:
    """A system that has just started, and the number of its next picture."""
    system = ConcurrentPtam(film.camera, made or Settings())
    for k, grey in enumerate(film.pictures):
        system.step(k, grey)
        if system.map is not None:
            return system, k + 1
    raise AssertionError("no start")


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Iterator[threading.Event]:
    """The mapper waits at every keyframe until this is set."""
    event, real = threading.Event(), concurrent.map_keyframe

    def slowly(*arguments: Any) -> Any:
        assert event.wait(PATIENCE)
        return real(*arguments)

    monkeypatch.setattr(concurrent, "map_keyframe", slowly)
    yield event
    event.set()


def test_forty_pictures_within_the_bounds_of_the_interleaved_form() -> None:
    world = scene("desk", 3, frames=160)
    large = Film([world.frame(k) for k in range(0, 160, 4)], world.camera, world.T_cam_world[::4])
    system = ConcurrentPtam(large.camera)
    outcomes = [system.step(k, grey) for k, grey in enumerate(large.pictures)]
    system.finish()
    assert system.trajectory()[0].tolist() == list(range(40))
    assert path_error(large, Run(system, outcomes)) < LARGEST_SHARE
    handed = [o.number for o in outcomes if o.queued]
    assert len(handed) >= 3
    assert system.map is not None
    assert system.map.keyframes["frame"].tolist() == [*system.started_at, *handed]  # type: ignore[misc]
    assert sorted(system.mapping_stages) == handed
    assert all(stages["local"] > 0 for stages in system.mapping_stages.values())


def test_no_count_is_lost_between_the_threads(film: Film) -> None:
    """What the map has been told of looks is what the tracker looked for up to the last keyframe, exactly."""
    system = ConcurrentPtam(film.camera)
    outcomes = [system.step(k, grey) for k, grey in enumerate(film.pictures[:40])]
    system.finish()
    last = max(o.number for o in outcomes if o.queued)
    assert system.map is not None
    tried = np.zeros(len(system.map.points), np.int64)
    found = tried.copy()
    for outcome in outcomes:
        tracked = outcome.tracked
        if tracked is not None and tracked.quality is not Quality.LOST and outcome.number <= last:
            tried[tracked.fine.seen.point] += 1
            found[tracked.fine.seen.point[tracked.fine.weights > 0]] += 1
    assert tried.sum() > 1000
    assert np.array_equal(system.map.points["tried"], tried)
    assert np.array_equal(system.map.points["found"], found)


def test_the_shown_map_stays_as_it_is_while_the_mapper_works(film: Film) -> None:
    system, number = begun(film)
    shown = system.shown
    assert shown is not None

    def bytes_of() -> list[bytes]:
        tables = (shown.keyframes, shown.points, shown.sightings)  # type: ignore[union-attr]
        return [table[name].tobytes() for table in tables for name in table._room]

    before = bytes_of()
    for k in range(number, number + 12):
        system.step(k, film.pictures[k])
    system.finish()
    assert system.map is not None
    assert len(system.map.keyframes) > 2
    assert bytes_of() == before
    assert len(shown.keyframes) == len(shown.corners) == len(shown.small) == 2


def test_a_pose_is_carried_over_by_its_reference_keyframe(film: Film) -> None:
    system, _ = begun(film)
    assert system.tracker is not None
    assert system.map is not None
    system.close()
    before, now = system.map.snapshot(), system.map.snapshot()
    moved = se3.exp([0.1, -0.2, 0.05, 0.02, 0.3, -0.1])
    now.T_kf_world[:] = se3.compose(now.T_kf_world, moved)  # the world was moved: what is seen stays
    T = se3.compose(se3.exp([0.01, 0.0, 0.02, 0.0, 0.01, 0.0]), before.T_kf_world[1])
    system.tracker.T_last = T
    system._carry_over(before, now)
    np.testing.assert_allclose(system.tracker.T_last, se3.compose(T, moved), atol=1e-12)


def test_a_keyframe_is_placed_where_its_reference_has_gone(film: Film) -> None:
    system, number = begun(film)
    system.close()
    visual_map = system.map
    assert visual_map is not None
    assert system.tracker is not None
    tracked = system.tracker.track(visual_map, concurrent_picture(film, number))
    T_cam_kf = se3.compose(tracked.T_cam_world, se3.inverse(visual_map.T_kf_world[1]))
    moved = se3.exp([0.1, -0.2, 0.05, 0.02, 0.3, -0.1])
    visual_map.T_kf_world[:] = se3.compose(visual_map.T_kf_world, moved)
    visual_map.X_world[:] = se3.act(se3.inverse(moved), visual_map.X_world)
    none = np.zeros(0, np.int64)
    assert system.tracker.known is not None
    handed = concurrent.Handed(
        concurrent_picture(film, number), 1, T_cam_kf, system.tracker.known, none, none
    )
    mapped = concurrent.take_in(visual_map, handed, Settings())
    want = se3.compose(tracked.T_cam_world, moved)
    # it was adjusted by a little; without the reference it would be off by 0.2
    assert np.abs(visual_map.T_kf_world[mapped.kf] - want).max() < 0.02


def concurrent_picture(film: Film, number: int) -> Any:
    from vslam_ref.systems.ptam.look import prepare

    return prepare(number, film.pictures[number], Settings().features)


def test_an_exception_of_the_mapper_comes_out_at_the_next_picture(
    film: Film, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: Any) -> Any:
        raise ZeroDivisionError("of the mapper")

    monkeypatch.setattr(concurrent, "map_keyframe", broken)
    system, number = begun(film)
    last = number

    def go_on() -> None:
        nonlocal last
        for last in range(number, len(film.pictures)):
            system.step(last, film.pictures[last])

    with pytest.raises(ZeroDivisionError, match="of the mapper"):
        go_on()
    with pytest.raises(ZeroDivisionError, match="of the mapper"):
        system.finish()
    system.close()
    assert last < len(film.pictures) - 1
    assert len(system.poses) >= last  # poses so far are there


def test_the_tracker_waits_for_a_mapper_that_is_too_late(film: Film, gate: threading.Event) -> None:
    """With a mapper that stands still, pictures pass until ``lag`` of them came after the keyframe."""
    system, number = begun(film, settings(lag=2, queue=2))
    outcomes: list[Any] = []

    def show() -> None:
        for k in range(number, len(film.pictures)):
            outcomes.append(system.step(k, film.pictures[k]))

    thread = threading.Thread(target=show)
    thread.start()
    assert until(lambda: any(o.queued for o in outcomes))
    first = next(o.number for o in outcomes if o.queued)
    assert until(lambda: outcomes[-1].number == first + 2)
    thread.join(0.5)
    assert thread.is_alive()
    assert outcomes[-1].number == first + 2
    gate.set()
    thread.join(PATIENCE)
    assert not thread.is_alive()
    system.finish()
    assert len(system.poses) == len(film.pictures)


def until(holds: Callable[[], bool]) -> bool:
    """Wait until something holds; False if it never does."""
    wait = threading.Event()
    return any(holds() or wait.wait(0.01) for _ in range(int(100 * PATIENCE)))


def test_closing_leaves_out_what_still_waits(film: Film, gate: threading.Event) -> None:
    system, number = begun(film, settings(lag=100, queue=5))
    for k in range(number, len(film.pictures)):
        system.step(k, film.pictures[k])
        if len(system.handed_at) >= 2:
            break
    assert system.mapper is not None
    assert system.mapper.unfinished() >= 2
    closer = threading.Thread(target=system.close)
    closer.start()
    gate.set()
    closer.join(PATIENCE)
    assert not closer.is_alive()
    assert system.map is not None
    assert len(system.map.keyframes) == 3  # the one at hand, and none of the others
    system.close()  # twice does no harm


def test_without_a_start_there_is_no_thread(film: Film) -> None:
    system = ConcurrentPtam(film.camera)
    system.step(0, film.pictures[0])
    assert mappers() == []
    system.finish()
    system.close()
    assert system.map is None


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_twenty_runs_over_whole_desks(seed: int) -> None:
    """Five runs over each of four desks, 600 pictures of 640 x 480, in the bounds of the interleaved form.

    In the first, pictures come as fast as they are taken; in the others at random moments, up to 50 ms apart,
    so that the threads meet differently each time.
    ``pytest -m slow tests/ptam/test_concurrent.py -n 1``: twenty minutes.
    """
    rng = np.random.default_rng(seed)
    world = scene("desk", seed)
    pictures = [world.frame(k) for k in range(len(world))]
    for again in range(5):
        system = ConcurrentPtam(world.camera)
        for k, grey in enumerate(pictures):
            time.sleep(rng.uniform(0.0, 0.05) if again else 0.0)
            system.step(k, grey)
        system.finish()
        numbers, T = system.trajectory()
        assert system.started_at is not None
        assert len(numbers) >= 0.99 * (len(world) - system.started_at[0])
        true = camera_pose.centre_from_pose(world.T_cam_world[numbers])
        fit = align(camera_pose.centre_from_pose(T), true, with_scale=True)
        length = float(np.linalg.norm(np.diff(true, axis=0), axis=1).sum())
        print(f"seed {seed}: {len(numbers)} poses, error {fit.rmse / length:.5f} of the path")
        assert fit.rmse < LARGEST_SHARE * length

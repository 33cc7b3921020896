"""The system in plain loops, and the one that runs: the same start, the same rules, the same path."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from vslam_ref.arrays import Array
from vslam_ref.estimation.bundle import Options, Robust, bundle_adjust, covariance
from vslam_ref.estimation.bundle.gauge import fix_gauge
from vslam_ref.estimation.bundle.problem import BundleProblem
from vslam_ref.estimation.robust import tuned
from vslam_ref.features import View, follow
from vslam_ref.geometry import camera_pose, se3
from vslam_ref.geometry.alignment import align
from vslam_ref.systems.ptam import Settings, book
from vslam_ref.systems.ptam.look import prepare, strong_corners
from vslam_ref.systems.ptam.mapper import new_points
from vslam_ref.systems.visual_map import VisualMap
from vslam_ref.systems.visual_map import book as plain_maps
from vslam_ref.systems.visual_map.adjusting import as_problem
from vslam_ref.systems.visual_map.starting import missing
from vslam_ref.worlds.rendered import scene

from .conftest import Film, Run, run

PICTURES = 15


@pytest.fixture(scope="module")
def plain(film: Film) -> book.BookRun:
    """Fifteen pictures in plain loops, begun with 0 and 7: ten seconds, the only whole run of the book."""
    pictures = [prepare(k, film.pictures[k], book.S.features) for k in range(PICTURES)]
    done = book.run(film.camera, pictures, 7, np.random.default_rng(0))
    assert not isinstance(done, str)
    return done


def spread(problem: BundleProblem) -> float:
    """Root mean square deviation that a map's centres of keyframes should have from the truth, own unit.

    In the gauge of the first keyframe and one more coordinate.  Centres after the best similarity deviate
    less, since it is chosen for that.
    """
    robust = Robust(tuned("tukey", 2), "adaptive", 0.4)
    done = bundle_adjust(fix_gauge(problem), robust, Options(max_iterations=30))
    found = covariance(done, views=range(problem.sizes[0]))
    assert found.view is not None, found.reason
    return float(np.sqrt(np.mean([np.trace(cov[:3, :3]) for cov in found.view])))


def centres(T: Array) -> Array:
    return np.asarray(camera_pose.centre_from_pose(T))


def test_the_path_is_the_true_one_and_that_of_the_system(film: Film, plain: book.BookRun) -> None:
    """Twice the deviation that the errors of the sightings explain, in metres.

    The deviations come from three directions or more, and a mean square of three standard numbers is above
    4 with a probability of 0.7 %.  Both use the same pictures, so that their errors are alike, if anything.
    """
    assert set(plain.words.values()) == {"good"}
    assert sorted(plain.path) == [0, *range(7, PICTURES)]
    T = np.stack([plain.path[k] for k in sorted(plain.path)])
    true = centres(film.T_cam_world[sorted(plain.path)])
    own = align(centres(T), true, with_scale=True)
    sightings = sorted(plain.map.sightings)
    moving = set(range(1, len(plain.map.poses)))
    sigma = own.scale * spread(plain_maps.problem(plain.map, sightings, moving, 1.0))
    assert own.rmse < 2 * sigma < 0.03 * np.linalg.norm(true[-1] - true[0])
    system = run(film, film.pictures[:PICTURES]).system
    numbers, T_fast = system.trajectory()
    T_fast = T_fast[np.isin(numbers, sorted(plain.path))]
    to_true = align(centres(T_fast), true, with_scale=True)
    assert system.map is not None
    both = np.hypot(sigma, to_true.scale * spread(as_problem(system.map).problem))
    apart = align(centres(T), to_true.scale * centres(T_fast), with_scale=True).rmse
    assert apart < 2 * both


def test_poses_turn_as_the_camera_did(film: Film, plain: book.BookRun) -> None:
    """From the first to the last picture, to half a degree: 0.5 px of 256 are 0.1, and a start is vague."""
    last = PICTURES - 1
    true = se3.compose(film.T_cam_world[last], se3.inverse(film.T_cam_world[0]))
    turn = se3.log(se3.compose(plain.path[last], se3.inverse(true)))[3:]
    assert np.degrees(np.linalg.norm(turn)) < 0.5
    assert np.degrees(np.linalg.norm(se3.log(true)[3:])) > 2


def test_a_keyframe_was_made_and_the_map_is_whole(plain: book.BookRun) -> None:
    made = plain.map
    assert len(made.poses) >= 3
    assert np.array_equal(plain.path[0], np.eye(4))
    assert np.median([X[2] for X in made.X.values()]) == pytest.approx(1.0, abs=0.15)
    for p in made.X:
        own = [at for (_, q), at in made.sightings.items() if q == p]
        assert len(own) >= 2
        assert sum(at.first for at in own) == 1
    assert {p for _, p in made.sightings} == set(made.X)


def test_what_is_no_start() -> None:
    """The same answer as the system's, for every combination of what it asks."""
    s, rng = Settings().start, np.random.default_rng(2)
    answers = []
    for angle, count, cost in itertools.product((0.5, 0.9), (20, 80), (0.2, 0.3)):
        parallax = np.concatenate(
            [rng.uniform(0.9, 1.1, 2) * angle, np.full(count, 1.2 if angle > 0.7 else 0.6)]
        )
        parallax = np.concatenate([parallax, np.full(10, angle)])
        wide = int((parallax >= s.wide_parallax).sum())
        told = missing(float(np.median(parallax)), wide, cost, s)
        mine = book.missing(parallax.tolist(), cost, s)
        assert (told == "") == (mine == "")
        answers.append(mine)
    assert len(set(answers)) == 4


def test_a_camera_that_only_turns_does_not_start() -> None:
    world = scene("rotation", 2, size=(320, 240), frames=18)
    pictures = [prepare(k, world.frame(k), book.S.features) for k in range(0, 18, 4)]
    told = book.begin(world.camera, pictures, np.random.default_rng(0))
    assert told == "too few points have parallax"


def test_trails_are_found_back(film: Film) -> None:
    """From picture to picture the loops keep what the fast way keeps, at the same places, and no more.

    The fast way does not compare once more after the refinement, so it may keep a few others.
    """
    first, second = (prepare(k, film.pictures[k], book.S.features) for k in (0, 2))
    corners = book.corners_of(first, 0, strong_corners(first, 0, book.S.features)[:150])
    went = follow(
        View(first.levels[0], first.corners[0]),
        View(second.levels[0], second.corners[0]),
        np.array(corners, float),
        2.0 * book.S.start.search_radius,  # their speed is not known
    )
    places = [book.trail([first, second], c) for c in corners]
    kept = np.array([u is not None for u in places])
    assert not (kept & ~went.ok).any()
    assert 20 < kept.sum() < len(kept)
    assert (went.ok & ~kept).sum() <= 0.1 * kept.sum()
    own = np.array([u for u in places if u is not None])
    assert np.abs(own - went.uv[kept]).max() < 0.02  # both end with steps below a hundredth of a pixel


def as_plain(made: VisualMap) -> plain_maps.BookMap:
    """The same map in dictionaries, without pictures."""
    found = plain_maps.BookMap(made.camera, list(made.T_kf_world))
    table, seen = made.points, made.sightings
    found.tried, found.found = (dict(enumerate(table[name].tolist())) for name in ("tried", "found"))
    found.X = {p: table["X_world"][p] for p in np.flatnonzero(table["alive"]).tolist()}
    for row in np.flatnonzero(seen["on"]):
        kf, p = int(seen["kf"][row]), int(seen["point"][row])
        first = kf == table["source_kf"][p]
        found.sightings[kf, p] = plain_maps.BookSighting(
            seen["uv"][row], int(seen["level"][row]), bool(first)
        )
    return found


def test_partners_and_depths(desk: Run) -> None:
    """Also where a keyframe stands so near to another that there is no base line between them."""
    made = desk.system.map
    assert made is not None
    kept = made.T_kf_world.copy()
    for kf in range(1, len(made.keyframes)):
        mine = as_plain(made)
        assert mine.depth(kf) == pytest.approx(new_points.median_depth(made, kf), rel=1e-12)
        nearest = book.partner(mine, kf)
        assert nearest == new_points.partners(made, kf, 1)[0]
        made.T_kf_world[nearest] = se3.perturb(kept[kf], [0.003, 0, 0, 0, 0, 0])
        another = book.partner(as_plain(made), kf)
        assert another == new_points.partners(made, kf, 1)[0]
        made.T_kf_world[:] = kept
        assert another != nearest


def test_what_ends_with_a_sighting(film: Film) -> None:
    """Sightings taken back in any order: the same points die, and the same sightings go with them."""
    system = run(film, film.pictures[:25]).system
    made = system.map
    assert made is not None
    mine = as_plain(made)
    rows = np.random.default_rng(5).permutation(np.flatnonzero(made.sightings["on"]))[:200]
    for row in rows:
        kf, p = int(made.sightings["kf"][row]), int(made.sightings["point"][row])
        if (kf, p) in mine.sightings:
            mine.take_back(kf, p)
            made.take_back(np.array([row]))
    assert set(mine.X) == set(np.flatnonzero(made.alive).tolist())
    on = np.flatnonzero(made.sightings["on"])
    assert set(mine.sightings) == {
        (int(k), int(p)) for k, p in zip(made.sightings["kf"][on], made.sightings["point"][on], strict=True)
    }


def test_a_match_with_depth_is_a_point(film: Film) -> None:
    """Exact sightings of exact points give these; without parallax, or behind a camera, there is none."""
    T = np.stack([np.eye(4), se3.exp([-0.1, 0.02, 0.03, 0.02, -0.05, 0.01])])
    made = plain_maps.BookMap(film.camera, list(T))
    for X in np.array([[0.1, 0.1, 1.0], [-0.2, 0.1, 3.0], [0.3, -0.2, 2.0]]):
        uv = [film.camera.pixel_from_world(pose, X).uv for pose in T]
        found = book.triangulated(made, 0, 1, 0, (uv[0], uv[1]))
        np.testing.assert_allclose(found, X, atol=1e-8)
        swapped = book.triangulated(made, 1, 0, 0, (uv[1], uv[0]))
        np.testing.assert_allclose(swapped, X, atol=1e-8)
        off = [uv[0], uv[1] + [0.0, 12.0]]
        assert book.triangulated(made, 0, 1, 0, (off[0], off[1])) is None
    far = [film.camera.pixel_from_world(pose, [0.1, 0.2, 9.0]).uv for pose in T]
    assert book.triangulated(made, 0, 1, 0, (far[0], far[1])) is None  # 0.6 degrees

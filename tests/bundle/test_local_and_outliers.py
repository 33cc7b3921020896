"""Local adjustment, wrong observations, and what is said of a problem before it is solved."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.estimation.bundle import BundleProblem, Observations, Options, Robust, Scene, bundle_adjust
from vslam_ref.estimation.bundle.diagnosis import diagnose
from vslam_ref.estimation.bundle.local import local_problem, nearest_views
from vslam_ref.estimation.bundle.outliers import RAYLEIGH_99, adjust_and_clean, wrong
from vslam_ref.estimation.robust import Huber
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Pinhole

from .conftest import hold, make

TIGHT = Options(cost=1e-14)


def test_local_is_the_whole_with_the_rest_held(rng: np.random.Generator) -> None:
    """Holding everything but the active views and their points gives the same answer as the part alone."""
    problem, _ = make(rng, views=10, points=80, seen_by=4)
    active = [9, 7, 8]
    part = local_problem(problem, active)
    assert part.active.tolist() == active
    assert set(part.ring) == {4, 5, 6}
    assert (~part.problem.free.pose[3:]).all()
    assert part.problem.free.pose[:3].all()
    found = bundle_adjust(part.problem, options=TIGHT)
    back = part.put_back(problem, found.problem.scene)
    seen = problem.seen
    touched = np.zeros(80, dtype=bool)
    touched[seen.point[np.isin(seen.view, active)]] = True
    pose = np.zeros((10, 6), dtype=bool)
    pose[active] = True
    rest = dataclasses.replace(problem.free, pose=pose, point=touched)
    whole = bundle_adjust(dataclasses.replace(problem, free=rest), options=TIGHT)
    scene = whole.problem.scene
    assert np.abs(back.scene.T_cam_world - scene.T_cam_world).max() < 1e-6
    assert np.abs(back.scene.X_world - scene.X_world).max() < 1e-6
    assert (back.scene.T_cam_world[:7] == problem.scene.T_cam_world[:7]).all()
    assert found.cost < 0.4 * found.initial_cost


def test_local_observations_are_all_of_its_points(rng: np.random.Generator) -> None:
    problem, _ = make(rng, views=6, points=30, seen_by=3)
    part = local_problem(problem, [5])
    seen = problem.seen
    assert (seen.uv[part.observations] == part.problem.seen.uv).all()
    assert (part.points[part.problem.seen.point] == seen.point[part.observations]).all()
    views = np.concatenate([part.active, part.ring])
    assert (views[part.problem.seen.view] == seen.view[part.observations]).all()
    for bad in ([], [1, 1], [6], [-1]):
        with pytest.raises(ValueError, match="active"):
            local_problem(problem, bad)


def test_nearest_views() -> None:
    """By the distance of the centres, -R^T t, not of the translations."""
    turned = se3.exp([0.0, 0, 0, 0, 0, 3.0])[:3, :3]
    centres = np.array([[0.0, 0, 0], [10, 0, 0], [1, 0, 0], [3, 0, 0]])
    R = np.stack([np.eye(3), turned, turned, np.eye(3)])
    T = se3.from_rt(R, -np.einsum("vij,vj->vi", R, centres))
    assert nearest_views(T, 0, count=3).tolist() == [2, 3, 1]
    assert nearest_views(T, 1, count=9).tolist() == [3, 2, 0]


def test_cleaning_finds_the_wrong_ones(rng: np.random.Generator) -> None:
    """10 % of the matches moved by 20 to 40 pixels: all found, and about one honest in a hundred with them.

    Honest ones beyond the limit: binomial with 1 %, at most 5 % of 300 with a false-alarm rate below 1e-6.
    """
    problem, truth = make(rng, views=6, points=50, noise=0.5, perturb=0.003)
    problem = hold(problem, [0, 5], truth)
    bad = rng.random(300) < 0.1
    angle = rng.uniform(0, 6.28, 300)
    away = rng.uniform(20, 40, 300)[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
    seen = dataclasses.replace(problem.seen, uv=problem.seen.uv + bad[:, None] * away)
    robust = Robust(Huber(1.5), 0.5)  # convex: it comes back from the start, where errors are large
    cleaned = adjust_and_clean(dataclasses.replace(problem, seen=seen), robust)
    assert not cleaned.kept[bad].any()
    assert (~cleaned.kept[~bad]).mean() < 0.05
    assert cleaned.rounds >= 2
    assert len(cleaned.result.problem.seen) == cleaned.kept.sum()
    assert pytest.approx(np.sqrt(-2 * np.log(0.01)), rel=1e-15) == RAYLEIGH_99
    with pytest.raises(ValueError, match="max_rounds"):
        adjust_and_clean(problem, robust, max_rounds=0)
    with pytest.raises(ValueError, match="limit"):
        wrong(problem, 1.0, 0.0)


def test_wrong_is_in_standard_deviations() -> None:
    """An error of 3 pixels along a deviation of 2 is 1.5; along one of 0.5 it is 6."""
    scene = Scene(np.eye(4)[None], [[0, 0, 1.0], [0.001, 0, 1.0], [0, 0, -1.0]], [[100.0, 100, 0, 0]])
    cov = np.tile(np.diag([4.0, 0.25]), (3, 1, 1))
    seen = Observations([0, 0, 0], [0, 1, 2], [[3.0, 0], [0.1, 3.0], [0, 0]], cov)
    assert wrong(BundleProblem(Pinhole, scene, seen), 1.0, 3.0).tolist() == [False, True, True]
    assert wrong(BundleProblem(Pinhole, scene, seen), 3.0, 3.0).tolist() == [False, False, True]


def test_diagnosis_names_everything() -> None:
    """Two groups of views; a point seen once, one unseen, one behind; a view without points, one with two."""
    T = np.tile(np.eye(4), (5, 1, 1))
    X = np.array([[0, 0, 1.0], [0, 0, 2], [0, 0, 3], [0, 0, 4], [0, 0, -5], [0, 0, 6], [0, 0, 7.0]])
    pairs = [(0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (1, 2), (0, 4), (2, 3), (3, 3), (2, 5), (3, 5), (2, 4)]
    view, point = np.array(pairs).T
    problem = BundleProblem(
        Pinhole,
        Scene(T, X, [[100.0, 100, 0, 0]]),
        Observations(view, point, np.zeros((len(view), 2))),
    )
    cut = dataclasses.replace(problem, seen=problem.seen.only(np.array(pairs)[:, 1] != 4))
    cut = dataclasses.replace(
        cut,
        seen=Observations(
            np.append(cut.seen.view, 0), np.append(cut.seen.point, 4), np.zeros((len(cut.seen) + 1, 2))
        ),
    )
    found = diagnose(cut)
    assert found.unseen_points.tolist() == [6]
    assert found.once_seen_points.tolist() == [4]
    assert found.empty_views.tolist() == [4]
    assert found.weak_views.tolist() == [2, 3]
    assert found.behind.tolist() == [len(cut.seen) - 1]
    assert found.parts == 2
    assert len(found.sentences()) == 6
    assert diagnose(problem).parts == 1  # point 4 ties the groups


def test_a_good_problem_has_nothing_to_say(rng: np.random.Generator) -> None:
    problem, _ = make(rng)
    assert diagnose(problem).sentences() == []
    assert bundle_adjust(problem).converged


BAD = [
    ({"view": [0, 5]}, "names view 5"),
    ({"view": [0, -1]}, "names view -1"),
    ({"point": [0, 0], "view": [0, 0]}, "view 0 sees point 0 twice"),
    ({"uv": [[0.0, np.nan], [0, 0]]}, "uv\\[0\\]"),
    ({"uv": [[0.0, 0.0]]}, "shape \\(1,\\)"),
    ({"view": [0.5, 1.0]}, "whole numbers"),
    ({"cov_uv": np.zeros((2, 2, 2))}, "positive definite"),
    ({"cov_uv": np.tile([[1.0, 2.0], [2.0, 1.0]], (2, 1, 1))}, "positive definite"),
]


@pytest.mark.parametrize(("change", "told"), BAD)
def test_bad_observations_are_refused(change: dict[str, object], told: str) -> None:
    given = {"view": [0, 1], "point": [0, 0], "uv": [[0.0, 0.0], [1.0, 1.0]], **change}
    scene = Scene(np.tile(np.eye(4), (2, 1, 1)), [[0.0, 0, 1]], [[100.0, 100, 0, 0]])
    with pytest.raises(ValueError, match=told):
        BundleProblem(Pinhole, scene, Observations(**given))  # type: ignore[arg-type]


def test_bad_scenes_are_refused() -> None:
    T, X, k = np.tile(np.eye(4), (2, 1, 1)), np.ones((1, 3)), np.array([[100.0, 100, 0, 0]])
    seen = Observations([0], [0], [[0.0, 0.0]])
    for scene, told in (
        (lambda: Scene(T[0], X, k), "T_cam_world has shape"),
        (lambda: Scene(T, X * np.inf, k), "X_world"),
        (lambda: BundleProblem(Pinhole, Scene(T, X, k[:, :3]), seen), "intrinsics have 3 columns"),
        (lambda: BundleProblem(Pinhole, Scene(T, X, -k), seen), "make no Pinhole"),
        (lambda: BundleProblem(Pinhole, Scene(T, X, np.tile(k, (3, 1))), seen), "3 sets"),
        (lambda: BundleProblem(Pinhole, Scene(T, X, k), seen, np.array([0, 1])), "names set 1"),
    ):
        with pytest.raises(ValueError, match=told):
            scene()

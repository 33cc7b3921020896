"""multiview-fig1.1: every claim on a world in which it is true and on one in which it is false."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.datasets import catalogue
from vslam_ref.experiments.framework import Study, load
from vslam_ref.experiments.multiview import fig1_1
from vslam_ref.experiments.multiview.scene import MultiviewConfig, World, simulated
from vslam_ref.experiments.multiview.study import (
    Reconstruction,
    exchange,
    pairwise_distance,
    points_of_the_others,
    study_world,
)
from vslam_ref.geometry import se3
from vslam_ref.geometry.multiview import Views
from vslam_ref.support.errors import InputError

CONFIG = MultiviewConfig(every=4)
LINES, FRONT, PLACE, CAMERA, WRONG = (
    "matches-lie-on-epipolar-lines",
    "points-lie-in-front",
    "a-point-is-where-other-cameras-see-it",
    "cameras-are-found-from-points",
    "wrong-versions-miss",
)
needs_data = pytest.mark.skipif(
    catalogue.find("middlebury_temple") is None, reason="middlebury_temple is not in VSLAM_REF_DATA"
)


def verdicts(study: Reconstruction) -> dict[str, str]:
    return {c.id: c.verdict for c in fig1_1.claims(Study(study.config, None, study))}


def failing(study: Reconstruction) -> set[str]:
    return {id for id, verdict in verdicts(study).items() if verdict != "reproduced"}


@pytest.fixture(scope="module")
def world() -> World:
    """A simulation that says it is real."""
    return simulated(CONFIG, np.random.default_rng(3))._replace(real=True)


@pytest.fixture(scope="module")
def study(world: World) -> Reconstruction:
    return study_world(CONFIG, world)


def test_all_claims_hold_in_a_world_as_the_cameras_say(study: Reconstruction) -> None:
    assert verdicts(study) == dict.fromkeys((LINES, FRONT, PLACE, CAMERA, WRONG), "reproduced")
    assert len(study.resected) == 4
    assert all(r.robust.iterations > 0 and r.start.iterations == 0 for r in study.resected)
    assert min(r.start.rmse_px for r in study.resected) > 10  # the starts are far away


def test_turned_cameras_are_noticed(world: World) -> None:
    """Each camera half a degree off, 13 px: matches miss their lines."""
    rng = np.random.default_rng(0)
    d = rng.standard_normal((len(world.views), 3))
    xi = np.concatenate([0 * d, np.radians(0.5) * d / np.linalg.norm(d, axis=1, keepdims=True)], 1)
    turned = Views(world.views.cameras, se3.perturb(world.views.T_cam_world, xi))
    assert LINES in failing(study_world(CONFIG, world._replace(views=turned)))


def test_a_world_turned_inside_out_is_noticed(world: World) -> None:
    """All translations with the other sign: the same epipolar lines, and every point behind its cameras."""
    T = world.views.T_cam_world.copy()
    T[:, :3, 3] *= -1
    mirrored = study_world(CONFIG, world._replace(views=Views(world.views.cameras, T)))
    assert FRONT in failing(mirrored)
    assert LINES not in failing(mirrored)


def test_a_left_out_picture_has_no_part_in_its_points(world: World) -> None:
    """Its pixels are replaced by nonsense: the points stay, to the bit, and only its own pixels differ."""
    v = 3
    X, seen = points_of_the_others(CONFIG, world, v)
    spoilt = world.uv.copy()
    spoilt[:, v] += 100.0
    Y, moved = points_of_the_others(CONFIG, world._replace(uv=spoilt), v)
    assert len(X) > 30
    np.testing.assert_array_equal(X, Y)
    np.testing.assert_allclose(moved, seen + 100.0)


def test_a_wrong_match_is_seen_by_its_pairs_and_pixels_are_exchanged_as_said(world: World) -> None:
    three = np.flatnonzero(world.mask.sum(axis=1) >= 3)
    distance = pairwise_distance(world.views, world.uv, world.mask)
    good = three[distance[three] < CONFIG.gate_px][:20]
    uv = world.uv.copy()
    first = world.mask[good].argmax(axis=1)
    uv[good, first] += [30.0, 40.0]
    assert (pairwise_distance(world.views, uv, world.mask)[good] > CONFIG.gate_px).mean() > 0.9
    pixels = np.arange(80.0).reshape(40, 2)
    wrong = exchange(pixels, 0.2, np.random.default_rng(0))
    assert (wrong != pixels).any(axis=1).sum() == 8
    assert sorted(wrong[:, 0].tolist()) == pixels[:, 0].tolist()


def with_record(study: Reconstruction, **changes: object) -> Reconstruction:
    """One picture's record changed: all pictures must keep a rule."""
    first, *rest = study.resected
    return study._replace(resected=(first._replace(**changes), *rest))


def test_one_picture_is_enough_to_fail(study: Reconstruction) -> None:
    first = study.resected[0]
    assert failing(with_record(study, held_out_px=1.1)) == {PLACE}
    for field, value in (("turn", 1.1), ("shift", 0.011), ("rmse_px", 1.1), ("iterations", 0)):
        assert failing(with_record(study, robust=first.robust._replace(**{field: value}))) == {CAMERA}
    assert failing(with_record(study, inliers=0.4)) == {CAMERA}
    for kind in ("plain", "flipped"):
        assert failing(with_record(study, **{kind: first.robust})) == {WRONG}
    assert failing(study._replace(resected=())) == {PLACE, CAMERA, WRONG}


def test_a_principal_point_that_is_off_is_found_where_cameras_hang_both_ways(world: World) -> None:
    """Every other camera turned upside down; all pixels are then measured 0.3 px to the left, 0.2 down."""
    half_turn = se3.exp([0, 0, 0, 0, 0, np.pi])
    T = world.views.T_cam_world.copy()
    T[::2] = se3.compose(half_turn, T[::2])
    K = world.views.each[0]
    views = Views(K, T)
    centre = np.array([K.cx, K.cy])
    ratio = np.array([K.fx / K.fy, K.fy / K.fx])
    assert abs(ratio[0] - 1) < 0.01
    flip = np.zeros(len(T), dtype=bool)
    flip[::2] = True
    off = np.array([-0.3, 0.2])
    uv = np.where(flip[:, None], 2 * centre - world.uv, world.uv) + off
    pairs = {}
    for i, j in world.pairs:
        both = world.mask[:, i] & world.mask[:, j]
        pairs[i, j] = (uv[both, i], uv[both, j])
    found = study_world(
        dataclasses.replace(CONFIG, every=16), world._replace(views=views, uv=uv, pairs=pairs)
    )
    assert (found.shift_sd_px < 0.2).all()
    # five standard deviations: false alarm 1e-6
    assert (np.abs(found.shift_px + off) < 5 * found.shift_sd_px).all()
    assert abs(found.shift_px[0]) > 4 * found.shift_sd_px[0]


def test_cameras_that_hang_one_way_say_too_little(study: Reconstruction) -> None:
    assert study.shift_px.tolist() == [0.0, 0.0]
    assert study.shift_sd_px.max() > CONFIG.shift_known_px


def test_without_pictures_nothing_is_claimed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VSLAM_REF_DATA", "")
    loaded = load("multiview-fig1.1")
    result = loaded.run(loaded.configure(quick=True))
    assert set(verdicts(result.once).values()) == {"not testable"}
    assert loaded.series(result)["real"] is False
    assert "a simulation" in loaded.figure(result).axes[0].get_title()


@needs_data
def test_the_temple() -> None:
    loaded = load("multiview-fig1.1")
    result = loaded.run(loaded.configure(quick=True))
    study: Reconstruction = result.once
    assert verdicts(study) == dict.fromkeys((LINES, FRONT, PLACE, CAMERA, WRONG), "reproduced")
    # the data's own note: 0.17 and 0.23 px, with another SIFT
    filed = study.pair_px_as_filed
    assert [filed["1-2"], filed["6-7"]] == pytest.approx([0.17, 0.23], abs=0.05)
    # sub-pixel, from starts of tens of pixels; and not so with the principal point's offset
    assert max(r.robust.rmse_px for r in study.resected) < 0.5
    assert max(r.held_out_px for r in study.resected) < 0.5
    assert max(r.held_out_px for r in study.as_filed) > 1.0
    # pairs of an upright and a hanging camera miss their lines by a third of a pixel, the others do not
    assert filed["3-14"] > 0.4
    assert study.pair_px["3-14"] < 0.2
    assert study.shift_px[0] == pytest.approx(0.27, abs=0.03)
    assert len(loaded.figure(result).axes) == 4


@pytest.mark.parametrize(
    ("setting", "words"),
    [("ratio=0", "0 < ratio <= 1"), ("least_points=4", "least_points=4"), ("wrong=0.5", "0 <= wrong < 0.5")],
)
def test_settings_that_mean_nothing_are_refused(setting: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load("multiview-fig1.1").configure(overrides=[setting])


def test_the_same_seed_gives_the_same_numbers(world: World, study: Reconstruction) -> None:
    again = study_world(dataclasses.replace(CONFIG, every=8), world)
    mine = {r.view: r for r in study.resected}
    assert all(r == mine[r.view] for r in again.resected)

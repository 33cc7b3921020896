"""orbslam-fig3.1: the boxes, the calls of a run, and every claim where it is true and where it is false."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from vslam_ref.experiments.framework import Study, load
from vslam_ref.experiments.orbslam import fig3_1
from vslam_ref.experiments.orbslam.calls import STAGES, FlowStage, code_of, noted
from vslam_ref.experiments.orbslam.fig3_1 import NOT_CALLED, CalledRun
from vslam_ref.support.config import without_reason
from vslam_ref.support.errors import InputError
from vslam_ref.systems.orbslam import STAGES as WATCHED
from vslam_ref.systems.orbslam import Settings
from vslam_ref.systems.orbslam.policy import CovisibilityPolicy

IDS = {
    "tracking-of-every-picture",
    "local-mapping-of-every-keyframe",
    "loop-closing-after-local-mapping",
    "drawn-is-called",
}
TRACKER, MAPPER = slice(0, 6), slice(6, 12)
RECOVER, CANDIDATES, VERIFY, JOIN = 4, 12, 14, 15


def drawn() -> CalledRun:
    """Twenty pictures as A has them; every fourth is a keyframe, the last of these closes a loop."""
    place = np.full((20, len(STAGES)), NOT_CALLED)
    keyframe = np.arange(20) % 4 == 3
    order = np.arange(len(STAGES))
    place[:, TRACKER] = order[TRACKER]
    place[:, RECOVER] = NOT_CALLED
    place[np.ix_(keyframe, order[6:14])] = order[6:14]
    place[19] = np.where(order == RECOVER, NOT_CALLED, order)
    called = place != NOT_CALLED
    names = np.array([stage.stage for stage in STAGES])
    watched = np.array([[row[names == name].any() for name in names] for row in called])
    return CalledRun(place, keyframe, np.zeros(20, bool), watched, np.array([], "<U20"))


def lost(run: CalledRun) -> set[str]:
    found = fig3_1.claims(Study(fig3_1.Fig31Config(), None, run))
    assert {claim.id for claim in found} == IDS
    return {claim.id for claim in found if claim.verdict != "reproduced"}


def changed(rows: object, boxes: object, value: object) -> CalledRun:
    """Other places of some calls; the stopwatch sees them, too."""
    run = drawn()
    run.place[rows, boxes] = value  # type: ignore[index]
    called = run.place != NOT_CALLED
    names = np.array([stage.stage for stage in STAGES])
    watched = np.array([[row[names == name].any() for name in names] for row in called])
    return run._replace(watched=watched)


def test_all_claims_hold_where_the_flow_is_that_of_the_figure() -> None:
    assert lost(drawn()) == set()


@pytest.mark.parametrize(
    ("run", "expected"),
    [
        (changed(2, 2, NOT_CALLED), "tracking-of-every-picture"),  # a picture without a pose
        (changed(0, 8, 9), "local-mapping-of-every-keyframe"),  # new points from no keyframe
        (changed(3, 9, NOT_CALLED), "local-mapping-of-every-keyframe"),  # a keyframe that is not fused
        (changed(3, [8, 10], [10, 8]), "local-mapping-of-every-keyframe"),  # adjusted before there are points
        (changed(3, CANDIDATES, NOT_CALLED), "loop-closing-after-local-mapping"),  # not looked at
        (changed(3, CANDIDATES, 5), "loop-closing-after-local-mapping"),  # before local mapping
        (changed(3, JOIN, 20), "loop-closing-after-local-mapping"),  # closed, and not verified
        (changed(19, [VERIFY, JOIN], [15, 14]), "loop-closing-after-local-mapping"),  # verified too late
    ],
)
def test_a_flow_that_is_not_that_of_the_figure(run: CalledRun, expected: str) -> None:
    assert lost(run) == {expected}


def test_calls_and_stopwatch_must_agree() -> None:
    run = drawn()
    watched = run.watched.copy()
    watched[3, 10] = False
    assert lost(run._replace(watched=watched)) == {"drawn-is-called"}
    assert lost(run._replace(unknown=np.array(["magic"]))) == {"drawn-is-called"}


def test_no_picture_and_no_keyframe_prove_nothing() -> None:
    empty = CalledRun(
        np.zeros((0, len(STAGES)), int), np.zeros(0, bool), np.zeros(0, bool),
        np.zeros((0, len(STAGES)), bool), np.array([], "<U20"),
    )  # fmt: skip
    assert lost(empty) == IDS


def test_every_stage_after_the_start_has_a_box_and_every_box_its_function() -> None:
    assert {stage.stage for stage in STAGES} == set(WATCHED) - {"start"}
    codes = [code_of(stage.function) for stage in STAGES]
    assert len(set(codes)) == len(STAGES)
    with pytest.raises(ValueError, match="written in Python"):
        code_of("settings:LOCAL_MAPS.count")


def test_calls_are_noted_in_their_order_and_only_meanwhile() -> None:
    policy = CovisibilityPolicy(Settings().keyframe)
    stages = [
        FlowStage("", "b", "policy:CovisibilityPolicy.taken", ""),
        FlowStage("", "a", "settings:Settings.__post_init__", ""),
    ]
    calls: list[int] = []
    with noted(stages, calls):
        Settings()
        policy.taken()
        Settings()
    policy.taken()
    assert calls == [1, 0, 1]
    with pytest.raises(RuntimeError, match="out"), noted(stages, calls):
        raise RuntimeError("out")
    assert sys.getprofile() is None


def test_settings_have_reasons_and_nonsense_is_refused() -> None:
    experiment = load("orbslam-fig3.1")
    assert without_reason(experiment.default()) == []
    for wrong in ("pictures=20", "scene=attic"):
        with pytest.raises(InputError, match="at least 30 pictures"):
            experiment.configure(overrides=[wrong])

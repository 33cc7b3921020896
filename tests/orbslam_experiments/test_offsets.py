"""orbslam-offsets: the table, its bounds, and revisits, on worlds where they hold and where they do not."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from vslam_ref.experiments.framework import Study, load
from vslam_ref.experiments.orbslam import offsets
from vslam_ref.experiments.orbslam.offset_runs import OrbOffsetRun, one_place, revisits
from vslam_ref.experiments.ptam.recorded import recorded
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.support.config import without_reason
from vslam_ref.support.errors import InputError
from vslam_ref.systems.orbslam.feature_map import FeatureMap

YES, NO, OPEN = "reproduced", "not reproduced", "not testable"


def runs(count: int = 10, **fields: object) -> OrbOffsetRun:
    """Runs that keep every bound; ``fields`` are others."""
    good: dict[str, object] = {
        "offset": np.arange(count), "started": np.ones(count, bool), "first": np.arange(count),
        "second": np.arange(count) + 8, "frames": np.full(count, 100), "tracked": np.full(count, 100),
        "lost": np.zeros(count, int), "share_all": np.ones(count), "share_after": np.ones(count),
        "error": np.full(count, 0.01), "live": np.full(count, 0.02), "second_error": np.full(count, 0.01),
        "drift": np.full(count, 0.8), "refined_error": np.full(count, 0.2),
        "refined_drift": np.full(count, 0.99), "keyframes": np.full(count, 9), "points": np.full(count, 900),
        "reason": np.full(count, "", "<U200"), "loops": np.zeros(count, int),
        "rejected": np.zeros(count, int), "culled": np.zeros(count, int),
        "revisits": np.full(count, 8), "recognised": np.full(count, 8),
    }  # fmt: skip
    return OrbOffsetRun(**(good | fields))  # type: ignore[arg-type]


def verdicts(data: dict[str, OrbOffsetRun], *sequences: str) -> dict[str, str]:
    found = offsets.claims(Study(SimpleNamespace(sequences=sequences), data))
    return {claim.id: claim.verdict for claim in found}


def test_the_bounds_hold_and_do_not() -> None:
    ids = {
        "kitchen-all-pictures", "kitchen-error", "kitchen-second-opinion", "kitti-all-pictures",
        "kitti-error",
        "kitti-refined-error", "tsukuba-all-pictures", "tsukuba-error", "alva-after-the-start", "alva-error",
        "alva-revisits",
    }  # fmt: skip
    names = ("kitchen", "tsukuba", "kitti", "alva")
    assert verdicts(dict.fromkeys(names, runs()), *names) == dict.fromkeys(ids, YES)
    bad = runs(share_all=np.full(10, 0.9), share_after=np.full(10, 0.9), error=np.full(10, 6.0),
               second_error=np.full(10, 1.1), refined_error=np.full(10, 0.31),
               recognised=np.where(np.arange(10) == 3, 7, 8))  # fmt: skip
    assert verdicts(dict.fromkeys(names, bad), *names) == dict.fromkeys(ids, NO)


def test_six_runs_without_a_map_are_too_many() -> None:
    started = np.arange(10) >= 6
    nothing = np.where(started, 1.0, np.nan)
    half = runs(started=started, share_after=nothing, error=0.01 * nothing,
                revisits=np.where(started, 8, 0), recognised=np.where(started, 8, 0))  # fmt: skip
    assert verdicts({"alva": half}, "alva") == {
        "alva-after-the-start": NO, "alva-error": NO, "alva-revisits": YES,
    }  # fmt: skip


def test_without_pictures_or_revisits_nothing_is_tested() -> None:
    assert set(verdicts({}, "kitchen", "alva").values()) == {OPEN}
    none = runs(revisits=np.zeros(10, int), recognised=np.zeros(10, int))
    assert verdicts({"alva": none}, "alva")["alva-revisits"] == OPEN


def test_a_fixed_camera_must_not_start() -> None:
    reason = np.full(10, "no motion", "<U200")
    quiet = runs(started=np.zeros(10, bool), reason=reason)
    assert verdicts({"vtest": quiet}, "vtest") == {"vtest-no-start": YES}
    assert verdicts({"vtest": runs(reason=reason)}, "vtest") == {"vtest-no-start": NO}


def test_first_pictures_starts_and_pairing_are_those_of_ptam() -> None:
    for name, each in offsets.table().items():
        theirs = recorded()[name]
        same = (
            "offsets",
            "start_within",
            "data_set",
            "error",
            "error_unit",
            "error_scale",
            "second",
            "camera",
        )
        assert [getattr(each, key) for key in same] == [getattr(theirs, key) for key in same]
    assert len(offsets.table()["alva"].revisits) == 8


def test_settings_have_reasons_and_nonsense_is_refused() -> None:
    experiment = load("orbslam-offsets")
    assert without_reason(experiment.default()) == []
    with pytest.raises(InputError, match="need some of kitchen"):
        experiment.configure(overrides=["sequences=kitchn"])
    with pytest.raises(InputError, match="1 to 10 offsets"):
        experiment.configure(overrides=["offsets=11"])


def test_missing_data_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("VSLAM_REF_DATA", raising=False)
    experiment = load("orbslam-offsets")
    assert "alva_desk" in experiment.missing(experiment.default())


def place(common: int) -> FeatureMap:
    """Keyframes at pictures 10, 50 and 90, the last of them culled; the first two share points."""
    made = FeatureMap(Pinhole(100.0, 100.0, 50.0, 50.0), (100, 100), 1, 1.2)
    rows = made.keyframes
    rows.append(3,
        T_kf_world=np.tile(np.eye(4), (3, 1, 1)), frame=np.array([10, 50, 90]),
        alive=np.array([True, True, False]), parent=np.array([-1, 0, 1]), start=np.array([0, 20, 40]),
        end=np.array([20, 40, 60]), T_kf_parent=np.tile(np.eye(4), (3, 1, 1)),
    )  # fmt: skip
    points = made.add_points(np.zeros((40, 3)), 0)
    second = np.concatenate([np.arange(common), np.arange(20, 40 - common)])
    kf, point = np.repeat([0, 1], 20), points[np.concatenate([np.arange(20), second])]
    made.sightings.append(40,
        kf=kf, point=point, level=np.zeros(40, int), uv=np.zeros((40, 2)), angle=np.zeros(40),
        descriptor=np.zeros((40, 32), np.uint8), grey=np.zeros(40, np.uint8), on=np.ones(40, bool),
    )  # fmt: skip
    made.version += 1
    return made


def test_keyframes_that_share_points_or_a_loop_are_of_one_place() -> None:
    assert one_place(place(15), 12, 85)  # 85 is nearest to a keyframe that was culled: 50 counts
    assert not one_place(place(14), 12, 85)
    joined = place(0)
    joined.loop_edges.append((0, 1))
    assert one_place(joined, 85, 12)


def test_only_pairs_on_the_map_count() -> None:
    alva = offsets.table()["alva"]
    system = SimpleNamespace(started_at=(60, 70), poses=dict.fromkeys((60, 650)))
    found = revisits(alva, system)  # type: ignore[arg-type]
    assert found == [(148, 476), (104, 464), (244, 392), (168, 564), (60, 596)]
    assert revisits(alva, SimpleNamespace(started_at=None)) == []  # type: ignore[arg-type]

"""grids-readings, grids-moved-chair: every claim on a world where it is true and on one where it is false."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.experiments.framework import Study, load
from vslam_ref.experiments.framework.statistics import null_rate
from vslam_ref.experiments.grids import moved_chair as chair
from vslam_ref.experiments.grids import readings
from vslam_ref.experiments.grids.counting import CellCounts
from vslam_ref.support.config import without_reason
from vslam_ref.support.errors import InputError


def judge(module: object, study: object) -> dict[str, str]:
    return {c.id: c.verdict for c in module.claims(study)}  # type: ignore[attr-defined]


# -- readings --------------------------------------------------------------------------------------


def reading_study(precision: list[float], recall: list[float], spread: float = 0.0) -> Study[CellCounts]:
    """Six runs whose D has these precisions and recalls, plus or minus a hundredth."""
    rng = np.random.default_rng(0)
    moving = np.zeros((6, 4, 4))
    for i, (p, r) in enumerate(zip(precision, recall, strict=True)):
        shift = rng.uniform(-0.01, 0.01, 6)
        moving[:, i] = np.stack([1e4 * (p + shift), np.full(6, 1e4), np.full(6, 1e4), 1e4 * (r + shift)], 1)
    static = np.tile(np.array([90.0, 100.0, 100.0, 95.0]), (6, 4, 1))
    static[3, 2, 1] += spread
    return Study(readings.ReadingsConfig(), CellCounts(static, moving, np.zeros(6)))


def test_readings_as_measured_and_as_a_says() -> None:
    """Order of the readings: text-free, formula-free, text-unknown, formula-unknown."""
    measured = reading_study([0.9, 0.93, 0.05, 0.05], [0.9, 0.6, 0.02, 0.02])
    assert judge(readings, measured) == {
        "high-where-undetermined": "not reproduced",
        "high-where-free": "reproduced",
        "d-needs-no-memory": "reproduced",
        "memory-is-late": "reproduced",
        "s-is-the-same": "reproduced",
    }
    as_printed = reading_study([0.05, 0.05, 0.9, 0.95], [0.02, 0.1, 0.8, 0.9], spread=1.0)
    assert judge(readings, as_printed) == {
        "high-where-undetermined": "reproduced",
        "high-where-free": "not reproduced",
        "d-needs-no-memory": "not reproduced",
        "memory-is-late": "not reproduced",
        "s-is-the-same": "not reproduced",
    }


def test_a_reading_must_win_with_memory_and_without() -> None:
    half = reading_study([0.9, 0.1, 0.05, 0.5], [0.9, 0.1, 0.02, 0.5])
    assert judge(readings, half)["high-where-free"] == "not reproduced"


def test_a_reading_that_is_no_better_is_not_called_better() -> None:
    """Null: both readings the same but for noise of each run."""
    said = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        moving = np.tile(np.array([800.0, 1000.0, 1000.0, 700.0]), (6, 4, 1))
        moving[..., [0, 3]] += rng.normal(0, 30, (6, 4, 2))
        study = Study(readings.ReadingsConfig(), CellCounts(np.zeros((6, 4, 4)), moving, np.zeros(6)))
        said += judge(readings, study)["d-needs-no-memory"] == "reproduced"
    # the rate that the claim declares, plus and minus three sigma of 200 draws
    rate = null_rate(6)
    assert rate == pytest.approx(0.067, abs=1e-3)
    assert abs(said - 200 * rate) <= 3 * np.sqrt(200 * rate * (1 - rate))


# -- chair -----------------------------------------------------------------------------------------


def chair_study(**changes: np.ndarray) -> Study[chair.Run]:
    """Four runs at five scans a second: the printed table never learns, the ageing one does at T."""
    config = chair.ChairConfig()
    since = 0.2 * np.arange(360) - config.put_down
    settled = (since > config.settle)[None, None]
    printed = np.array([1.0, 0.0])[None, :, None]  # 1 for the printed table
    static = np.where(settled, 1 - printed, 0.0) * np.ones((4, 1, 1))
    values = {
        "static": static,
        "dynamic": 1 - static,
        "old_place": np.where(since < -config.put_down + config.lift, 1.0, 0.0) * np.ones((4, 2, 1)),
        "false": np.full((4, 2), 0.01),
    }
    values["static"][:, :, since < 0] = np.nan
    values["dynamic"][:, :, since < 0] = np.nan
    values["static"][1, :, 100:130] = np.nan  # somebody stood before it
    return Study(config, chair.Run(**(values | changes)))


CHAIR = {"dynamic-for-ever", "ageing-mends-it", "leaves-its-old-place", "ageing-takes-in-no-walkers"}


def test_the_chair_as_measured() -> None:
    assert judge(chair, chair_study()) == dict.fromkeys(CHAIR, "reproduced")


def test_each_claim_of_the_chair_fails_where_it_is_false() -> None:
    good = chair_study().data
    learns = chair_study(static=good.static[:, ::-1], dynamic=good.dynamic[:, ::-1])  # the wrong one learns
    assert judge(chair, learns)["dynamic-for-ever"] == "not reproduced"
    assert judge(chair, learns)["ageing-mends-it"] == "not reproduced"
    at_once = good.dynamic.copy()
    at_once[:, 1] = 0.0  # never dynamic: that is not "dynamic at first"
    assert judge(chair, chair_study(dynamic=at_once))["ageing-mends-it"] == "not reproduced"
    unseen = good.dynamic.copy()
    unseen[2] = np.nan  # in one run nobody saw the chair: nothing is shown
    assert judge(chair, chair_study(dynamic=unseen))["dynamic-for-ever"] == "not reproduced"
    stays = good.old_place.copy()
    stays[3] = 1.0
    assert judge(chair, chair_study(old_place=stays))["leaves-its-old-place"] == "not reproduced"
    false = good.false.copy()
    false[0, 1] = 0.05
    assert judge(chair, chair_study(false=false))["ageing-takes-in-no-walkers"] == "not reproduced"


# -- both ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("id", ["grids-readings", "grids-moved-chair"])
def test_every_setting_has_its_reason(id: str) -> None:
    assert without_reason(load(id).config_type()) == []


def test_settings_that_mean_nothing_are_refused() -> None:
    for id, setting in (
        ("grids-readings", "runs=1"), ("grids-moved-chair", "runs=1"), ("grids-moved-chair", "settle=100"),
        ("grids-moved-chair", "lift=20"),
    ):  # fmt: skip
        with pytest.raises(InputError):
            load(id).configure(overrides=[setting])


@pytest.mark.slow
@pytest.mark.parametrize("id", ["grids-readings", "grids-moved-chair"])
def test_a_quick_run_says_the_same_twice_and_draws(id: str) -> None:
    experiment = load(id)
    config = experiment.configure(quick=True)
    one, two = (experiment.run(config) for _ in range(2))
    for a, b in zip(one.data, two.data, strict=True):
        np.testing.assert_array_equal(a, b)
    verdicts = {c.id: c.verdict for c in experiment.claims(one)}
    assert verdicts.pop("high-where-undetermined", "not reproduced") == "not reproduced"
    assert set(verdicts.values()) == {"reproduced"}
    assert experiment.figure(one).axes

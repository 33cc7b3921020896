"""The grid changes one thing at a time, and what it should leave alone stays the same bytes."""

from __future__ import annotations

import dataclasses
from collections import Counter

import numpy as np
import pytest

from vslam_ref.experiments.framework import load
from vslam_ref.experiments.iekf import study
from vslam_ref.experiments.iekf.grid import (
    BASELINE,
    NUMERIC,
    SensitivityConfig,
    baseline_value,
    grid_with_runs,
    settings_of,
)
from vslam_ref.support.config import config_to_dict, without_reason

CONFIG = SensitivityConfig()
SETTINGS = settings_of(CONFIG)


def changed(setting: object) -> set[str]:
    """Keys of a setting's study that differ from the baseline's."""
    base, own = config_to_dict(CONFIG.study), config_to_dict(setting.study)  # type: ignore[attr-defined]
    return {key for key in base if base[key] != own[key]}


def test_the_baseline_is_the_study_of_the_figures() -> None:
    assert SETTINGS[0].axis == BASELINE
    figures = load("iekf-fig2").default()
    differing = {"population", "control_runs", "filters"}
    old, new = config_to_dict(figures), config_to_dict(SETTINGS[0].study)
    assert {key for key in old if old[key] != new[key]} == differing


def test_every_setting_changes_its_own_axis_and_nothing_else() -> None:
    expected = {axis: {f"field.{axis}"} for axis in NUMERIC} | {
        BASELINE: set(),
        "heading_variance": {"p0_high"},
        "layout": {"layout"},
        "draw": {"seed", "layout"},
        "small_noises": {"field.sigma_v", "field.sigma_phi"},  # its sigma_z is the baseline's
    }
    for setting in SETTINGS:
        assert changed(setting) == expected[setting.axis], setting.name
    assert max(Counter(s.name for s in SETTINGS).values()) == 1
    assert 20 <= len(SETTINGS) <= 26


def test_numeric_axes_leave_room_for_the_baseline() -> None:
    for axis in NUMERIC:
        values = [s.value for s in SETTINGS if s.axis == axis]
        assert min(values) < baseline_value(CONFIG, axis) < max(values), axis


def test_a_layout_moves_landmarks_only_and_a_draw_moves_noises_only() -> None:
    by_axis = {s.axis: s.study for s in SETTINGS}
    base, layout, draw = (by_axis[a] for a in (BASELINE, "layout", "draw"))
    fields = [study.study_field(s).landmarks for s in (base, layout, draw)]
    assert np.array_equal(fields[0], fields[2])
    assert not np.array_equal(fields[0], fields[1])
    controls = [study.run_noise(s, False, 0, 1).controls for s in (base, layout, draw)]
    assert np.array_equal(controls[0], controls[1])
    assert not np.array_equal(controls[0], controls[2])


def test_quick_and_runs_keep_the_grid_usable() -> None:
    small = load("iekf-sensitivity").configure(quick=True)
    assert 3 <= len(settings_of(small)) <= 6
    more = grid_with_runs(CONFIG, 100)
    assert (more.study.runs, more.study.population, more.study.control_runs) == (100, 400, 800)


@pytest.mark.parametrize("change", [{"small_noises": (0.1,)}, {"study": study.StudyConfig(filters=("ekf",))}])
def test_meaningless_grids_are_refused(change: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="need"):
        dataclasses.replace(CONFIG, **change)  # type: ignore[arg-type]


@pytest.mark.parametrize("id", ["iekf-sensitivity", "iekf-circle", "iekf-bailey"])
def test_every_value_gives_its_reason(id: str) -> None:
    assert without_reason(load(id).default()) == []

"""Made-up grids: the verdicts and the NEES at the end are chosen, so it is known what the grid should say."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from vslam_ref.experiments.framework import Claim, Verdict, verdict
from vslam_ref.experiments.iekf.grid import SensitivityConfig, StudySetting, settings_of
from vslam_ref.experiments.iekf.sentences import SENTENCES
from vslam_ref.experiments.iekf.settings import Grid, Judged

Share = Callable[[str, StudySetting], float | None]
End = Callable[[str, StudySetting], float]


def claim(id: str, share: float | None) -> Claim:
    """A claim that is reproduced when its share is 0.8 or more; None cannot be tested."""
    outcome: Verdict = verdict(None if share is None else share >= 0.8)
    null = None if share is None else 0.05
    return Claim(id, "made up", id, "share >= 0.8", {}, None, null, share, outcome)


def make_grid(share: Share, end: End) -> Grid:
    """The standard grid with shares and mean NEES by setting; runs scatter like a chi-squared."""
    judged = []
    for number, setting in enumerate(settings_of(SensitivityConfig())):
        rng = np.random.default_rng(number)
        keys = [f"{name}/{p0}" for name in ("ekf", "iekf", "ekf-anchored") for p0 in ("low", "high")]
        noise = rng.chisquare(3, setting.study.population) / 3.0  # all filters see the same measurements
        runs = {key: end(key, setting) * noise for key in keys}
        judged.append(Judged(setting, {i: claim(i, share(i, setting)) for i in SENTENCES}, runs))
    return Grid(tuple(judged))


@pytest.fixture(scope="session")
def make() -> Callable[[Share, End], Grid]:
    return make_grid

"""The experiments of seed B end to end, in their quick version."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from vslam_ref.experiments.framework import Claim, Study, load
from vslam_ref.experiments.iekf import errata, reduced
from vslam_ref.experiments.iekf.sentences import claim_ids


def by_id(claims: list[Claim]) -> dict[str, Claim]:
    return {c.id: c for c in claims}


RAN: dict[Any, Study[Any]] = {}
"""What was simulated -> its study: the three figures share their runs, as they do in the command."""


def quick(id: str, *changes: str) -> tuple[Study[dict[str, Any]], dict[str, Claim]]:
    experiment = load(id)
    config = experiment.configure(quick=True, overrides=changes)
    same = experiment.simulate, experiment.once, config
    if same not in RAN:
        RAN[same] = experiment.run(config)
    return RAN[same], by_id(experiment.claims(RAN[same]))


@pytest.mark.parametrize("figure", [2, 3, 4])
def test_figures_judge_every_statement(figure: int) -> None:
    study, claims = quick(f"iekf-fig{figure}")
    experiment = load(f"iekf-fig{figure}")
    assert set(claims) == set(claim_ids(figure))
    assert experiment.figure(study).axes
    name = "error" if figure == 4 else "nees"
    wanted = {"ekf/low", "ekf/high", "ekf-anchored/low", "ekf-anchored/high"}
    wanted |= {"iekf/low", "iekf/high"} if figure > 2 else set()
    series = experiment.series(study)
    assert wanted <= set(series[name])
    assert all(len(curve) == len(series["time"]) for curve in series[name].values())


def test_errata_claims_say_yes_and_no() -> None:
    study, claims = quick("iekf-errata", "study.field.lap_seconds=40")
    assert claims["b18-as-printed"].verdict == "reproduced"
    assert claims["corrected-stays"].verdict == "reproduced"
    assert load("iekf-errata").figure(study).axes

    def judge(data: dict[str, errata.ErrataRun]) -> dict[str, Claim]:
        return by_id(errata.claims(replace(study, data=data)))

    # a false world: the printed filter's curves put in the corrected one's place, and the other way round
    exchange = {"corrected": "B18 as printed", "B18 as printed": "corrected"}
    split = {key: key.rpartition("/") for key in study.data}
    false = judge({f"{exchange.get(n, n)}/{p0}": study.data[key] for key, (n, _, p0) in split.items()})
    assert false["b18-as-printed"].verdict == "not reproduced"
    assert false["corrected-stays"].verdict == "not reproduced"
    same = judge({key: study.data[f"corrected/{p0}"] for key, (_, _, p0) in split.items()})
    assert same["no-cross-noise"].verdict == "not reproduced"
    none_lost = judge({key: part._replace(w=np.ones_like(part.w)) for key, part in study.data.items()})
    assert none_lost["product-of-means-loses-w"].verdict == "not reproduced"


def test_values_that_overflow_count_as_broken() -> None:
    assert errata.worst(np.array([1.0, np.nan, 2.0])) == np.inf


def test_reduction_claims_say_yes_and_no() -> None:
    study, claims = quick("iekf-reduced", "study.field.lap_seconds=20", "study.field.landmarks=8")
    for id in ("reduced-pose", "reduced-map-pose", "reduced-map-map", "condition-matters"):
        assert claims[id].verdict == "reproduced", claims[id].measured
    assert claims["cost"].verdict == "not testable"  # the quick version looks at no clock
    assert load("iekf-reduced").figure(study).axes
    off = {}
    for key, part in study.data.items():
        over_time = part.over_time + 1e-9
        over_time[:, 2:] = 0.0  # the broken condition, where there is one
        off[key] = reduced.Gap(over_time, part.of_map + 1e-9)
    slow = replace(study, data=off, once={"reduced": 1.2, "reduced-map": 1.3, "lifted": 9.0})
    assert {c.verdict for c in reduced.claims(slow)} == {"not reproduced"}

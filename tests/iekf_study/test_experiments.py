"""The experiments of seed B end to end, in their quick version."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.experiments import iekf_errata, iekf_reduced
from vslam_ref.experiments.framework import Claim, Result, RunContext, load
from vslam_ref.experiments.iekf.sentences import claim_ids


def quick(id: str) -> tuple[Result, dict[str, Claim]]:
    experiment = load(id)
    result = experiment.run(experiment.configure(quick=True), RunContext())
    return result, {c.id: c for c in experiment.claims(result)}


@pytest.mark.parametrize("figure", [2, 3, 4])
def test_figures_judge_every_statement(figure: int) -> None:
    result, claims = quick(f"iekf-fig{figure}")
    assert set(claims) == set(claim_ids(figure))
    assert load(f"iekf-fig{figure}").figure(result).axes
    name = "error" if figure == 4 else "nees"
    wanted = {"ekf/low", "ekf/high", "ekf-anchored/low", "ekf-anchored/high"}
    wanted |= {"iekf/low", "iekf/high"} if figure > 2 else set()
    assert wanted <= set(result.series[name])
    assert all(len(curve) == len(result.series["time"]) for curve in result.series[name].values())


def test_errata_claims_say_yes_and_no() -> None:
    result, claims = quick("iekf-errata")
    assert claims["b18-as-printed"].verdict == "reproduced"
    assert claims["corrected-stays"].verdict == "reproduced"
    assert load("iekf-errata").figure(result).axes
    config, nees, w = result.payload
    # a false world: the printed filter's curves put in the corrected one's place, and the other way round
    exchange = {"corrected": "B18 as printed", "B18 as printed": "corrected"}
    split = {key: key.rpartition("/") for key in nees}
    swapped = {f"{exchange.get(name, name)}/{p0}": nees[key] for key, (name, _, p0) in split.items()}
    false = {c.id: c for c in iekf_errata.claims(Result(result.series, payload=(config, swapped, w)))}
    assert false["b18-as-printed"].verdict == "not reproduced"
    assert false["corrected-stays"].verdict == "not reproduced"
    equal = {key: nees[f"corrected/{key.split('/')[1]}"] for key in nees}
    same = {c.id: c for c in iekf_errata.claims(Result(result.series, payload=(config, equal, w)))}
    assert same["no-cross-noise"].verdict == "not reproduced"
    kept = {key: np.ones_like(v) for key, v in w.items()}
    none_lost = {c.id: c for c in iekf_errata.claims(Result(result.series, payload=(config, nees, kept)))}
    assert none_lost["product-of-means-loses-w"].verdict == "not reproduced"


def test_values_that_overflow_count_as_broken() -> None:
    assert iekf_errata._worst(np.array([1.0, np.nan, 2.0])) == np.inf


def test_reduction_claims_say_yes_and_no() -> None:
    result, claims = quick("iekf-reduced")
    for id in ("reduced-pose", "reduced-map-pose", "reduced-map-map", "condition-matters"):
        assert claims[id].verdict == "reproduced", claims[id].measured
    assert claims["cost"].verdict == "not testable"  # the quick version looks at no clock
    assert load("iekf-reduced").figure(result).axes
    config, gap, _ = result.payload
    off = {key: value + 1e-9 for key, value in gap.items()}
    off |= {key: 0 * value for key, value in gap.items() if key.startswith("condition")}
    slow = Result(result.series, payload=(config, off, {"reduced": 1.2, "reduced-map": 1.3, "lifted": 9.0}))
    assert {c.verdict for c in iekf_reduced.claims(slow)} == {"not reproduced"}

"""Chapter 19: occupancy grids."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.grids import inverse_sensor, log_odds, rays, recursion, static_dynamic

Array = NDArray[np.float64]
SIDE = 7
"""Cells of a map's side: a beam must stay a cell away from the border."""


def _static_dynamic(
    s: float,
    d: float,
    observation: str,
    table: dict[str, float],
    d_memory: Any,
    d_high_where: Any,
    most: dict[str, float],
) -> dict[str, float]:
    """One beam through, or into, the middle cell of a small map."""
    config = static_dynamic.MapConfig(
        sensor=inverse_sensor.InverseSensor(**table),
        d_memory=d_memory,
        d_high_where=d_high_where,
        explained_by=0,
        settle_seconds=None,
        s_most=most["s"],
        d_most=most["d"],
    )
    cell, now = SIDE * (SIDE // 2) + SIDE // 2, 10.0
    layers = np.zeros((5, SIDE * SIDE))
    layers[0, cell], layers[1, cell] = s, d
    layers[2], layers[3] = now - 0.1, -np.inf  # looked at a moment ago, never hit
    steps = config.sensor.steps(config.d_high_where)
    end = [[3.5, 3.5]] if observation == "hit" else [[4.5, 3.5]]
    beam = np.array([2.5, 3.5]), np.array(end), np.array([observation == "hit"])
    where = static_dynamic.limits(config)
    s_map, d_map, seen, last_hit, since = layers
    static_dynamic.apply_scan(
        s_map, d_map, seen, last_hit, since, SIDE, *beam, steps.static, steps.dynamic, where, now
    )
    return {"s": float(layers[0, cell]), "d": float(layers[1, cell])}


TABLE: Answers = {
    "grid.log_odds": lambda probability: log_odds.log_odds(float(probability)),
    "grid.probability": lambda log_odds: _probability(log_odds),
    "grid.update": lambda prior, measured: recursion.recursion(
        log_odds.log_odds(measured), 0.0, log_odds.log_odds(prior)
    ),
    "grid.follow": lambda start, evidence: recursion.follow(evidence, "printed", "evidence", start),
    "grid.static_dynamic": _static_dynamic,
    "grid.ray_cells": lambda start, end: rays.crossed_cells(start, [end]).cells[:, ::-1],
}


def _probability(L: float) -> Array:
    return log_odds.probability(L)

"""Chapter 19: occupancy grids."""

from __future__ import annotations

from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.grids import beam_marks, inverse_sensor, log_odds, map_config, rays, recursion, static_dynamic

SIDE = 7
"""Cells of a map's side: a beam must stay a cell away from the border."""
CELL = SIDE * (SIDE // 2) + SIDE // 2
"""The middle cell."""


def _static_dynamic(s: float, d: float, observation: str, **settings: Any) -> dict[str, float]:
    """One beam through, or into, the middle cell of a small map that was looked at a moment ago."""
    layers = _layers()
    layers[0, CELL], layers[1, CELL], layers[2] = s, d, 9.9
    _look(layers, 10.0, observation, _config(**settings))
    return {"s": float(layers[0, CELL]), "d": float(layers[1, CELL])}


def _explained(
    s_around: Array, d: float, table: dict[str, float], most: dict[str, float], reach: float
) -> dict[str, float]:
    layers = _layers()
    layers[0].reshape(SIDE, SIDE)[1:6, 1:6] = s_around
    layers[1, CELL], layers[2] = d, 9.9
    config = _config(table, most, d_memory="formula", d_high_where="free", explained_by=int(reach))
    _look(layers, 10.0, "hit", config)
    return {"s": float(layers[0, CELL]), "d": float(layers[1, CELL])}


def _history(times: Array, observations: list[str], **settings: Any) -> dict[str, list[float]]:
    layers, config = _layers(), _config(**settings)
    path: dict[str, list[float]] = {"s": [], "d": []}
    for now, observation in zip(times.tolist(), observations, strict=True):
        _look(layers, now, observation, config)
        path["s"].append(float(layers[0, CELL]))
        path["d"].append(float(layers[1, CELL]))
    return path


def _layers() -> Array:
    """S, D, and the times of the last look, the last hit and the first hit of a stay."""
    layers = np.zeros((5, SIDE * SIDE))
    layers[2:4] = -np.inf
    return layers


def _config(
    table: dict[str, float],
    most: dict[str, float],
    settle_seconds: float | None = None,
    explained_by: int = 0,
    **settings: Any,
) -> map_config.MapConfig:
    return map_config.MapConfig(
        sensor=inverse_sensor.InverseSensor(**table),
        explained_by=explained_by,
        settle_seconds=settle_seconds,
        s_most=most["s"],
        d_most=most["d"],
        **settings,
    )


def _look(layers: Array, now: float, observation: str, config: map_config.MapConfig) -> None:
    end = [[3.5, 3.5]] if observation == "hit" else [[4.5, 3.5]]
    beam = beam_marks.BeamsInCells(np.array([2.5, 3.5]), np.array(end), np.array([observation == "hit"]))
    rules = static_dynamic.rules_of(config)
    static_dynamic.apply_scan(static_dynamic.Layers(*layers), SIDE, beam, rules, now)


TABLE: Answers = {
    "grid.log_odds": lambda probability: log_odds.log_odds(float(probability)),
    "grid.probability": log_odds.probability,
    "grid.update": lambda prior, measured: recursion.recursion(
        log_odds.log_odds(measured), 0.0, log_odds.log_odds(prior)
    ),
    "grid.follow": lambda start, evidence: recursion.follow(evidence, "printed", "evidence", start),
    "grid.static_dynamic": _static_dynamic,
    "grid.history": _history,
    "grid.explained": _explained,
    "grid.recursion": recursion.recursion,
    "grid.ray_cells": lambda start, end: rays.crossed_cells(start, [end]).cells[:, ::-1],
}

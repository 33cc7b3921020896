"""Gains and noises of the data sets, as found by ``vslam-ref identify`` without any truth.

One JSON file a set: ``values`` (the fields of :class:`~vslam_ref.systems.slam_log.RobotCalibration`),
``method``, ``evidence`` and the ``command`` that makes the file again.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from vslam_ref.systems.slam_log.calibration import RobotCalibration


def document(name: str) -> dict[str, Any]:
    """The whole document of the set ``name``: ``mrclam`` or ``victoria_park``."""
    path = Path(__file__).with_name(f"{name}.json")
    if not path.is_file():
        known = ", ".join(sorted(p.stem for p in path.parent.glob("*.json")))
        raise ValueError(f"no identified noises of {name!r}; there are some of {known}")
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content


def calibration(name: str) -> RobotCalibration:
    """The identified values of the set ``name``."""
    return RobotCalibration.from_mapping(document(name)["values"])

"""The table by which PTAM is judged: recorded sequences, ten first pictures each, bounds fixed before.

::

    recorded.toml: sequence, offset -> Ptam -> shares with a pose, error of the final and the live path
                                                -> median of the ten against each bound; all ten are told

A run that has no map after so many pictures as the table allows ends there, and counts as one that tracked
nothing.  Everything else is in the run's own words: a lost picture has no pose, and a wrong path its error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from vslam_ref.experiments.framework import Experiment, Study
from vslam_ref.experiments.ptam.offset_claims import claims, counted
from vslam_ref.experiments.ptam.offset_runs import OffsetRun, run_twice, told
from vslam_ref.experiments.ptam.recorded import RecordedSequence, found, recorded
from vslam_ref.support.config import assume
from vslam_ref.systems.ptam.presets import PRESETS, preset
from vslam_ref.systems.ptam.settings import Settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ALL = ("kitchen", "tsukuba", "kitti", "alva", "vtest")
SCENES = ("desk", "corridor")


@dataclass(frozen=True)
class OffsetsConfig:
    """Which runs."""

    sequences: tuple[str, ...] = assume(ALL, "", "all of the table; those that are not found are left out")
    offsets: int = assume(10, "first pictures, or seeds", "of each sequence: all of the table")
    pictures: int = assume(0, "pictures", "of a run at most; 0: to the last")
    preset: str = assume("", "", "the settings as they come; else a named set of them, such as ptam2007")
    seed: int = assume(0, "", "of the system's one generator, as it comes")

    def __post_init__(self) -> None:
        """Refuse what the table does not have."""
        unknown = [name for name in self.sequences if name not in recorded()]
        if unknown or not self.sequences:
            raise ValueError(f"sequences={', '.join(self.sequences)}: need some of {', '.join(recorded())}")
        if self.preset and self.preset not in PRESETS:
            raise ValueError(f"preset={self.preset}: need one of {', '.join(PRESETS)}, or none")
        if not 1 <= self.offsets <= 10 or self.pictures < 0 or self.seed < 0:
            given = f"offsets={self.offsets}, pictures={self.pictures}, seed={self.seed}"
            raise ValueError(f"{given}: need 1 to 10 offsets, and no number below 0")


def available(config: OffsetsConfig) -> list[str]:
    """Names of the sequences that are found, in the table's order."""
    return [name for name in recorded() if name in config.sequences and found(recorded()[name])]


def missing(config: OffsetsConfig) -> list[str]:
    """Data sets that a run needs: all that are asked for, if none of them is found."""
    return [] if available(config) else [recorded()[name].data_set for name in config.sequences]


def offsets(config: OffsetsConfig, name: str) -> Sequence[int]:
    """First pictures of the runs of one sequence."""
    return list(recorded()[name].offsets[: config.offsets])


def simulate(config: OffsetsConfig, name: str, offset: int) -> OffsetRun:
    """Run PTAM from one offset to the end."""
    each = recorded()[name]
    settings = preset(config.preset) if config.preset else Settings()
    done, second = run_twice(each, offset, config.pictures or None, replace(settings, seed=config.seed))
    return told(each, offset, done, second)


# --- what is written ------------------------------------------------------------------------------


def series(study: Study[dict[str, OffsetRun]]) -> dict[str, object]:
    """All runs by sequence, with what other programs reached."""
    return series_of(study, recorded())


def series_of(study: Study[Any], table: Mapping[str, RecordedSequence]) -> dict[str, object]:
    """All runs of a table."""
    return {
        name: {"unit": table[name].error_unit, "beside": list(table[name].beside)}
        | {field: np.asarray(values).tolist() for field, values in runs._asdict().items()}
        for name, runs in study.data.items()
    }


def figure(study: Study[dict[str, OffsetRun]]) -> Figure:
    """Shares and errors of all runs against the bounds and the other programs."""
    return figure_of(study, recorded())


def figure_of(study: Study[Any], table: Mapping[str, RecordedSequence]) -> Figure:
    """The figure of a table."""
    from vslam_ref.plot.offsets import OffsetRows, offsets_figure

    rows = []
    for name, runs in study.data.items():
        each = table[name]
        if each.must_not_start or each.most_error is None:
            continue
        beside = {str(b["system"]): float(b["error"]) / each.most_error for b in each.beside if "error" in b}
        share = np.where(runs.started, counted(runs.share_all), 0.0)
        rows.append(
            OffsetRows(name, share, np.asarray(runs.error, float) / each.most_error, each.least_all, beside,
                       f"{each.most_error:g} {each.error_unit}")
        )  # fmt: skip
    return offsets_figure(rows)


ABOUT = {
    "offset": "first picture; (runs,)",
    "started": "whether there was a map in time; (runs,)",
    "first": "first picture of the start, -1 without one; (runs,)",
    "second": "second picture of the start, -1 without one; (runs,)",
    "frames": "pictures from the offset on; (runs,)",
    "tracked": "pictures with a pose; (runs,)",
    "lost": "pictures lost after the start; (runs,)",
    "share_all": "pictures with a pose over all; (runs,)",
    "share_after": "pictures with a pose over those after the start; (runs,)",
    "error": "error of the final path, in the table's unit; (runs,)",
    "live": "error of the live path, in the table's unit; (runs,)",
    "second_error": "distance from the other path, in the table's unit; (runs,)",
    "drift": "scale of the last third over that of the first; (runs,)",
    "refined_error": "error of a second run with the camera that a first one refined; (runs,)",
    "refined_drift": "drift of that run; (runs,)",
    "keyframes": "keyframes; (runs,)",
    "points": "points of the map; (runs,)",
    "reason": "why there was no start; (runs,)",
}


def _sample(study: Study[dict[str, OffsetRun]]) -> int:
    return sum(len(runs.offset) for runs in study.data.values())


SHARED: dict[str, Any] = {
    "config_type": OffsetsConfig,
    "simulate": simulate,
    "points": available,
    "name": str,
    "seeds": offsets,
    "series": series,
    "claims": claims,
    "figure": figure,
    "sample": _sample,
    "missing": missing,
    "about": ABOUT,
}
EXPERIMENTS = (
    Experiment(
        id="ptam-offsets",
        title="PTAM on recorded sequences, from ten first pictures each",
        source="A, chapter 2",
        quick={"sequences": ("tsukuba",), "offsets": 1, "pictures": 40},
        **SHARED,
    ),
    Experiment(
        id="ptam-scenes",
        title="PTAM on rendered scenes with exact truth",
        source="A, chapter 2",
        defaults={"sequences": SCENES, "offsets": 5},
        quick={"sequences": ("desk",), "offsets": 1, "pictures": 40},
        **SHARED,
    ),
)

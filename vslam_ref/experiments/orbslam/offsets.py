"""The table by which ORB-SLAM is judged: PTAM's sequences and first pictures, bounds of its own.

::

    recorded.toml: sequence, offset -> OrbSlam -> shares with a pose, error of the final and the live path,
                                                  revisits recognised
                                               -> median of the ten against each bound; all ten are told

A run without a map after as many pictures as the table allows counts as one that tracked nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vslam_ref.experiments.framework import Claim, Experiment, Study, judged
from vslam_ref.experiments.framework.claims import LEAST_FOR_EVERY_RUN
from vslam_ref.experiments.orbslam.offset_runs import OrbOffsetRun, run_offset
from vslam_ref.experiments.ptam import offset_claims, offsets
from vslam_ref.experiments.ptam.recorded import RecordedSequence, found, read_table
from vslam_ref.support.config import assume
from vslam_ref.systems.orbslam import Settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLE = Path(__file__).with_name("recorded.toml")
ALL = ("kitchen", "tsukuba", "kitti", "alva", "vtest")


@dataclass(frozen=True)
class OrbOffsetsConfig:
    """Which runs."""

    sequences: tuple[str, ...] = assume(ALL, "", "all of the table; those that are not found are left out")
    offsets: int = assume(10, "first pictures", "of each sequence: all of the table")
    pictures: int = assume(0, "pictures", "of a run at most; 0: to the last")
    seed: int = assume(0, "", "of the system's one generator, as it comes")

    def __post_init__(self) -> None:
        """Refuse what the table does not have."""
        unknown = [name for name in self.sequences if name not in table()]
        if unknown or not self.sequences:
            raise ValueError(f"sequences={', '.join(self.sequences)}: need some of {', '.join(table())}")
        if not 1 <= self.offsets <= 10 or self.pictures < 0 or self.seed < 0:
            given = f"offsets={self.offsets}, pictures={self.pictures}, seed={self.seed}"
            raise ValueError(f"{given}: need 1 to 10 offsets, and no number below 0")


def table() -> dict[str, RecordedSequence]:
    """Every sequence of the table, by its name."""
    return read_table(TABLE)


def available(config: OrbOffsetsConfig) -> list[str]:
    """Names of the sequences that are found, in the table's order."""
    return [name for name, each in table().items() if name in config.sequences and found(each)]


def missing(config: OrbOffsetsConfig) -> list[str]:
    """Data sets that a run needs: all that are asked for, if none of them is found."""
    return [] if available(config) else [table()[name].data_set for name in config.sequences]


def first_pictures(config: OrbOffsetsConfig, name: str) -> Sequence[int]:
    """First pictures of the runs of one sequence."""
    return list(table()[name].offsets[: config.offsets])


def simulate(config: OrbOffsetsConfig, name: str, offset: int) -> OrbOffsetRun:
    """Run ORB-SLAM from one offset to the end."""
    return run_offset(table()[name], offset, config.pictures or None, Settings(seed=config.seed))


def claims(study: Study[dict[str, OrbOffsetRun]]) -> list[Claim]:
    """Judge every bound of the table, and the revisits."""
    rows = table()
    again = [name for name in study.config.sequences if rows[name].revisits]
    return [
        *offset_claims.judge(study, rows),
        *(_recognised(rows[name], study.data.get(name)) for name in again),
    ]


def _recognised(each: RecordedSequence, runs: OrbOffsetRun | None) -> Claim:
    """Every revisit that a map can know of must be known to it."""
    of, known = (0, 0) if runs is None else (int(np.sum(runs.revisits)), int(np.sum(runs.recognised)))
    text = f"{each.name}: every revisit is recognised from which both pictures are on the map"
    whole = None if runs is None else np.asarray(runs.recognised) == np.asarray(runs.revisits)
    told = (
        f"The pictures of {each.name} (data set {each.data_set}) are not found here"
        if runs is None
        else f"{each.name}: {known} of {of} revisits were recognised, in the {len(runs.offset)} runs together"
        + ("" if of else ", so that nothing could be tested")
    )
    return judged(
        f"{each.name}-revisits",
        offset_claims.HERE,
        text,
        "in every run, the keyframes nearest in time to the two pictures share 15 points or more, or a "
        "closed loop joins them",
        None if whole is None or not of else bool(whole.all()),
        told,
        {"revisits": of, "recognised": known},
        share=None if whole is None or not of else float(whole.mean()),
        runs=0 if runs is None else len(runs.offset),
        least_runs=LEAST_FOR_EVERY_RUN,
    )


def series(study: Study[dict[str, OrbOffsetRun]]) -> dict[str, object]:
    """All runs by sequence, with what other programs reached."""
    return offsets.series_of(study, table())


def figure(study: Study[dict[str, OrbOffsetRun]]) -> Figure:
    """Shares and errors of all runs against the bounds and the other programs."""
    return offsets.figure_of(study, table())


EXPERIMENT = Experiment(
    id="orbslam-offsets",
    title="ORB-SLAM on recorded sequences, from ten first pictures each",
    source="A, chapter 3",
    config_type=OrbOffsetsConfig,
    simulate=simulate,
    points=available,
    name=str,
    seeds=first_pictures,
    series=series,
    claims=claims,
    figure=figure,
    sample=lambda study: sum(len(runs.offset) for runs in study.data.values()),
    missing=missing,
    about=offsets.ABOUT
    | {
        "loops": "loops closed; (runs,)",
        "rejected": "candidates of loops refused; (runs,)",
        "culled": "keyframes culled; (runs,)",
        "revisits": "pairs of pictures of one place, both on the map; (runs,)",
        "recognised": "of these, whose keyframes share points or are joined by a loop; (runs,)",
    },
    quick={"sequences": ("tsukuba",), "offsets": 1, "pictures": 40},
)

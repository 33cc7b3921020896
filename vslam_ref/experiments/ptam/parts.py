"""What each part of PTAM is worth: the whole system, and the system without it, where it should matter.

Four inputs (:mod:`.parts_inputs`), each hard in one way.  On each run the whole system, the system without
the part that should help there, and PTAM with the constants it was published with.  A part matters where the
system without it loses the camera or goes wrong, and the whole one does not::

    whole:    >= 95 % of the pictures with a pose, and the smaller error
    without:  at least 10 points of a hundred fewer pictures, or at least twice the error
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.experiments.framework import Claim, Experiment, Study, judged
from vslam_ref.experiments.framework.claims import LEAST_FOR_EVERY_RUN
from vslam_ref.experiments.ptam.parts_inputs import pictures_of
from vslam_ref.experiments.visual_slam import numbers, running
from vslam_ref.support.config import assume
from vslam_ref.systems.ptam.presets import PRESETS, preset
from vslam_ref.systems.ptam.settings import Settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WHOLE, PUBLISHED = "whole", "ptam2007"
PART = {
    "turned": ("no_warp", "the warp of the templates", "a quick roll of the camera"),
    "mover": ("least_squares", "Tukey's loss", "a thing that moves through a quarter of the picture"),
    "lamp": ("absolute_score", "a limit relative to a patch's contrast", "an exposure down to a seventh"),
    "wallpaper": ("no_search_back", "the search back", "one small pattern over and over"),
}
"""Input -> preset without the part, the part, and what makes the input hard."""
TRACKED, FEWER, WORSE = 0.95, 0.1, 2.0


@dataclass(frozen=True)
class PartsConfig:
    """The pictures."""

    runs: int = assume(5, "seeds", "of every input; a third of a minute each")
    seed: int = assume(217, "", "any; fixed for repeatability")
    pictures: int = assume(150, "pictures", "5 s: 2 s of peace, 3 s of trouble")
    noise: float = assume(2.0, "grey levels", "a usual camera indoors")
    inputs: tuple[str, ...] = assume(tuple(PART), "", "one for each part")

    def __post_init__(self) -> None:
        """Refuse runs that mean nothing."""
        unknown = [name for name in self.inputs if name not in PART]
        if self.runs < 1 or self.pictures < 80 or unknown or not self.inputs:
            raise ValueError(f"need at least one run, 80 pictures, and inputs of {', '.join(PART)}")


class PartVariant(NamedTuple):
    """An input and a set of settings."""

    input: str
    preset: str


class PartsRun(NamedTuple):
    """One run: whether there was a map, share of pictures with a pose, ATE in percent (NaN: unknown)."""

    started: BoolArray
    share: Array
    error: Array


def variants(config: PartsConfig) -> list[PartVariant]:
    """On every input the whole system, without the part, and as published."""
    return [PartVariant(name, p) for name in config.inputs for p in (WHOLE, PART[name][0], PUBLISHED)]


def words(variant: PartVariant) -> str:
    """Name of a variant."""
    return f"{variant.input}-{variant.preset}"


def simulate(config: PartsConfig, variant: PartVariant, seed: np.random.SeedSequence) -> PartsRun:
    """Run one variant over one seed's pictures."""
    sequence = pictures_of(variant.input, int(seed.generate_state(1)[0]), config.pictures, config.noise)
    settings = Settings() if variant.preset == WHOLE else preset(variant.preset)
    done = running.run(sequence, settings)
    which, T = running.path(done)
    error = numbers.accuracy(sequence, which, T).percent
    return PartsRun(
        np.array(done.system.map is not None),
        np.array(len(which) / config.pictures),
        np.array(np.nan if error is None else error),
    )


# --- claims ---------------------------------------------------------------------------------------


def claims(study: Study[dict[str, PartsRun]]) -> list[Claim]:
    """Judge each part on its input, and the published constants on all."""
    return [_matters(study.data, name) for name in study.config.inputs] + [_published(study)]


def _median(values: Array) -> float:
    return float(np.median(np.where(np.isfinite(values), values, np.inf)))


def _matters(data: dict[str, PartsRun], name: str) -> Claim:
    without_name, part, hard = PART[name]
    whole, without = data[f"{name}-{WHOLE}"], data[f"{name}-{without_name}"]
    share = _median(whole.share), _median(without.share)
    error = _median(whole.error), _median(without.error)
    fewer, worse = share[0] - share[1] >= FEWER, error[1] >= WORSE * error[0]
    each = (whole.share - without.share >= FEWER) | (without.error >= WORSE * whole.error)
    return judged(
        f"{name}-{without_name.replace('_', '-')}",
        "A§2.2",
        f"Where there is {hard}, {part} matters",
        f"medians: whole >= {TRACKED:.0%} of the pictures; without the part {FEWER:.0%} fewer, or {WORSE:g} "
        "times the error",
        share[0] >= TRACKED and (fewer or worse),
        f"With {part}, {share[0]:.0%} of the pictures have a pose and the error is {error[0]:.2g} % of the "
        f"path; without, {share[1]:.0%} and {error[1]:.2g} %",
        {"share": share, "error_percent": error},
        share=float(np.mean(each)),
        least_runs=LEAST_FOR_EVERY_RUN,
    )


def _published(study: Study[dict[str, PartsRun]]) -> Claim:
    def kept(p: str) -> list[float]:
        return [_median(study.data[f"{name}-{p}"].share) for name in study.config.inputs]

    def errors(p: str) -> list[float]:
        return [_median(study.data[f"{name}-{p}"].error) for name in study.config.inputs]

    whole, published = errors(WHOLE), errors(PUBLISHED)
    worse = [b >= WORSE * a or s < TRACKED for a, b, s in zip(whole, published, kept(PUBLISHED), strict=True)]
    told = "; ".join(
        f"{name}: {s:.0%}, {b:.2g} % against {a:.2g} %"
        for name, s, a, b in zip(study.config.inputs, kept(PUBLISHED), whole, published, strict=True)
    )
    return judged(
        "published-constants",
        "A§2.2",
        "With the constants that PTAM was published with, every one of these inputs goes worse",
        f"on every input, in the median, below {TRACKED:.0%} of the pictures or {WORSE:g} times the error",
        all(worse),
        f"With the published constants, pictures with a pose and error, against the whole system's: {told}",
        {"share": kept(PUBLISHED), "error_percent": published},
        least_runs=LEAST_FOR_EVERY_RUN,
    )


def series(study: Study[dict[str, PartsRun]]) -> dict[str, object]:
    """Meaning of every preset, and all runs."""
    meaning = {name: PRESETS[name].meaning for name in {v.preset for v in variants(study.config)} - {WHOLE}}
    return {"presets": dict(sorted(meaning.items()))} | {
        name: {field: np.asarray(values).tolist() for field, values in run._asdict().items()}
        for name, run in study.data.items()
    }


def figure(study: Study[dict[str, PartsRun]]) -> Figure:
    """Shares and errors of every variant."""
    from vslam_ref.plot.parts import PartRows, parts_figure

    rows = []
    for variant in variants(study.config):
        run = study.data[words(variant)]
        kind = variant.preset if variant.preset in (WHOLE, PUBLISHED) else "without the part"
        rows.append(
            PartRows(f"{variant.input}: {variant.preset.replace('_', ' ')}", kind, run.share, run.error)
        )
    return parts_figure(rows)


EXPERIMENT = Experiment(
    id="ptam-parts",
    title="The whole system, without one part, and as it was published",
    source="A, section 2.2",
    config_type=PartsConfig,
    simulate=simulate,
    points=variants,
    name=words,
    series=series,
    claims=claims,
    figure=figure,
    about={
        "started": "whether there was a map; (runs,)",
        "share": "pictures with a pose over all; (runs,)",
        "error": "ATE, percent of the path, NaN where unknown; (runs,)",
    },
    quick={"runs": 1, "pictures": 90, "inputs": ("turned",)},
)

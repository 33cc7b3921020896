"""Figure 2.1: the scale space of a real picture, its corners, and the search for known points in it.

PTAM runs over recorded pictures.  The last one is drawn: its four levels with their FAST-10 corners, and in
the picture itself, for some points, where each was expected, how far it was looked for, and where it was
found.  From all pictures comes what the figure's text says of the levels: a point found on level l has an
error of sigma = 2^l.  On level l the distance between found places and the final pose's projections is taken,
and its scale (the median, made to a standard deviation of one coordinate) is compared from level to level.

Implements A fig 2.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets import catalogue
from vslam_ref.datasets.sequences import open_sequence
from vslam_ref.estimation.robust import norm_scale
from vslam_ref.experiments.framework import Claim, Experiment, Study, judged
from vslam_ref.support.config import assume
from vslam_ref.support.errors import InputError
from vslam_ref.systems.ptam.look import prepare
from vslam_ref.systems.ptam.ptam import Ptam
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.tracker.quality import Quality

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SOURCE = "A, fig 2.1"
ENOUGH = 50
"""Points found on a level, that its scale may be told."""
DOUBLES = (1.5, 2.5)
"""Band in which the growth of the scale from one level to the next counts as a doubling."""
SHOWN = 40
"""Points whose search is drawn."""
HANDFUL = 20
"""Corners that a level must have, to be of use."""


@dataclass(frozen=True)
class Fig21Config:
    """The pictures."""

    source: str = assume("7scenes_redkitchen", "", "a real camera, hand-held, 30 pictures a second")
    first: int = assume(0, "", "number of the first picture")
    pictures: int = assume(90, "pictures", "3 s: the start, and enough points of every level")

    def __post_init__(self) -> None:
        """Refuse runs that cannot start."""
        if self.first < 0 or self.pictures < 20:
            raise ValueError(f"first={self.first}, pictures={self.pictures}: need at least 0 and 20")


class Fig21Found(NamedTuple):
    """What was found.

    Attributes
    ----------
    number : int
        Of the picture that is drawn.
    levels, corners : tuple of ndarray
        Its pyramid (H, W), and corners (n, 2) in pixels of their level.
    expected, found : ndarray, shape (m, 2)
        Of the points that were looked for in it, pixels; NaN where not found.
    level : ndarray, shape (m,)
    radius : float
        Of the search, pixels of level 0.
    tried, seen : ndarray, shape (levels,)
        Points of each level tried and found in all pictures.
    scale : ndarray, shape (levels,)
        Standard deviation of one coordinate of their error, pixels of level 0; NaN where too few were found.
    """

    number: int
    levels: tuple[NDArray[np.uint8], ...]
    corners: tuple[NDArray[np.int32], ...]
    expected: Array
    found: Array
    level: IntArray
    radius: float
    tried: IntArray
    seen: IntArray
    scale: Array


def missing(config: Fig21Config) -> list[str]:
    """The data set, if the source is one that is not found."""
    from vslam_ref.datasets.known import DATA_SETS

    known = {data_set.name for data_set in DATA_SETS}
    return [config.source] if config.source in known and catalogue.find(config.source) is None else []


def look_at(config: Fig21Config) -> Fig21Found:
    """Run over the pictures; keep the last one and the errors of all."""
    sequence = open_sequence(config.source).part(config.first, config.first + config.pictures)
    assert sequence.camera is not None
    settings = Settings()
    system = Ptam(sequence.camera, settings)
    count = settings.features.levels
    errors: list[list[Array]] = [[] for _ in range(count)]
    tried = np.zeros(count, np.int64)
    drawn = None
    for image in sequence:
        if image.grey is None:
            continue
        tracked = system.step(image.number, image.grey).tracked
        if tracked is None or tracked.quality is Quality.LOST or system.map is None:
            continue
        seen, uv, ok = tracked.fine.seen, tracked.fine.uv, tracked.fine.ok
        here = sequence.camera.pixel_from_world(tracked.T_cam_world, system.map.X_world[seen.point]).uv
        tried += np.bincount(seen.level, minlength=count)
        for level in range(count):
            rows = ok & (seen.level == level)
            errors[level].append((here - uv)[rows])
        picture = prepare(image.number, image.grey, settings.features)
        drawn = seen.uv, np.where(ok[:, None], uv, np.nan), seen.level
    if drawn is None:
        last = config.first + config.pictures - 1
        raise InputError(f"{config.source}: no map from pictures {config.first} to {last}: give others")
    together = [np.concatenate(e) if e else np.zeros((0, 2)) for e in errors]
    scale = [norm_scale(e).sigma if len(e) >= ENOUGH else np.nan for e in together]
    return Fig21Found(
        picture.number,
        picture.levels,
        tuple(corners.xy for corners in picture.corners),
        *drawn,
        settings.tracker.fine_radius,
        tried,
        np.array([len(e) for e in together]),
        np.array(scale),
    )


# --- claims ---------------------------------------------------------------------------------------


def claims(study: Study[Fig21Found]) -> list[Claim]:
    """Judge what the figure and its text say of the levels."""
    return [_corners(study.once), _sigma(study.once)]


def _corners(found: Fig21Found) -> Claim:
    counts = [len(xy) for xy in found.corners]
    return judged(
        "corners-on-every-level",
        SOURCE,
        "FAST-10 finds corners on every level of the scale space",
        f"at least {HANDFUL} corners on each of the four levels of the picture that is drawn",
        min(counts) >= HANDFUL,
        f"The levels of picture {found.number} have {', '.join(map(str, counts))} corners",
        {"corners": counts},
    )


def _sigma(found: Fig21Found) -> Claim:
    scale = found.scale
    known = np.isfinite(scale)
    growth = (scale[1:] / scale[:-1])[known[1:] & known[:-1]]
    low, high = DOUBLES
    told = ", ".join(f"{s:.2f}" if np.isfinite(s) else "unknown" for s in scale)
    return judged(
        "sigma-doubles-from-level-to-level",
        "A§2.2.1",
        "A point found on level l has an error of sigma = 2^l: it doubles from level to level",
        f"from each level with {ENOUGH} points to the next, the errors' scale grows by {low:g} to {high:g}",
        bool(((growth >= low) & (growth <= high)).all()) if len(growth) else None,
        f"On levels 0 to {len(scale) - 1} the errors have scales of {told} px of level 0; from level to "
        f"level they grow by {', '.join(f'{g:.2f}' for g in growth) or 'nothing that could be measured'}",
        {"scale_px": scale.tolist(), "growth": growth.tolist(), "points": found.seen.tolist()},
    )


def series(study: Study[Fig21Found]) -> dict[str, object]:
    """Counts and scales by level."""
    found = study.once
    return {
        "picture": found.number,
        "corners": [len(xy) for xy in found.corners],
        "tried": found.tried,
        "found": found.seen,
        "scale_px": found.scale,
    }


def arrays(study: Study[Fig21Found]) -> dict[str, Array]:
    """What is drawn."""
    found = study.once
    names = ("expected", "found", "level", "tried", "seen", "scale")
    return {name: np.asarray(getattr(found, name)) for name in names}


def figure(study: Study[Fig21Found]) -> Figure:
    """Levels with corners; expected places, search radii and found places."""
    from vslam_ref.plot.scale_space import scale_space_figure

    found = study.once
    rows = np.linspace(0, len(found.level) - 1, min(SHOWN, len(found.level))).astype(int)
    return scale_space_figure(
        found.levels, found.corners, found.expected[rows], found.found[rows], found.level[rows], found.radius
    )


EXPERIMENT = Experiment(
    id="ptam-fig2.1",
    title="Scale space, corners, and the search for known points",
    source="A, figure 2.1",
    config_type=Fig21Config,
    simulate=None,
    once=look_at,
    series=series,
    claims=claims,
    figure=figure,
    arrays=arrays,
    sample=lambda study: None,
    missing=missing,
    about={
        "expected": "where points were expected in the picture drawn, px; (points, 2)",
        "found": "where they were found, NaN if not, px; (points, 2)",
        "level": "their levels; (points,)",
        "tried": "points tried in all pictures; (levels,)",
        "seen": "points found in all pictures; (levels,)",
        "scale": "standard deviation of one coordinate of their error, px of level 0; (levels,)",
    },
    quick={"pictures": 40},
)

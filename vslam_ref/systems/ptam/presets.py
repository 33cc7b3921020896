"""Named sets of settings: PTAM as it was published, and the system with one part taken out.

``--set preset=NAME`` takes them all; other settings that are given beside it win, in whatever order.  Several
presets add up; two that want different values of one setting are refused.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from vslam_ref.support.config import apply_overrides, replace_settings
from vslam_ref.support.errors import InputError, suggestion
from vslam_ref.systems.ptam.settings import Settings

KEY = "preset"


class PresetChoice(NamedTuple):
    """A setting, by its dotted key, the value that it takes in its own unit, and why."""

    key: str
    value: Any
    reason: str


class Preset(NamedTuple):
    """What a set of settings means, in one sentence, and its choices."""

    meaning: str
    choices: tuple[PresetChoice, ...]

    @property
    def overrides(self) -> dict[str, Any]:
        """Dotted key -> value."""
        return {choice.key: choice.value for choice in self.choices}


PAPER, PROGRAM = "the paper of 2007", "the program that its authors published later; the paper has no number"
NEVER, ALL = 0.0, 1_000_000
PTAM_2007 = (
    PresetChoice(
        "features.least_eigenvalue", 35.0, f"70 in PTAM's unit, which is half of this one: {PROGRAM}"
    ),
    PresetChoice("features.absolute", 32000.0, f"500 squared grey levels for each of 64 pixels: {PROGRAM}"),
    PresetChoice("features.first_refine", False, f"patches are looked for at corners only: {PAPER}"),
    PresetChoice("start.trails", 1000, f"corners that are followed from the first picture: {PAPER}"),
    PresetChoice("tracker.coarse_points", 50, PAPER),
    PresetChoice("tracker.fine_points", 1000, PAPER),
    PresetChoice("tracker.coarse_least", 20, PROGRAM),
    PresetChoice("tracker.radius", (30.0, 30.0, 30.0), f"only the first is used: {PROGRAM}"),
    PresetChoice("tracker.small_image", False, f"a decaying velocity is the only guess: {PAPER}"),
    PresetChoice("tracker.decay", 0.9, PROGRAM),
    PresetChoice("tracker.newest", 0.5, PROGRAM),
    PresetChoice("tracker.follow", False, f"a lost camera is found again by keyframes only: {PAPER}"),
    PresetChoice("keyframe.good_only", True, f"tracking quality must be good: {PAPER}"),
    PresetChoice("keyframe.gap", 21, f"more than twenty pictures since the last keyframe: {PAPER}"),
    PresetChoice("keyframe.gap_starving", 21, f"the same: {PAPER}"),
    PresetChoice("keyframe.far", 0.1, f"least distance from the nearest keyframe, in depths: {PROGRAM}"),
    PresetChoice("keyframe.fewer", NEVER, f"no rule about the number of points: {PAPER}"),
    PresetChoice("keyframe.much_fewer", NEVER, f"no rule about the number of points: {PAPER}"),
    PresetChoice("keyframe.least_inliers", 0, f"no rule about the number of points: {PAPER}"),
    PresetChoice("keyframe.worst_sigma", 4.0, f"no rule about sigma, beyond that of a lost picture: {PAPER}"),
    PresetChoice("mapper.search_back", False, f"a match on the epipolar line is taken as it is: {PAPER}"),
    PresetChoice(
        "mapper.parallax", NEVER, f"the distance of keyframes is trusted to give a base line: {PAPER}"
    ),
    PresetChoice("mapper.partners", 1, f"the closest keyframe: {PAPER}"),
    PresetChoice("mapper.new_points", ALL, f"every strong corner: {PAPER}"),
    PresetChoice("mapper.neighbours", ALL, f"new points are looked for in all keyframes: {PROGRAM}"),
    PresetChoice("mapper.found", NEVER, f"no point dies because it is seldom found: {PAPER}"),
)
PRESETS = {
    "ptam2007": Preset("the constants and rules of PTAM as it was published", PTAM_2007),
    "no_warp": Preset(
        "a patch is compared as it was first seen, on the level that fits its size",
        (PresetChoice("features.warp", False, "the part that is taken out"),),
    ),
    "least_squares": Preset(
        "the tracker and every adjustment minimise squares instead of Tukey's loss",
        (PresetChoice("tracker.loss", "l2", "the part that is taken out"),),
    ),
    "absolute_score": Preset(
        "a patch must be alike by an absolute limit, not by a share of its own contrast",
        (PresetChoice("features.absolute", 32000.0, f"500 for each of 64 pixels: {PROGRAM}"),),
    ),
    "no_search_back": Preset(
        "a match on the epipolar curve is not searched back into its source",
        (PresetChoice("mapper.search_back", False, "the part that is taken out"),),
    ),
    "corners_only": Preset(
        "patches are looked for at corners only, not first where they are expected",
        (PresetChoice("features.first_refine", False, "the part that is taken out"),),
    ),
    "no_following": Preset(
        "a lost camera is found again by keyframes only, not by following the last patches",
        (PresetChoice("tracker.follow", False, "the part that is taken out"),),
    ),
}
"""Name -> preset; the tables of experiments use the same."""


def preset(name: str, base: Settings | None = None) -> Settings:
    """Settings of a preset, on top of others.

    Raises
    ------
    InputError
        If there is no such preset.

    Examples
    --------
    >>> preset("no_warp").features.warp
    False
    """
    if name not in PRESETS:
        raise InputError(f"unknown preset {name!r}{suggestion(name, PRESETS)}; known: {', '.join(PRESETS)}")
    return replace_settings(base or Settings(), PRESETS[name].overrides)


def settings_from(words: Iterable[str]) -> Settings:
    """Settings from ``key=value`` words: presets first, then everything else.

    Raises
    ------
    InputError
        If there is no such preset or setting, a value does not fit, or two presets disagree.

    Examples
    --------
    >>> made = settings_from(["tracker.fine_points=500", "preset=ptam2007"])
    >>> made.tracker.fine_points, made.keyframe.gap
    (500, 21)
    """
    made, others = Settings(), []
    by: dict[str, PresetChoice] = {}
    for word in words:
        key, equals, name = (part.strip() for part in word.partition("="))
        if not (equals and key == KEY):
            others.append(word)
            continue
        made = preset(name, made)
        for choice in PRESETS[name].choices:
            before = by.setdefault(choice.key, choice)
            if before.value != choice.value:
                what = f"{choice.key} is {before.value!r} in one preset, {choice.value!r} in {name}"
                raise InputError(f"{what}: give one of them, and other settings beside it")
    return apply_overrides(made, others)


def lines() -> str:
    """What each preset means, a line each, as ``--help`` shows it."""
    width = max(map(len, PRESETS))
    return "\n".join(f"  {name:{width}s}  {made.meaning}" for name, made in PRESETS.items())

"""Named sets of settings: known keys, reasons, precedence, and that what they take out is out."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.commands import run_ptam
from vslam_ref.support.config import settings
from vslam_ref.support.errors import InputError
from vslam_ref.systems.ptam import Ptam, Quality, Settings, policy
from vslam_ref.systems.ptam.presets import (
    PRESETS,
    Preset,
    PresetChoice,
    lines,
    preset,
    settings_from,
)
from vslam_ref.systems.ptam.settings import KeyframeSettings
from vslam_ref.systems.visual_map import measure

from .conftest import Film, run


@pytest.mark.parametrize("name", PRESETS)
def test_every_choice_has_a_known_key_a_reason_and_its_own_type(name: str) -> None:
    assert PRESETS[name].meaning
    known = {s.key: s.value for s in settings(Settings())}
    for choice in PRESETS[name].choices:
        assert choice.reason.strip()
        assert type(choice.value) is type(known[choice.key]), choice.key
    made = {s.key: s.value for s in settings(preset(name))}
    changed = {key for key, value in made.items() if value != known[key]}
    assert changed <= set(PRESETS[name].overrides)
    assert changed


def test_one_part_is_taken_out_at_a_time() -> None:
    for name, made in PRESETS.items():
        assert (len(made.choices) == 1) == (name != "ptam2007")


def test_other_settings_win_in_whatever_order() -> None:
    for words in (["keyframe.gap=7", "preset=ptam2007"], ["preset=ptam2007", "keyframe.gap=7"]):
        made = settings_from(words)
        assert made.keyframe.gap == 7
        assert made.keyframe.good_only
    both = settings_from(["preset=no_warp", "preset=no_search_back"])
    assert not both.features.warp
    assert not both.mapper.search_back
    assert settings_from([]) == Settings()


def test_presets_add_up_and_two_that_disagree_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    words = [f"preset={name}" for name in PRESETS]
    assert settings_from(words) == settings_from(words[::-1])  # those that are here agree
    other = Preset("another gap", (PresetChoice("keyframe.gap", 3, "a test"),))
    monkeypatch.setitem(PRESETS, "other", other)
    with pytest.raises(InputError, match=r"keyframe\.gap is 21 in one preset, 3 in other: give one"):
        settings_from(["preset=ptam2007", "preset=other"])


@pytest.mark.parametrize(
    ("word", "what"),
    [
        ("preset=ptam2008", "unknown preset 'ptam2008' .did you mean 'ptam2007'"),
        ("preset=", "unknown preset ''"),
        ("preset", "expected key=value"),
        ("presets=no_warp", "unknown setting 'presets'"),
    ],
)
def test_what_is_no_preset_is_told(word: str, what: str) -> None:
    with pytest.raises(InputError, match=what):
        settings_from([word])


def test_the_help_tells_what_the_presets_mean() -> None:
    assert lines() in run_ptam.EPILOG


def test_without_warp_a_patch_is_compared_as_it_was_first_seen(
    film: Film, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Templates on the source's own level are that level's pixels, byte by byte."""
    seen = []
    real = measure.templates

    def templates(visual_map, origin, A, level):  # type: ignore[no-untyped-def]
        found = real(visual_map, origin, A, level)
        seen.append((visual_map, origin, found.patch[level == origin.level], level == origin.level))
        return found

    monkeypatch.setattr(measure, "templates", templates)
    system = Ptam(film.camera, preset("no_warp"))
    for k, grey in enumerate(film.pictures[:16]):
        system.step(k, grey)
    assert system.map is not None
    visual_map, origin, patches, same = seen[-1]
    rows = np.flatnonzero(same & (origin.level == 0))[:20]
    assert len(rows) > 5
    whole = np.rint(origin.uv[rows]).astype(int)
    assert np.abs(whole - origin.uv[rows]).max() < 1e-9  # sources are corners
    place = np.flatnonzero(same)
    for (x, y), kf, row in zip(whole, origin.kf[rows], rows, strict=True):
        patch = patches[np.searchsorted(place, row)]
        assert np.array_equal(patch, visual_map.image(0)[kf, y - 4 : y + 4, x - 4 : x + 4])


def test_ptam_2007_tracks_the_desk_and_keeps_its_gap(film: Film) -> None:
    made = settings_from(["preset=ptam2007", "keyframe.gap=5", "keyframe.gap_starving=5"])
    system = Ptam(film.camera, made)
    outcomes = [system.step(k, grey) for k, grey in enumerate(film.pictures)]
    ways = {o.tracked.way for o in outcomes if o.tracked is not None}
    assert ways <= {"velocity", "relocalised", "none"}
    taken = [o.number for o in outcomes if o.mapped is not None]
    assert taken
    assert min(np.diff([system.started_at[1], *taken])) >= 5  # type: ignore[index]
    good = [o.tracked.quality for o in outcomes if o.mapped is not None and o.tracked is not None]
    assert set(good) == {Quality.GOOD}


def test_a_poor_picture_is_no_keyframe_where_only_good_ones_are(film: Film) -> None:
    done = run(film).system
    assert done.map is not None
    last = done.tracker
    assert last is not None
    tracked = last.track(done.map, done.tracker.last)._replace(quality=Quality.POOR)  # type: ignore[union-attr, arg-type]
    for good_only in (False, True):
        s = KeyframeSettings(good_only=good_only, gap=0, gap_starving=0, far=-1.0, least_inliers=0)
        assert policy.KeyframePolicy(s).wants(done.map, tracked) is not good_only


def test_lost_is_lost_where_nothing_looks_for_the_way_back(film: Film) -> None:
    pictures = [*film.pictures[:20], np.zeros_like(film.pictures[0]), *film.pictures[20:24]]
    found = {}
    for words in ([], ["tracker.follow=false", "tracker.relocalise=false"]):
        system = Ptam(film.camera, settings_from(words))
        outcomes = [system.step(k, grey) for k, grey in enumerate(pictures)]
        found[bool(words)] = [o.tracked.way for o in outcomes[-4:] if o.tracked is not None]
    assert "relocalised" in found[False]
    assert found[True] == ["none"] * 4

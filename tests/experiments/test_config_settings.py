"""``key=value`` is read by the type of the field, and told in one line where it does not fit."""

from __future__ import annotations

from dataclasses import dataclass, field, make_dataclass, replace
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from toy_experiment import Box, ToyConfig

from vslam_ref.support.config import (
    apply_overrides,
    assumptions,
    config_to_dict,
    find_setting,
    format_value,
    parse_value,
    settings,
    without_reason,
)
from vslam_ref.support.errors import InputError

finite = st.floats(allow_nan=False, allow_infinity=False)


@dataclass(frozen=True)
class Every:
    """One field of every kind that can be set."""

    whole: int = 1
    real: float = 1.0
    flag: bool = False
    word: str = "a"
    choice: Literal["x", "y"] = "x"
    reals: tuple[float, ...] = ()
    pair: tuple[int, int] = (0, 0)
    perhaps: float | None = None
    box: Box = field(default_factory=Box)


words = st.text(st.characters(min_codepoint=33, max_codepoint=126), max_size=8)
configs = st.builds(
    Every,
    whole=st.integers(),
    real=finite,
    flag=st.booleans(),
    word=words,
    choice=st.sampled_from(["x", "y"]),
    reals=st.lists(finite, max_size=4).map(tuple),
    pair=st.tuples(st.integers(), st.integers()),
    perhaps=st.none() | finite,
    box=st.builds(Box, side=finite, corners=st.lists(finite, min_size=1, max_size=3).map(tuple)),
)


@given(configs)
def test_every_config_is_reached_from_the_default_by_its_own_text(config):
    text = [f"{s.key}={format_value(s.value)}" for s in settings(config)]
    assert apply_overrides(Every(), text) == config


@given(finite)
def test_a_float_comes_back_bit_for_bit(number):
    assert parse_value(float, format_value(number)).hex() == number.hex()


def test_a_later_setting_wins_and_the_given_config_is_untouched():
    before = ToyConfig()
    after = apply_overrides(before, ["box.side=5", "scale=2", "box.side=7.5"])
    assert after == replace(before, scale=2.0, box=replace(before.box, side=7.5))
    assert before == ToyConfig()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("scale", "expected key=value, such as runs=6"),
        ("=3", "expected key=value"),
        (
            "scal=3",
            r"unknown setting 'scal' \(did you mean 'scale'\?\); known: runs, population, .*box\.side",
        ),
        ("box=3", "unknown setting 'box'"),
        ("side=3", "unknown setting 'side'"),
        ("runs=2.5", "runs=2.5: expected a whole number"),
        ("runs=", "runs=: expected a whole number"),
        ("scale=nan", "expected a finite number"),
        ("scale=inf", "expected a finite number"),
        ("scale=two", "expected a finite number"),
        ("shape=oval", "expected one of round, square"),
        ("box.corners=1,x", "box.corners=1,x: expected a finite number"),
        ("scale=-1", "scale=-1.0: scale -1.0 must be positive"),
    ],
)
def test_a_setting_that_does_not_fit_is_told_in_one_line(text, message):
    with pytest.raises(InputError, match=message) as caught:
        apply_overrides(ToyConfig(), [text])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("declared", "text", "message"),
    [
        (bool, "maybe", "expected true or false"),
        (tuple[int, int], "1,2,3", "expected 2 values separated by commas, got 3"),
        (float | None, "x", "expected a finite number or none"),
        (dict[str, int], "1", "cannot be set from text"),
    ],
)
def test_values_of_other_types_say_what_they_expect(declared, text, message):
    with pytest.raises(ValueError, match=message):
        parse_value(declared, text)


def test_config_is_flat_with_the_keys_that_set_takes():
    flat = config_to_dict(ToyConfig())
    assert flat["box.side"] == 2.0
    assert flat["box.corners"] == [0.0, 1.0]
    assert list(flat) == [s.key for s in settings(ToyConfig())]


def test_an_assumption_shows_its_default_beside_its_value():
    record = {a["key"]: a for a in assumptions(ToyConfig(scale=9.0), ToyConfig())}["scale"]
    assert record == {
        "key": "scale", "value": 9.0, "default": 1.0, "unit": "", "reason": "1 makes the claim true"
    }  # fmt: skip


def test_a_setting_without_a_reason_is_found():
    bare = make_dataclass("Bare", [("x", float, 1.0)], frozen=True)
    assert without_reason(bare()) == ["x"]
    assert without_reason(ToyConfig()) == []


def test_of_two_settings_of_one_name_the_outer_one_is_found():
    inner = make_dataclass("Inner", [("runs", int, 1)], frozen=True)
    outer = make_dataclass("Outer", [("study", inner, inner()), ("runs", int, 2)], frozen=True)
    assert find_setting(outer(), "runs") == "runs"
    assert find_setting(outer(), "nothing") is None

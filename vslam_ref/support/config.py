"""Settings: frozen dataclasses whose every field says why it has its value.

Each field carries ``metadata={"reason": "...", "unit": "..."}``.  A config may hold other configs;
their fields are addressed with a dot, ``field.sigma_v``.  The same dotted names are the keys of
``--set key=value`` and of ``config`` in ``result.json``.
"""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Any, Literal, NamedTuple, TypeVar, Union

from vslam_ref.support.errors import InputError, suggestion

C = TypeVar("C")

_WORDS = {
    "true": True,
    "yes": True,
    "on": True,
    "1": True,
    "false": False,
    "no": False,
    "off": False,
    "0": False,
}


class Setting(NamedTuple):
    """One field of a config: dotted ``key``, declared ``type``, ``value``, ``reason`` and ``unit``."""

    key: str
    type: Any
    value: Any
    reason: str
    unit: str


def assume(default: Any, unit: str, reason: str) -> Any:
    """Declare a field of a config: its default, its unit ("" for none), and why it has this value."""
    return dataclasses.field(default=default, metadata={"reason": reason, "unit": unit})


def settings(config: Any, prefix: str = "") -> Iterator[Setting]:
    """Yield the settings of a config in order, those of configs inside it with dotted keys."""
    hints = typing.get_type_hints(type(config))
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        if dataclasses.is_dataclass(value):
            yield from settings(value, f"{prefix}{field.name}.")
        else:
            about = field.metadata
            yield Setting(
                prefix + field.name, hints[field.name], value, about.get("reason", ""), about.get("unit", "")
            )


def refuse_small(config: Any, at_least_one: Collection[str]) -> None:
    """Refuse numbers of a config that are not finite, negative, or below 1 where one is needed.

    Raises
    ------
    ValueError
        With the first such setting's dotted key; booleans and words are no numbers.
    """
    for setting in settings(config):
        for number in setting.value if isinstance(setting.value, tuple) else (setting.value,):
            if isinstance(number, bool | str):
                continue
            least = 1 if setting.key in at_least_one else 0
            if not (math.isfinite(number) and number >= least):
                raise ValueError(f"{setting.key}={number:g}: need {least} or more")


def find_setting(config: Any, name: str) -> str | None:
    """Return the dotted key of the outermost setting called ``name``, or None."""
    keys = [s.key for s in settings(config) if s.key.rpartition(".")[2] == name]
    return min(keys, key=lambda key: key.count("."), default=None)


def config_to_dict(config: Any) -> dict[str, Any]:
    """Return dotted key -> value; tuples become lists."""
    return {s.key: list(s.value) if isinstance(s.value, tuple) else s.value for s in settings(config)}


def assumptions(config: Any, default: Any) -> list[dict[str, Any]]:
    """Return one record per setting: key, value, default, unit, and the reason of the default."""
    return [
        {"key": now.key, "value": now.value, "default": was.value, "unit": now.unit, "reason": now.reason}
        for now, was in zip(settings(config), settings(default), strict=True)
    ]


def without_reason(config: Any) -> list[str]:
    """Return the keys of the settings that give no reason; empty for every config of the project."""
    return [s.key for s in settings(config) if not s.reason.strip()]


def replace_settings(config: C, values: Mapping[str, Any]) -> C:
    """Return the config with dotted keys replaced by values that already have the right type.

    Raises
    ------
    InputError
        If a key is unknown, or the config's own check refuses the new values.
    """
    known = [s.key for s in settings(config)]
    for key in values:
        if key not in known:
            raise InputError(f"unknown setting {key!r}{suggestion(key, known)}; known: {', '.join(known)}")
    try:
        replaced: C = _replace(config, values)
    except ValueError as error:
        given = ", ".join(f"{key}={value}" for key, value in values.items())
        raise InputError(f"{given}: {error}") from error
    return replaced


def _replace(config: Any, values: Mapping[str, Any]) -> Any:
    """Rebuild the config from its leaves upwards, so that each dataclass checks itself once."""
    own: dict[str, Any] = {key: value for key, value in values.items() if "." not in key}
    for field in dataclasses.fields(config):
        inner = {k.partition(".")[2]: v for k, v in values.items() if k.startswith(f"{field.name}.")}
        if inner:
            own[field.name] = _replace(getattr(config, field.name), inner)
    return dataclasses.replace(config, **own)


def apply_overrides(config: C, overrides: Iterable[str]) -> C:
    """Return the config with ``key=value`` strings applied; a later one wins.

    Values are read by the declared type of the field: ``int``, ``float``, ``bool`` (true/false),
    ``str``, ``Literal``, ``None`` where the type allows it, and tuples as comma-separated values.

    Raises
    ------
    InputError
        If a string has no ``=``, a key is unknown, or a value does not fit its type.
    """
    declared = {s.key: s.type for s in settings(config)}
    values: dict[str, Any] = {}
    for text in overrides:
        key, equals, value = text.partition("=")
        key = key.strip()
        if not equals or not key:
            raise InputError(f"setting {text!r}: expected key=value, such as {_example(config)}")
        if key not in declared:
            raise InputError(
                f"unknown setting {key!r}{suggestion(key, declared)}; known: {', '.join(declared)}"
            )
        try:
            values[key] = parse_value(declared[key], value.strip())
        except ValueError as error:
            raise InputError(f"setting {key}={value}: {error}") from None
    return replace_settings(config, values)


def _example(config: Any) -> str:
    first = next(settings(config), None)
    return f"{first.key}={format_value(first.value)}" if first else "nothing: there are no settings"


def format_value(value: Any) -> str:
    """Write a value so that :func:`parse_value` reads it back.

    Examples
    --------
    >>> format_value((1.0, 0.5)), format_value(True), format_value(None)
    ('1.0,0.5', 'true', 'none')
    """
    if isinstance(value, tuple | list):
        return ",".join(format_value(v) for v in value)
    if value is None or isinstance(value, bool):
        return str(value).lower()
    return str(value)


def parse_value(declared: Any, text: str) -> Any:
    """Read ``text`` as a value of the declared type; ``ValueError`` says what was expected.

    Examples
    --------
    >>> parse_value(tuple[float, ...], "1, 1, 0.001")
    (1.0, 1.0, 0.001)
    """
    origin, arguments = typing.get_origin(declared), typing.get_args(declared)
    if origin in (Union, types.UnionType):
        return _parse_union(arguments, text)
    if origin is Literal:
        for choice in arguments:
            if str(choice) == text:
                return choice
        raise ValueError(f"expected one of {', '.join(map(str, arguments))}")
    if origin is tuple:
        return _parse_tuple(arguments, text)
    if declared not in (bool, int, float, str):
        raise ValueError(f"values of type {declared} cannot be set from text")
    return _parse_scalar(declared, text)


def _parse_scalar(declared: type, text: str) -> bool | int | float | str:
    if declared is bool:
        if text.lower() not in _WORDS:
            raise ValueError("expected true or false")
        return _WORDS[text.lower()]
    if declared is int:
        try:
            return int(text)
        except ValueError:
            raise ValueError("expected a whole number") from None
    if declared is float:
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise ValueError("expected a finite number")
        return number
    return text


def _parse_union(arguments: tuple[Any, ...], text: str) -> Any:
    others = [a for a in arguments if a is not type(None)]
    if len(others) < len(arguments) and text.lower() == "none":
        return None
    problem: ValueError | None = None
    for argument in others:
        try:
            return parse_value(argument, text)
        except ValueError as error:
            problem = error
    raise ValueError(f"{problem}{' or none' if len(others) < len(arguments) else ''}")


def _parse_tuple(arguments: tuple[Any, ...], text: str) -> tuple[Any, ...]:
    parts = [part.strip() for part in text.strip("()[]").split(",") if part.strip()]
    if len(arguments) == 2 and arguments[1] is Ellipsis:
        return tuple(parse_value(arguments[0], part) for part in parts)
    if len(parts) != len(arguments):
        raise ValueError(f"expected {len(arguments)} values separated by commas, got {len(parts)}")
    return tuple(parse_value(kind, part) for kind, part in zip(arguments, parts, strict=True))

"""What a program may reply, read so that nothing in it can harm the run.

::

    line of bytes ---- parse ----> JSON ---- clean ----> a value that can be compared, shown and written
    Python object ------------------------- clean ---->

A number with hundreds of digits becomes infinite, half of a surrogate pair becomes the text of its code, and
what is nested deeper than any answer is refused.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, Protocol

DEEPEST = 32
LONGEST_INTEGER = 300
LONGEST_SENTENCE = 300
TOO_DEEP = "lists in lists, too deep"

What = Literal["value", "unsupported", "error", "timeout", "crash", "garbage"]


class Reply(NamedTuple):
    """What came back: the value, or a message; ``silent`` where nothing came that answers the question."""

    what: What
    value: Any
    message: str
    silent: bool = False


class Asked(Protocol):
    """Something that can be asked."""

    name: str

    def ask(self, identity: str, function: str, inputs: dict[str, Any]) -> Reply:
        """Ask once."""

    def close(self) -> None:
        """Let go."""

    @property
    def alive(self) -> bool:
        """Whether it is known to work: it has replied, or it was imported."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What was odd and did no harm."""


def parse(raw: bytes) -> Any:
    """Read a line of JSON; ValueError where it is none."""
    try:
        return json.loads(raw, parse_int=_whole)
    except RecursionError:
        raise ValueError(TOO_DEEP) from None


def _whole(text: str) -> int | float:
    """A whole number; one with more digits than any double is infinite."""
    return int(text) if len(text) <= LONGEST_INTEGER else float(text)


def clean(value: Any, depth: int = 0) -> Any:
    r"""Return a value in lists, objects, texts and numbers that are safe to handle.

    Raises
    ------
    ValueError
        If something in it is none of these, or it is nested too deep.

    Examples
    --------
    >>> clean((1, 10**400, "a\ud800"))
    [1, inf, 'a\\ud800']
    """
    if depth > DEEPEST:
        raise ValueError(f"lists in lists, more than {DEEPEST} deep")
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, float):
        return float(value)
    if isinstance(value, int):
        small = abs(value) < 10**LONGEST_INTEGER
        return int(value) if small else math.inf if value > 0 else -math.inf
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode()
    if isinstance(value, Mapping):
        return {clean(str(key)): clean(inner, depth + 1) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [clean(inner, depth + 1) for inner in value]
    if hasattr(value, "tolist"):  # arrays and their numbers, of NumPy and others
        return clean(value.tolist(), depth + 1)
    raise ValueError(f"a {type(value).__name__} is no number, text, list or object")


def sentence(text: Any, most: int = LONGEST_SENTENCE) -> str:
    r"""Return any text as part of a line: one row, printable, not too long.

    >>> sentence("two\nrows and a bell \a")
    'two rows and a bell \\x07'
    """
    try:
        words = " ".join(str(text)[: 4 * most].split())
    except Exception as error:  # a program's exception whose text cannot be made
        words = f"a {type(text).__name__} without a text ({type(error).__name__})"
    shown = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in words)
    return shown if len(shown) <= most else f"{shown[:most]} …"


def raised(error: BaseException) -> str:
    """Name and text of an exception, in one line."""
    text = sentence(error)
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def shown_bytes(raw: bytes) -> str:
    """The beginning of a line, for a message."""
    text = raw[:80].decode("utf-8", "backslashreplace").rstrip("\n")
    return f"{text!r}{'…' if len(raw) > 81 else ''}"


def read_reply(content: dict[str, Any], raw: bytes) -> Reply:
    """What an object with the right id says."""
    if content.get("unsupported") is True:
        return Reply("unsupported", None, "")
    if "unusable" in content:  # of a served module: its answer cannot be sent
        return Reply("garbage", None, sentence(content["unusable"]))
    if "error" in content:
        return Reply("error", None, sentence(content["error"]))
    if "value" not in content:
        return Reply("garbage", None, f"neither value, unsupported nor error: {shown_bytes(raw)}")
    try:
        return Reply("value", clean(content["value"]), "")
    except ValueError as error:
        return Reply("garbage", None, f"the value: {error}")

"""Bad input, reported in one line."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class InputError(ValueError):
    """What the user gave cannot be used.

    The message is one line: what is wrong, where, and what would be right.  The command line prints
    it without a traceback and ends with status 2.
    """


def suggestion(word: str, valid: Iterable[str]) -> str:
    """Return ``" (did you mean 'x'?)"`` for the nearest valid word, or an empty string.

    Examples
    --------
    >>> suggestion("iekf-fig22", ["iekf-fig2", "other"])
    " (did you mean 'iekf-fig2'?)"
    >>> suggestion("radius", ["start.radius", "start.trails"])
    " (did you mean 'start.radius'?)"
    >>> suggestion("zzz", ["iekf-fig2"])
    ''
    """
    words = list(valid)
    last = {name.rpartition(".")[2]: name for name in reversed(words)}  # people leave out what stands before
    near = difflib.get_close_matches(word, words, n=1)
    if not near:
        near = [last[name] for name in difflib.get_close_matches(word, list(last), n=1)]
    return f" (did you mean {near[0]!r}?)" if near else ""

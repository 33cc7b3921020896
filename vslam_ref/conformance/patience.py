"""How long a program is asked that gives no usable reply."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from vslam_ref.conformance.replies import Reply

MOST_SILENT = 5
MOST_UNUSABLE = 25
MOST_CRASHES = 5


class Patience:
    """Count replies in a row that are of no use.

    A program is given up when it is silent five times in a row, when its first five replies are of no use, or 25
    in a row; a function is left out when the program ends five times in a row in it.
    """

    def __init__(self) -> None:
        self.left_out: set[str] = set()
        self._silent = self._unusable = self._crashes = 0
        self._answered = False
        self._function = ""

    def judge(self, function: str, reply: Reply) -> str:
        """Take note of a reply; return why the program is given up, or an empty text."""
        if reply.what in ("value", "unsupported", "error"):
            self._answered = True
            self._silent = self._unusable = self._crashes = 0
            return ""
        crashed, same = reply.what == "crash", function == self._function
        self._function = function
        self._unusable += 1
        self._silent = self._silent + 1 if reply.silent and not crashed else 0
        self._crashes = (self._crashes if same else 0) + 1 if crashed else 0
        if self._crashes >= MOST_CRASHES:
            self.left_out.add(function)
            self._crashes = 0
        return self._why(reply)

    def _why(self, reply: Reply) -> str:
        last = f"the last: {reply.what}, {reply.message}"
        if self._silent >= MOST_SILENT:
            return f"given up: silent {MOST_SILENT} times in a row; {last}"
        if self._unusable >= MOST_SILENT and not self._answered:
            return f"given up: no usable reply to its first {MOST_SILENT} questions; {last}"
        if self._unusable >= MOST_UNUSABLE:
            return f"given up: no usable reply {MOST_UNUSABLE} times in a row; {last}"
        return ""

    def notes(self, functions: Iterable[str]) -> tuple[str, ...]:
        """What was left out; ``functions`` are those of all chosen cases."""
        counts = Counter(functions)
        return tuple(
            f"{function}: the program ended {MOST_CRASHES} times in a row; the rest of its {counts[function]} "
            "cases was not asked"
            for function in sorted(self.left_out)
        )

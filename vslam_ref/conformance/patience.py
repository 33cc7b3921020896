"""How long a program is asked that gives no reply."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from vslam_ref.conformance.replies import Reply

MOST_SILENT = 5
MOST_CRASHES = 5
MOST_LOST = 25


class Patience:
    """Count questions in a row that get no reply: the program was silent, or it ended.

    A program is given up when it is silent five times in a row, when it ends at its first five questions, or
    when 25 questions in a row have no reply.  A function is left out when the program ends at five of its
    questions in a row.
    """

    def __init__(self) -> None:
        self.left_out: set[str] = set()
        self._silent = self._lost = self._crashes = 0
        self._function = ""

    def judge(self, function: str, reply: Reply, alive: bool) -> str:
        """Take note of a reply; return why the program is given up, or an empty text.

        Parameters
        ----------
        function : str
            What was asked.
        reply : Reply
        alive : bool
            Whether the program is known to work.
        """
        crashed, same = reply.what == "crash", function == self._function
        self._function = function
        self._lost = self._lost + 1 if reply.silent else 0
        self._silent = self._silent + 1 if reply.silent and not crashed else 0
        self._crashes = (self._crashes if same else 0) + 1 if crashed else 0
        if self._silent >= MOST_SILENT:
            return self._given_up(f"silent {MOST_SILENT} times in a row", reply)
        if self._lost >= MOST_CRASHES and not alive:
            return self._given_up(f"no reply to its first {MOST_CRASHES} questions", reply)
        if self._lost >= MOST_LOST:
            return self._given_up(f"no reply {MOST_LOST} times in a row", reply)
        if self._crashes >= MOST_CRASHES:
            self.left_out.add(function)
            self._crashes = 0
        return ""

    @staticmethod
    def _given_up(why: str, reply: Reply) -> str:
        return f"given up: {why}; the last: {reply.what}, {reply.message}"

    def notes(self, functions: Iterable[str]) -> tuple[str, ...]:
        """What was left out; ``functions`` are those of all chosen cases."""
        counts = Counter(functions)
        return tuple(
            f"{function}: the program ended {MOST_CRASHES} times in a row; not all of its {counts[function]} "
            "cases were asked"
            for function in sorted(self.left_out)
        )

"""Asking a foreign program: one line of JSON each way; its failures become replies.

* Request: ``{"id": "…", "function": "so3.exp", "inputs": {"phi": [0.1, 0.2, 0.3]}}``
* Reply: ``{"id": "…", "value": {"R": [[…], […], […]]}}``, or ``{"id": "…", "unsupported": true}``, or
  ``{"id": "…", "error": "…"}``.  A function with one output may reply with the bare value.

A program that is silent, dies, prints rubbish or half a line gives a :class:`Reply` that says so.  A Python
module is asked in a process of its own, by the same protocol (:class:`ModuleProgram`), or in this one
(:class:`InProcess`), for modules that are trusted.
"""

from __future__ import annotations

import json
import shlex
import sys
import time
from collections.abc import Callable
from types import ModuleType
from typing import Any

from vslam_ref.conformance.hints import not_executable, unquoted
from vslam_ref.conformance.lines import LineProcess, Received
from vslam_ref.conformance.loading import load_module
from vslam_ref.conformance.replies import (
    TOO_DEEP,
    Asked,
    Reply,
    clean,
    parse,
    raised,
    read_reply,
    sentence,
    shown_bytes,
)

__all__ = ["Asked", "InProcess", "ModuleProgram", "Program", "Reply", "load_module"]

MOST_STRAY_LINES = 10_000
WAIT_AFTER_STRAY = 1.0
"""Seconds that a reply may take after a line that is none, until one came after such lines."""
SECONDS_TO_IMPORT = 60.0

CHILD = (
    "import sys; sys.path[:] = sys.argv[1].split(chr(10))\n"  # what stands in the folder shadows nothing
    "from vslam_ref.conformance.serve import child; sys.exit(child(sys.argv[2]))"
)


class InProcess:
    """A module with ``answer(function, inputs)``; NotImplementedError is "unsupported", others are errors."""

    notes: tuple[str, ...] = ()
    alive = True

    def __init__(self, module: ModuleType | str) -> None:
        if isinstance(module, str):
            try:
                module = load_module(module)
            except ImportError as error:
                raise ValueError(f"--module {module}: {error}") from None
        answer = getattr(module, "answer", None)
        if not callable(answer):
            raise ValueError(f"module {module.__name__} has no function answer(function, inputs)")
        self.name = module.__name__
        self._answer: Callable[[str, dict[str, Any]], Any] = answer

    def ask(self, identity: str, function: str, inputs: dict[str, Any]) -> Reply:
        """Ask once."""
        try:
            value = self._answer(function, inputs)
        except NotImplementedError:
            return Reply("unsupported", None, "")
        except SystemExit as error:
            return Reply("crash", None, f"it wants to end the program: {raised(error)}")
        except Exception as error:  # whatever a program does is a result
            return Reply("error", None, raised(error))
        try:
            return Reply("value", clean(value), "")
        except (ValueError, RecursionError) as error:
            return Reply("garbage", None, f"the value: {sentence(error)}")

    def close(self) -> None:
        """Nothing to let go."""


class Program:
    """A program that runs beside us and answers lines.

    Parameters
    ----------
    command : str
        Split as a shell would; no shell is started.
    timeout : float
        Seconds to wait for a reply.
    show_errors : bool
        Whether what it writes to standard error is shown.

    Raises
    ------
    ValueError
        If it cannot be started.
    """

    def __init__(self, command: str, timeout: float = 10.0, *, show_errors: bool = False) -> None:
        try:
            words = shlex.split(command)
        except ValueError as error:
            raise ValueError(f"--program {command!r}: {error}") from None
        if not words:
            raise ValueError("--program: no command given")
        self._prepare(command, words, timeout, show_errors)
        try:
            self._start()
        except OSError as error:
            hint = unquoted(command, words) or not_executable(error, words[0])
            raise ValueError(f"--program {command!r}: {error.strerror}: {words[0]}{hint}") from None

    def _prepare(self, name: str, words: list[str], timeout: float, show_errors: bool) -> None:
        self.name, self.words, self.timeout = sentence(name, 1000), words, timeout
        self.show_errors = show_errors
        self.starts, self._seconds_to_start = 0, 0.0
        self._known = False  # it has replied, now or before it was started again
        self._stray, self._first_stray, self._late = 0, "", 0
        self._timed_out: set[str] = set()
        self._before_late = ""  # a line that is no reply, after which no reply came in time

    def _start(self) -> None:
        self._process = LineProcess(self.words, self.show_errors)
        self.starts += 1
        self._began, self._replied, self._silences = time.monotonic(), False, 0
        self._timed_out.clear()

    def ask(self, identity: str, function: str, inputs: dict[str, Any]) -> Reply:
        """Ask once; a program that ended, or hangs, is started again."""
        while identity in self._timed_out:  # the late answer to the first time is none to the second
            identity += "+"
        line = json.dumps({"id": identity, "function": function, "inputs": inputs})
        try:
            if self._process.ended:
                self._process.kill()  # what it started may live
                self._start()
            before, busy = self._replied, self._silences > 0 and self._known
            reply = self._once(identity, line.encode() + b"\n")
            ended = reply.what == "crash" and before and self._process.status == 0
            if ended or (busy and reply.what == "timeout"):  # because of the question before this one
                self._start()
                reply = self._once(identity, line.encode() + b"\n")
        except (OSError, ValueError) as error:
            return Reply("crash", None, f"the program cannot be started again: {raised(error)}", True)
        return reply

    def _once(self, identity: str, line: bytes) -> Reply:
        sent = self._process.send(line, self.timeout)
        if sent == "closed":
            return self._died("")
        if sent == "stuck":
            self._process.kill()
            told = f"the program does not read its input within {self.timeout:g} s"
            return Reply("timeout", None, told, True)
        return self._listen(identity)

    def _listen(self, identity: str) -> Reply:
        """Wait for the reply; pass over what is none."""
        patience = self.timeout + (self._seconds_to_start if self.starts > 1 and not self._replied else 0.0)
        end, stray, first = time.monotonic() + patience, 0, ""
        while stray < MOST_STRAY_LINES:
            got = self._process.receive(end - time.monotonic())
            if got.kind == "nothing":
                return self._silent(identity, first)
            if got.kind == "end":
                return self._died(first)
            if got.kind == "line" and not got.raw.strip():
                continue
            content, why = _object(got, identity)
            if content is not None and content.get("id") == identity:
                self._has_replied(stray, first)
                return read_reply(content, got.raw)
            if content is not None and content.get("id") in self._timed_out:
                self._has_replied(bool(self._before_late), self._before_late)
                self._late, self._before_late = self._late + 1, ""
                end = time.monotonic() + self.timeout
                continue
            if content is None and got.kind != "half" and identity.encode() in got.raw[:1000]:
                self._has_replied(stray, first)
                return Reply("garbage", None, why)
            stray, first = stray + 1, first or why
            if stray == 1 and not self._stray:
                end = min(end, time.monotonic() + WAIT_AFTER_STRAY)
        self._process.kill()
        return Reply("garbage", None, f"{stray} lines that are no reply, the first {first}", True)

    def _has_replied(self, stray: int, first: str) -> None:
        if not self._known:
            self._seconds_to_start = time.monotonic() - self._began
        self._replied = self._known = True
        self._silences = 0
        self._process.forget()
        self._stray, self._first_stray = self._stray + stray, self._first_stray or first

    def _silent(self, identity: str, first: str) -> Reply:
        """No reply in time.

        The first time it may be slow, as with a start or with compiling: what comes while the next question
        waits is a late reply.  The second time it hangs, and is stopped.
        """
        self._timed_out.add(identity)
        if first:
            self._before_late = first
            return Reply("garbage", None, f"{first}; no reply followed", True)
        self._silences += 1
        if self._silences > 1:
            self._process.kill()
        return Reply("timeout", None, f"no reply within {self.timeout:g} s", True)

    def _died(self, first: str) -> Reply:
        how = self._process.end()
        said = f"; before that it wrote {first}" if first else ""
        hint = "" if self._known else unquoted(self.name, self.words)
        what: Any = "garbage" if first.startswith("half a line") else "crash"
        message = f"{first}; then the program {how}" if what == "garbage" else f"the program {how}{said}"
        return Reply(what, None, f"{message}{hint}", True)

    @property
    def alive(self) -> bool:
        """Whether it has replied, or was imported."""
        return self._known

    @property
    def notes(self) -> tuple[str, ...]:
        """What was odd and did no harm."""
        told = []
        if self._stray:
            told.append(
                f"lines on standard output that are no replies, passed over: {self._stray}, the first "
                f"{self._first_stray}; messages may go to standard error"
            )
        if self._late:
            told.append(f"replies that came too late: {self._late} (--timeout {self.timeout:g})")
        if self.starts > 1:
            told.append(f"the program was started {self.starts} times: it ended, or hung and was stopped")
        return tuple(told)

    def close(self) -> None:
        """End the program: first by closing its input, then by force."""
        self._process.close()


class ModuleProgram(Program):
    """A Python module in a process of its own: it may hang, end or crash, and print what it likes.

    Raises
    ------
    ValueError
        If it cannot be imported, or has no ``answer``.
    """

    def __init__(self, module: str, timeout: float = 10.0, *, show_errors: bool = False) -> None:
        words = [sys.executable, "-X", "faulthandler", "-c", CHILD, "\n".join(sys.path), module]
        self._prepare(module, words, timeout, show_errors)
        try:
            self._start()
        except ValueError as error:
            self._process.close()
            raise ValueError(f"--module {module}: {error}") from None

    def _start(self) -> None:
        super()._start()
        seconds = max(SECONDS_TO_IMPORT, self.timeout)
        got = self._process.receive(seconds)
        if got.kind == "nothing":
            self._process.kill()
            raise ValueError(f"it is not imported within {seconds:g} s")
        if got.kind != "line":
            raise ValueError(f"the process that imports it {self._process.end()}")
        content, why = _object(got, "ready")
        if not content:
            raise ValueError(f"the process that imports it wrote {why}")
        if "refused" in content:
            raise ValueError(content["refused"])
        self._replied = self._known = True
        self._process.forget()


def _object(got: Received, identity: str) -> tuple[dict[str, Any] | None, str]:
    """The object in a line, or why there is none; what is said of an object that answers nothing."""
    if got.kind != "line":
        words = {"half": "half a line", "long": "a line that is too long"}[got.kind]
        return None, f"{words}: {shown_bytes(got.raw)}"
    try:
        content = parse(got.raw)
    except ValueError as error:
        deep = str(error) == TOO_DEEP
        return None, f"{TOO_DEEP if deep else 'not JSON'}: {shown_bytes(got.raw)}"
    if not isinstance(content, dict):
        return None, f"not an object: {shown_bytes(got.raw)}"
    if not isinstance(content.get("id"), str):
        return {}, f"a reply without the id {identity!r} of its question: {shown_bytes(got.raw)}"
    return content, f"a reply with another id than {identity!r}: {shown_bytes(got.raw)}"

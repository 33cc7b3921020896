"""Asking a foreign program: one line of JSON each way; its failures become replies.

* Request: ``{"id": "…", "function": "so3.exp", "inputs": {"phi": [0.1, 0.2, 0.3]}}``
* Reply: ``{"id": "…", "value": {"R": [[…], […], […]]}}``, or ``{"id": "…", "unsupported": true}``, or
  ``{"id": "…", "error": "…"}``.  A function with one output may reply with the bare value.

A program that is silent, dies, prints rubbish or half a line gives a :class:`Reply` that says so.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import json
import queue
import shlex
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, NamedTuple, Protocol

LONGEST_LINE = 64 * 2**20
MOST_RESTARTS = 5
MOST_STRAY_LINES = 100

What = Literal["value", "unsupported", "error", "timeout", "crash", "garbage"]


class Reply(NamedTuple):
    """What came back: the value, or a message."""

    what: What
    value: Any
    message: str


class Asked(Protocol):
    """Something that can be asked."""

    name: str

    def ask(self, identity: str, function: str, inputs: dict[str, Any]) -> Reply:
        """Ask once."""

    def close(self) -> None:
        """Let go."""


def load_module(name: str) -> ModuleType:
    """Import a module by its dotted name, or from a file ``*.py`` whose folder it may import from.

    Raises
    ------
    ImportError
        If there is no such module or file, or it imports what is not installed.
    """
    if not name.endswith(".py"):
        return importlib.import_module(name)
    path = Path(name).resolve()
    if not path.is_file():
        raise ImportError(f"no such file: {name}")
    if str(path.parent) not in sys.path:
        sys.path.insert(0, str(path.parent))
    return importlib.import_module(path.stem)


class InProcess:
    """A module with ``answer(function, inputs)``; NotImplementedError is "unsupported", others are errors."""

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
            return Reply("value", self._answer(function, inputs), "")
        except NotImplementedError:
            return Reply("unsupported", None, "")
        except Exception as error:  # whatever a program does is a result
            return Reply("error", None, f"{type(error).__name__}: {error}")

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

    Raises
    ------
    ValueError
        If it cannot be started.
    """

    def __init__(self, command: str, timeout: float = 10.0) -> None:
        try:
            self.words = shlex.split(command)
        except ValueError as error:
            raise ValueError(f"--program {command!r}: {error}") from None
        if not self.words:
            raise ValueError("--program: no command given")
        self.name, self.timeout, self.starts = command, timeout, 0
        self._start()

    def _start(self) -> None:
        try:
            self._process = subprocess.Popen(
                self.words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
            )
        except OSError as error:
            raise ValueError(f"--program {self.name!r}: {error.strerror}: {self.words[0]}") from None
        self.starts += 1
        self._lines: queue.Queue[bytes | None] = queue.Queue()
        threading.Thread(target=_pump, args=(self._process, self._lines), daemon=True).start()

    def ask(self, identity: str, function: str, inputs: dict[str, Any]) -> Reply:
        """Ask once; a program that died is started again, at most five times in all."""
        if self._process.poll() is not None:
            if self.starts > MOST_RESTARTS:
                return Reply("crash", None, f"the program ended {self.starts} times and is not started again")
            self._start()
        line = json.dumps({"id": identity, "function": function, "inputs": inputs})
        sent = self._send(line.encode() + b"\n")
        return self._reply(identity) if sent is None else sent

    def _send(self, line: bytes) -> Reply | None:
        """Write a line; a program that does not read it is stopped after the timeout."""
        failed = threading.Event()

        def write() -> None:
            try:
                assert self._process.stdin is not None
                self._process.stdin.write(line)
                self._process.stdin.flush()
            except (OSError, ValueError):
                failed.set()

        writer = threading.Thread(target=write, daemon=True)
        writer.start()
        writer.join(self.timeout)
        if writer.is_alive():
            self._process.kill()
            return Reply("timeout", None, f"the program does not read its input within {self.timeout:g} s")
        return self._died() if failed.is_set() else None

    def _reply(self, identity: str) -> Reply:
        for _ in range(MOST_STRAY_LINES):
            try:
                raw = self._lines.get(timeout=self.timeout)
            except queue.Empty:
                return Reply("timeout", None, f"no reply within {self.timeout:g} s")
            if raw is None:
                return self._died()
            if not raw.endswith(b"\n"):
                return Reply("garbage", None, f"half a line: {_shown(raw)}")
            try:
                content = json.loads(raw)
            except (json.JSONDecodeError, UnicodeDecodeError, RecursionError):
                return Reply("garbage", None, f"not JSON: {_shown(raw)}")
            if not isinstance(content, dict):
                return Reply("garbage", None, f"not an object: {_shown(raw)}")
            if content.get("id") != identity:
                continue  # the late answer to a question that timed out
            return _read(content, raw)
        return Reply("garbage", None, f"{MOST_STRAY_LINES} lines that answer another question")

    def _died(self) -> Reply:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=1.0)
        return Reply("crash", None, f"the program ended with status {self._process.poll()}")

    def close(self) -> None:
        """End the program: first by closing its input, then by force."""
        with contextlib.suppress(OSError):
            assert self._process.stdin is not None
            self._process.stdin.close()
        try:
            self._process.wait(timeout=2.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def _read(content: dict[str, Any], raw: bytes) -> Reply:
    if content.get("unsupported") is True:
        return Reply("unsupported", None, "")
    if "error" in content:
        return Reply("error", None, str(content["error"]))
    if "value" in content:
        return Reply("value", content["value"], "")
    return Reply("garbage", None, f"neither value, unsupported nor error: {_shown(raw)}")


def _pump(process: subprocess.Popen[bytes], lines: queue.Queue[bytes | None]) -> None:
    """Read lines until the end; a line without end is cut."""
    assert process.stdout is not None
    while True:
        line = process.stdout.readline(LONGEST_LINE)
        if not line:
            lines.put(None)
            return
        lines.put(line)


def _shown(raw: bytes) -> str:
    text = raw[:80].decode("utf-8", "backslashreplace").rstrip("\n")
    return f"{text!r}{'…' if len(raw) > 80 else ''}"

"""A process that is written and read line by line, and never waited for longer than said.

::

    send ----> stdin  [process]  stdout ----> thread ----> receive: a line, silence, or the end
                                 stderr ----> thread ----> last_words, for whoever asks why it ended

The process leads a group of its own: what it starts is ended with it, and Ctrl-C reaches the runner only.
"""

from __future__ import annotations

import contextlib
import os
import queue
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from typing import IO, Literal, NamedTuple

from vslam_ref.conformance.replies import sentence

LONGEST_LINE = 16 * 2**20
LINES_WAITING = 8
LAST_BYTES = 8000
SECONDS_TO_END = 2.0

TELLING = re.compile(r"error|exception|panic|terminate called|what\(\)|fault|abort", re.IGNORECASE)
PLACE = re.compile(r'^\s*File "([^"]+)", line (\d+)')


class Received(NamedTuple):
    """What came: a whole line, half a line before the end, one that is too long, the end, or nothing yet."""

    kind: Literal["line", "half", "long", "end", "nothing"]
    raw: bytes


class LineProcess:
    """Start a process.

    Parameters
    ----------
    words : sequence of str
        The command; no shell is started.
    show_errors : bool
        Whether what it writes to standard error is shown as well.

    Raises
    ------
    OSError
        If it cannot be started.
    """

    def __init__(self, words: Sequence[str], show_errors: bool = False) -> None:
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(words, stdin=pipe, stdout=pipe, stderr=pipe, start_new_session=True)
        self._lines: queue.Queue[Received] = queue.Queue(LINES_WAITING)
        self._last = bytearray()
        self._writer: threading.Thread | None = None
        out, errors = self._process.stdout, self._process.stderr
        assert out is not None
        assert errors is not None
        threading.Thread(target=_pump, args=(out, self._lines), daemon=True).start()
        self._listener = threading.Thread(target=self._keep, args=(errors, show_errors), daemon=True)
        self._listener.start()

    def _keep(self, errors: IO[bytes], show: bool) -> None:
        """Keep the end of what is written to standard error."""
        while chunk := errors.read1(4096):  # type: ignore[attr-defined]
            self._last += chunk
            del self._last[:-LAST_BYTES]
            if show:
                sys.stderr.write(chunk.decode("utf-8", "backslashreplace"))
                sys.stderr.flush()

    def send(self, line: bytes, timeout: float) -> Literal["sent", "stuck", "closed"]:
        """Write a line; a process that does not read it is stuck."""
        failed = threading.Event()

        def write() -> None:
            try:
                assert self._process.stdin is not None
                self._process.stdin.write(line)
                self._process.stdin.flush()
            except (OSError, ValueError):
                failed.set()

        self._writer = threading.Thread(target=write, daemon=True)
        self._writer.start()
        self._writer.join(timeout)
        if self._writer.is_alive():
            return "stuck"
        return "closed" if failed.is_set() else "sent"

    def receive(self, timeout: float) -> Received:
        """Wait for a line."""
        try:
            return self._lines.get(timeout=max(timeout, 1e-3))
        except queue.Empty:
            return Received("nothing", b"")

    def forget(self) -> None:
        """Forget what was written to standard error until now: it tells nothing of what comes."""
        self._last.clear()

    @property
    def ended(self) -> bool:
        """Whether it has ended."""
        return self._process.poll() is not None

    @property
    def status(self) -> int | None:
        """Its exit status, or None while it runs."""
        return self._process.poll()

    def end(self) -> str:
        """End it by force if it has not ended; say how it ended, and its last words."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=1.0)
        how = "closed its standard output" if not self.ended else _status(self._process.returncode)
        self.kill()
        self._listener.join(1.0)
        words = last_words(bytes(self._last).decode("utf-8", "backslashreplace"))
        return f"{how}: {words}" if words else how

    def kill(self) -> None:
        """End it, and what it started, by force."""
        with contextlib.suppress(OSError):
            if hasattr(os, "killpg"):
                os.killpg(self._process.pid, signal.SIGKILL)
            else:
                self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """End it: first by closing its input, then by force."""
        if self._writer is not None and self._writer.is_alive():
            self.kill()
        with contextlib.suppress(OSError, ValueError):
            assert self._process.stdin is not None
            self._process.stdin.close()
        try:
            self._process.wait(timeout=SECONDS_TO_END)
        except subprocess.TimeoutExpired:
            self.kill()


def _pump(out: IO[bytes], lines: queue.Queue[Received]) -> None:
    """Pass lines on until the end; of one that is too long only the beginning."""
    while raw := out.readline(LONGEST_LINE):
        if raw.endswith(b"\n"):
            lines.put(Received("line", raw))
        elif len(raw) < LONGEST_LINE:
            lines.put(Received("half", raw))
        else:
            lines.put(Received("long", raw[:100]))
            while (rest := out.readline(LONGEST_LINE)) and not rest.endswith(b"\n"):
                pass
    lines.put(Received("end", b""))


def _status(code: int) -> str:
    if code >= 0:
        return f"ended with status {code}"
    with contextlib.suppress(ValueError):
        return f"was ended by the signal {signal.Signals(-code).name}"
    return f"was ended by the signal {-code}"


def last_words(text: str) -> str:
    r"""The line of an error's text that says most, with its place where Python tells one.

    Examples
    --------
    >>> last_words('  File "mine.py", line 3\n    x = = 1\nSyntaxError: invalid syntax\n')
    'SyntaxError: invalid syntax (mine.py, line 3)'
    """
    lines = [line for line in text.splitlines() if line.strip()]
    if not lines:
        return ""
    telling = [k for k, line in enumerate(lines) if TELLING.search(line) and not PLACE.match(line)]
    fatal = [k for k in telling if lines[k].startswith("Fatal Python error")]
    at = fatal[-1] if fatal else telling[-1] if telling else len(lines) - 1
    around = lines[at:] if fatal else lines[at - 1 :: -1] if at else []
    places = [f"{m[1]}, line {m[2]}" for m in map(PLACE.match, around) if m]
    place = f" ({places[0]})" if places else ""
    return sentence(lines[at].strip(), 200) + place

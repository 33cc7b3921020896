"""Ctrl-C between two pictures: the first asks for an end, a second one ends at once."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Interrupts:
    """Whether somebody pressed Ctrl-C; ``ends`` says what then happens."""

    def __init__(self) -> None:
        self.asked = False
        self.ends = "saving the run so far (again: stop at once, save nothing)"

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Take the signal: remember the first, raise at the second."""
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True
        print(
            f"\nvslam-ref: interrupted; {self.ends}",
            file=sys.stderr,
        )


@contextmanager
def interrupts() -> Iterator[Interrupts]:
    """Yield what tells of a Ctrl-C inside the block; outside of the main thread, nothing is changed."""
    found = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield found
        return
    before = signal.signal(signal.SIGINT, found)
    try:
        yield found
    finally:
        signal.signal(signal.SIGINT, before)

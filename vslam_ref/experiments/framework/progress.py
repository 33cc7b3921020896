"""What a person who waits is shown on stderr: runs done of runs asked, and the one compilation."""

from __future__ import annotations

import sys
import threading
import time


class Progress:
    """How many runs are done: a bar on a terminal, elsewhere a line on stderr every 20 seconds.

    Parameters
    ----------
    label : str
        What is run.
    total, done : int
        Runs asked for, and runs that were done before.
    shown : bool
        Whether to show anything.
    """

    EVERY = 20.0
    """Seconds from line to line."""

    def __init__(self, label: str, total: int, done: int, shown: bool) -> None:
        self.label, self.total, self.done = label, total, done
        self.start = self.last = time.perf_counter()
        self.shown, self.bar = shown, None
        if shown and done:
            print(f"{label}: {done} of {total} runs were done before", file=sys.stderr, flush=True)
        if shown and sys.stderr.isatty():
            from tqdm import tqdm

            self.bar = tqdm(
                total=total,
                initial=done,
                desc=label,
                unit=" runs",
                leave=False,
                disable=None,
                file=sys.stderr,
            )

    def add(self, runs: int) -> None:
        """Count finished runs."""
        self.done += runs
        if self.bar is not None:
            self.bar.update(runs)
        elif self.shown and time.perf_counter() - self.last >= self.EVERY:
            self.last = time.perf_counter()
            seconds = self.last - self.start
            print(
                f"{self.label}: {self.done} of {self.total} runs, {seconds:.0f} s",
                file=sys.stderr,
                flush=True,
            )

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self.bar is not None:
            self.bar.close()


WAIT = 3.0
"""Seconds of silence that a person is spared: reading kernels from the disk is quicker, compiling is not."""
_compiled: list[str] = []


def compile_once() -> None:
    """Compile the Numba kernels, or read them from the disk, once in this process; say so if it takes long.

    Workers then find them on the disk instead of compiling them each for itself.
    """
    from vslam_ref import _kernels

    if _kernels.backend() != "numba" or _compiled:
        return
    say = "preparing the Numba kernels: they are compiled once, later runs read them from the disk ..."
    timer = threading.Timer(WAIT, lambda: print(say, file=sys.stderr, flush=True))
    timer.daemon = True
    start = time.perf_counter()
    timer.start()
    try:
        _kernels.warm()
    finally:
        timer.cancel()
    seconds = time.perf_counter() - start
    _compiled.append("numba")
    if seconds >= WAIT:
        print(f"kernels ready after {seconds:.0f} s", file=sys.stderr, flush=True)

"""Thousands of damaged files for every reader: each must give a valid record, or one line that names it.

    python tests/datasets/fuzz_readers.py                       10,000 files a reader
    python tests/datasets/fuzz_readers.py --count 500 --seed 3
    python tests/datasets/fuzz_readers.py --reader bal --only 417       one file again, with what was done
    to it

Everything else is a defect: another exception, a warning, a message of several lines, a record with a NaN, or
more than a few seconds.  File number k of a reader is made from (seed, reader, k) alone, so each is found
again.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import sys
import tempfile
import threading
import time
import traceback
import warnings
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import NoReturn

import numpy as np
from damaging import mutate
from reader_samples import SAMPLES, Sample, reader
from sequence_samples import put

from vslam_ref.datasets.text import FormatError

LIMIT = 5.0
"""Seconds for one small file, by the clock: then it is stopped."""
PROCESSOR = 1.0
"""Seconds for one small file of the processor's time, which a busy machine does not lengthen."""
LONGEST_MESSAGE = 600
"""Characters of a message beside the file's name: a line that a person reads."""


class TooLongError(BaseException):
    """Raised inside a reader that takes too long; no ``except Exception`` swallows it."""


@dataclass
class Tally:
    """What became of the files of one reader."""

    records: int = 0
    refused: int = 0
    seconds: float = 0.0
    slowest: float = 0.0
    defects: list[str] = field(default_factory=list)


@contextlib.contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Stop the block after some seconds, where the system has a timer for it."""
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, frame: FrameType | None) -> NoReturn:
        raise TooLongError

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def judge(name: str, sample: Sample, folder: Path) -> tuple[str, str]:
    """Read the files of a folder: ("record" or "refused" or "defect", and what the defect is)."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        begin = time.process_time()
        try:
            with time_limit(LIMIT):
                record = reader(name)(*sample.given(folder))
        except FormatError as error:
            verdict, told = "refused", message_wrong(str(error), folder)
        except TooLongError:
            return "defect", f"took more than {LIMIT:g} s"
        except Exception as error:
            where = traceback.extract_tb(error.__traceback__)[-1]
            place = f"{Path(where.filename).name}:{where.lineno}"
            return "defect", f"{type(error).__name__} at {place}: {' '.join(str(error).split())[:200]}"
        else:
            verdict, told = "record", sample.wrong(record)
    taken = time.process_time() - begin
    if taken > PROCESSOR:
        told = f"took {taken:.1f} s of the processor"
    if not told and caught:
        told = f"warns: {caught[0].category.__name__}: {caught[0].message}"
    return ("defect", told) if told else (verdict, "")


def message_wrong(message: str, folder: Path) -> str:
    """What is wrong with a message, or ""."""
    if not message.startswith(str(folder)):
        return f"message does not begin with the file's name: {message[:120]!r}"
    rest = message[len(str(folder)) :]
    if not rest.isprintable():
        return f"message has line ends or control characters: {rest[:200]!r}"
    if len(rest) > LONGEST_MESSAGE:
        return f"message of {len(rest)} characters: {rest[:100]!r}…"
    return ""


def damage(name: str, k: int, seed: int) -> tuple[Sample, str, bytes, tuple[str, ...]]:
    """File number k of a reader: the sample, which file of it, the damaged bytes, and the steps."""
    rng = np.random.default_rng([seed, zlib.crc32(name.encode()), k])
    samples = SAMPLES[name]
    sample = samples[k % len(samples)]
    files = list(sample.files)
    file = files[rng.integers(len(files))]
    mutated = mutate(sample.files[file], rng, binary=sample.binary or file.endswith(".mat"))
    return sample, file, mutated.data, mutated.steps


@contextlib.contextmanager
def scratch() -> Iterator[Path]:
    """A folder in memory, where there is one: a disk takes a hundred times as long."""
    memory = Path("/dev/shm")
    usable = memory.is_dir() and os.access(memory, os.W_OK)
    with tempfile.TemporaryDirectory(dir=memory if usable else None) as name:
        yield Path(name)


def fuzz(name: str, numbers: range, seed: int, root: Path) -> Tally:
    """Judge some damaged files of one reader."""
    tally = Tally()
    folders: dict[int, Path] = {}
    for k in numbers:
        sample, file, data, steps = damage(name, k, seed)
        which = k % len(SAMPLES[name])
        if which not in folders:
            folders[which] = root / str(which)
            folders[which].mkdir()
            put(folders[which], sample.files)
        path = folders[which] / file
        path.write_bytes(data)
        begin = time.perf_counter()
        verdict, told = judge(name, sample, folders[which])
        taken = time.perf_counter() - begin
        if len(sample.files) > 1:
            path.write_bytes(sample.files[file])
        tally.seconds += taken
        tally.slowest = max(tally.slowest, taken)
        if verdict == "record":
            tally.records += 1
        elif verdict == "refused":
            tally.refused += 1
        else:
            again = f"--reader {name} --only {k} --seed {seed}"
            tally.defects.append(f"{again} ({file}: {', '.join(steps)}): {told}")
    return tally


def main(arguments: list[str] | None = None) -> int:
    """Run the command; 1 if there is a defect."""
    parser = argparse.ArgumentParser(description="Damage files of every reader and see what it says.")
    parser.add_argument("--count", type=int, default=10_000, help="files a reader (10000)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--reader", default="", help="only readers whose name contains this")
    parser.add_argument("--only", type=int, help="only the file of this number, shown")
    given = parser.parse_args(arguments)
    names = [name for name in SAMPLES if given.reader in name]
    if not names:
        parser.error(f"no reader has {given.reader!r} in its name; there are {', '.join(SAMPLES)}")
    numbers = range(given.count) if given.only is None else range(given.only, given.only + 1)
    defects = 0
    print(f"{'reader':45} {'records':>8} {'refused':>8} {'defects':>8} {'seconds':>8} {'slowest':>8}")
    for name in names:
        with scratch() as root:
            tally = fuzz(name, numbers, given.seed, root)
        counts = f"{tally.records:8} {tally.refused:8} {len(tally.defects):8}"
        print(f"{name:45} {counts} {tally.seconds:8.1f} {tally.slowest:8.3f}", flush=True)
        for told in tally.defects[:5]:
            print(f"    {told}")
        if given.only is not None:
            _, file, data, steps = damage(name, given.only, given.seed)
            print(f"    {file}: {', '.join(steps)}\n{data[:2000]!r}")
        defects += len(tally.defects)
    print(f"{len(names)} readers, {len(numbers)} files each, {defects} defects")
    return 1 if defects else 0


if __name__ == "__main__":
    sys.exit(main())

"""What several commands share: arguments, checked targets, the backend's line."""

from __future__ import annotations

import argparse
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tqdm import tqdm

PATIENCE = 3.0
"""Seconds of silence before it is said that kernels are being compiled."""


def at_least(least: int) -> Callable[[str], int]:
    """Return a reader of whole numbers that refuses those below ``least``.

    Examples
    --------
    >>> at_least(2)("50")
    50
    """

    def read(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            number = least - 1
        if number < least:
            raise argparse.ArgumentTypeError(f"{text!r}: expected a whole number, {least} or more")
        return number

    return read


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add ``--json FILE``, whose folder is checked before any work by :func:`json_target`."""
    parser.add_argument("--json", metavar="FILE", help="write the numbers that are printed to FILE")


def add_set(parser: argparse.ArgumentParser, keys: str = "change a setting") -> None:
    """Add ``--set KEY=VALUE``."""
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help=f"{keys}; may be repeated"
    )


def json_target(options: argparse.Namespace) -> Path | None:
    """Return the checked path of ``--json``, or None; ``InputError`` if it cannot be written."""
    return file_target(options.json)


def file_target(given: str | None, suffixes: tuple[str, ...] = ()) -> Path | None:
    """Return the checked path of an output file, or None where none was asked for.

    Raises
    ------
    InputError
        If it cannot be written, or has none of the suffixes.
    """
    if given is None:
        return None
    from vslam_ref.support import files
    from vslam_ref.support.errors import InputError

    if suffixes and Path(given).suffix not in suffixes:
        raise InputError(f"{given!r}: the name must end in {' or '.join(suffixes)}")
    return files.require_parent(given)


def folder_target(given: str | None) -> Path | None:
    """Return the checked path of an output folder that holds ``result.json`` in the end, or None."""
    if given is None:
        return None
    from vslam_ref.support import files

    return files.require_new_folder(given, "result.json")


def print_notes(notes: Iterable[str]) -> list[str]:
    """Print what a reader of the numbers should know, a line ``note: ...`` each; return them for the JSON.

    What is odd in a file and harmless is counted and told here: never dropped in silence, never refused.
    """
    said = list(notes)
    for note in said:
        print(f"note: {note}")
    return said


def write_json(path: Path | None, content: Mapping[str, Any]) -> None:
    """Write the numbers, and the versions that made them, in one step, if a path was given.

    The list ``notes`` is always there; it is empty where nothing was odd.
    """
    if path is None:
        return
    from vslam_ref.support import files
    from vslam_ref.support.json_text import to_json
    from vslam_ref.support.provenance import versions

    files.write_text(
        path, to_json({"notes": [], **content, "versions": content.get("versions") or versions()})
    )


def warm(*modules: str) -> str:
    """Compile the kernels of some modules of ``_kernels``, or read them from disk; return the backend.

    Where that takes long, it is said on stderr: once while it lasts, and in the end how long it took.
    """
    from vslam_ref import _kernels

    backend = _kernels.backend()
    if backend != "numba":
        return backend
    what = (
        "preparing the accelerated kernels: the first run compiles them, later ones read them from disk ..."
    )
    timer = threading.Timer(PATIENCE, lambda: print(what, file=sys.stderr, flush=True))
    timer.daemon = True
    began = time.perf_counter()
    timer.start()
    try:
        _kernels.warm(*modules)
    finally:
        timer.cancel()
    seconds = time.perf_counter() - began
    if seconds > PATIENCE:
        print(f"kernels ready after {seconds:.0f} s", file=sys.stderr, flush=True)
    return backend


@contextmanager
def progress_bar(total: int, unit: str, what: str | None = None) -> Iterator[tqdm[Any]]:
    """Show progress and its rate on a terminal; be silent elsewhere."""
    from tqdm import tqdm

    with tqdm(total=total, desc=what, unit=unit, disable=None, leave=False) as bar:
        yield bar


def print_backend() -> None:
    """Print which backend ran."""
    from vslam_ref import _kernels

    print(f"backend: {_kernels.backend()}")

"""Arguments that several commands share."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any


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


def json_target(options: argparse.Namespace) -> Path | None:
    """Return the checked path of ``--json``, or None; ``InputError`` if it cannot be written."""
    if options.json is None:
        return None
    from vslam_ref.support import files

    return files.require_parent(options.json)


def write_json(path: Path | None, content: Any) -> None:
    """Write the numbers to ``path`` in one step, if a path was given."""
    if path is None:
        return
    from vslam_ref.support import files
    from vslam_ref.support.json_text import to_json

    files.write_text(path, to_json(content))

"""The command line ``vslam-ref``: finds the command, runs it, turns its end into an exit status.

=======  ====================================================================================
status   meaning
=======  ====================================================================================
0        done, whatever the verdicts say
1        a verification failed, or ``--strict`` and a claim is not reproduced
2        bad input; one line on stderr says what, where, and what would be right
130      interrupted by Ctrl-C; nothing is half-written
141      the reader of the output went away (``vslam-ref list | head``)
=======  ====================================================================================

Each command is a module of :mod:`vslam_ref.commands` with ``HELP``, ``EPILOG``, ``add_arguments``
and ``run``; it imports what it needs inside ``run``, so that ``--help`` is quick.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import NoReturn

import vslam_ref
from vslam_ref._kernels import backend
from vslam_ref.commands import (
    ba,
    bench,
    calibrate,
    data,
    evaluate,
    grid,
    identify,
    posegraph,
    render,
    reproduce,
    sample,
    vectors,
    verify,
    warm_cache,
)
from vslam_ref.commands import list as list_command
from vslam_ref.commands import run as run_command

PROGRAM = "vslam-ref"
COMMANDS: dict[str, ModuleType] = {
    "list": list_command,
    "sample": sample,
    "reproduce": reproduce,
    "run": run_command,
    "render": render,
    "evaluate": evaluate,
    "ba": ba,
    "posegraph": posegraph,
    "calibrate": calibrate,
    "verify": verify,
    "vectors": vectors,
    "grid": grid,
    "identify": identify,
    "data": data,
    "bench": bench,
    "warm-cache": warm_cache,
}
DESCRIPTION = "\n".join(
    [
        "Reference implementation and executable textbook of visual SLAM.\n\ncommands:",
        *(f"  {name:<12}{module.HELP}" for name, module in COMMANDS.items()),
    ]
)
BAD_INPUT = 2
INTERRUPTED = 128 + signal.SIGINT
READER_GONE = 128 + 13  # SIGPIPE, which Windows does not name


class UsageError(Exception):
    """The command line itself cannot be read."""


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line, like every other error of the program."""

    def error(self, message: str) -> NoReturn:
        """Raise instead of printing the usage and leaving."""
        raise UsageError(f"{message}; see '{self.prog} --help'")


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of the program with all its commands."""
    parser = Parser(
        prog=PROGRAM,
        description=DESCRIPTION,
        epilog="examples:\n  vslam-ref sample all --out samples\n  vslam-ref reproduce iekf-fig2 --quick",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {vslam_ref.__version__}")
    commands = parser.add_subparsers(
        metavar="COMMAND", dest="command", required=True, help="'vslam-ref COMMAND --help' shows more"
    )
    for name, module in COMMANDS.items():
        command = commands.add_parser(
            name,
            description=module.HELP,
            epilog=module.EPILOG,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        module.add_arguments(command)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program and return its exit status.

    Parameters
    ----------
    arguments : sequence of str, optional
        Words after ``vslam-ref``; those of the process by default.

    Notes
    -----
    ``VSLAM_REF_DEBUG=1`` shows the traceback of an error that would be reported in one line.
    """
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a terminal without the letter must not stop the work
    try:
        options = build_parser().parse_args(arguments)
        backend()  # a misspelt VSLAM_REF_BACKEND is an error before the work, not after
        status: int = COMMANDS[options.command].run(options)
        sys.stdout.flush()
        return status
    except KeyboardInterrupt:
        print(f"\n{PROGRAM}: interrupted; no file is half-written", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # Python would complain once more when it closes stdout at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return READER_GONE
    except (UsageError, ValueError, OSError) as error:
        if os.environ.get("VSLAM_REF_DEBUG") or _is_numeric(error):
            raise
        print(f"{PROGRAM}: error: {_one_line(error)}", file=sys.stderr)
        return BAD_INPUT


def _is_numeric(error: Exception) -> bool:
    """Distinguish a failed factorisation, which NumPy calls a ValueError, from bad input."""
    return type(error).__name__ == "LinAlgError"


def _one_line(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        where = f": {error.filename}" if error.filename else ""
        return f"{error.strerror}{where}"
    return " ".join(str(error).split()) or type(error).__name__


if __name__ == "__main__":
    raise SystemExit(main())

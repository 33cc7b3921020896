"""``vslam-ref verify``: the conformance vectors against a program."""

from __future__ import annotations

import argparse
import contextlib
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vslam_ref.commands.options import (
    add_json,
    file_target,
    json_target,
    print_backend,
    print_notes,
    progress_bar,
    write_json,
)

if TYPE_CHECKING:
    from vslam_ref.conformance.replies import Asked
    from vslam_ref.conformance.results import Report
    from vslam_ref.conformance.vectors_format import VectorFile

HELP = "verify a program's formulas, signs and conventions with the conformance vectors"
EPILOG = """\
--program CMD: it is started once, reads one request a line and writes one reply a line, both JSON:
  {"id": "...", "function": "so3.exp", "inputs": {"phi": [0.1, 0.2, 0.3]}}
  {"id": "...", "value": {"R": [[...], [...], [...]]}}, or
  {"id": "...", "unsupported": true}, or {"id": "...", "error": "..."}
CMD is split as a shell would; a path with spaces is quoted twice: --program "'/my slam/adapter' --fast".

--module NAME: a Python module, or file.py, also in the folder you stand in. It has a function
  def answer(function, inputs):      # "so3.exp", {"phi": [0.1, 0.2, 0.3]} -> {"R": [[...], ...]}
that returns lists or arrays, raises NotImplementedError where it has no such function ("unsupported"), and
any other exception where it refuses the inputs ("error"). It runs in a process of its own: it may print, hang
or crash.

'vslam-ref vectors list' names the functions. What is unsupported is counted apart and is no failure.
--chapter, --topic, --function and --case add up: each adds its cases. A program with conventions of its own
says so in a JSON file:
  {"transform": "world_from_cam", "perturbation": "right", "tangent_order": "rotation_first"}

A program that is silent five times in a row is given up; Ctrl-C ends a run. In both cases page and JSON are
written, with what was found until then.

--nees judges a filter by its simulated runs, at least 10, each with the same steps: a CSV with the columns
run, step, e1..ed, P11..Pdd (row by row), or an .npz with the arrays run, step, error, covariance. Its
--report is a page (.html) or the figure alone (.png, .svg).

Status: 0 all answered cases pass, 1 some fail or were not asked (with --strict also: digits are lost),
2 bad use, 130 interrupted.

examples, the first after 'vslam-ref sample adapter --out samples':
  vslam-ref verify --program "python samples/adapter/my_slam_adapter.py" \\
      --convention samples/adapter/convention.json
  vslam-ref verify --module my_adapter.py --function so3.exp --function so3.log --report report.html
  vslam-ref verify --self
  vslam-ref verify --nees runs.csv --dof 3"""
INTERRUPTED = 128 + signal.SIGINT


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    which = parser.add_mutually_exclusive_group(required=True)
    which.add_argument("--program", metavar="CMD", help="command that answers lines")
    which.add_argument(
        "--module", metavar="NAME", help="Python module, or file.py, with answer(function, inputs)"
    )
    which.add_argument("--self", action="store_true", help="check this library")
    which.add_argument("--nees", metavar="FILE", help="judge a filter's simulated runs")
    more = "; may repeat"
    parser.add_argument("--chapter", metavar="C", type=int, action="append", help=f"ask this chapter{more}")
    parser.add_argument("--topic", metavar="T", action="append", help=f"ask this topic, as so3{more}")
    parser.add_argument(
        "--function", metavar="NAME", action="append", help=f"ask this function, as so3.exp{more}"
    )
    parser.add_argument(
        "--case", metavar="ID", action="append", help=f"ask this case, and show what the program prints{more}"
    )
    parser.add_argument("--convention", metavar="FILE", help="the program's conventions, JSON")
    parser.add_argument("--float32", action="store_true", help="tolerances of single precision")
    parser.add_argument("--strict", action="store_true", help="status 1 also where digits are lost")
    parser.add_argument(
        "--timeout", metavar="S", type=float, default=10.0, help="seconds a reply may take (default: 10)"
    )
    parser.add_argument("--report", metavar="FILE", help="write a page: functions, pictures, failures")
    parser.add_argument("--dof", metavar="D", type=int, help="with --nees: length d of the error")
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Ask, judge, write what was asked for, and print."""
    target = json_target(options)
    page = file_target(options.report)
    if options.nees is not None:
        from vslam_ref.commands.verify_nees import judge_runs

        return judge_runs(options, target, page)
    if not 0 < options.timeout < float("inf"):
        raise ValueError(f"--timeout {options.timeout:g}: need seconds, more than 0")
    from vslam_ref.conformance.conventions import Convention, read
    from vslam_ref.conformance.selection import select

    convention = Convention() if options.convention is None else read(Path(options.convention))
    chosen = select(*(getattr(options, name) or () for name in ("chapter", "topic", "function", "case")))
    with _terminated_as_interrupted():
        asked = _asked(options)
        try:
            report = _run(asked, chosen, convention, "float32" if options.float32 else "float64")
        finally:
            asked.close()
    _write(report, target, page)
    _print(report, options)
    if report.stopped == "interrupted":
        return INTERRUPTED
    return 0 if report.passed and not (options.strict and report.count("lost digits")) else 1


@contextlib.contextmanager
def _terminated_as_interrupted() -> Iterator[None]:
    """Take a polite end from outside, as by ``timeout 60 vslam-ref ...``, for Ctrl-C: write the report."""

    def interrupt(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    try:
        before = signal.signal(signal.SIGTERM, interrupt)
    except ValueError:  # not the main thread
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _asked(options: argparse.Namespace) -> Asked:
    from vslam_ref.conformance.program import InProcess, ModuleProgram, Program

    shown = bool(options.case)
    if options.program is not None:
        return Program(options.program, options.timeout, show_errors=shown)
    if options.module is not None:
        return ModuleProgram(options.module, options.timeout, show_errors=shown)
    return InProcess("vslam_ref.conformance.adapters.itself")


def _run(asked: Asked, chosen: list[VectorFile], convention: Any, profile: Any) -> Report:
    """Run with a progress bar where somebody watches."""
    from vslam_ref.conformance.results import Outcome
    from vslam_ref.conformance.runner import run as run_cases

    bad = 0
    with progress_bar(sum(len(file.cases) for file in chosen), "case") as bar:

        def progress(outcome: Outcome) -> None:
            nonlocal bad
            bad += outcome.bad
            bar.set_postfix_str(f"{outcome.case.function}, {bad} failed", refresh=False)
            bar.update()

        return run_cases(asked, chosen, convention, profile, progress)


def _write(report: Report, target: Path | None, page: Path | None) -> None:
    """Write the numbers first, then the page."""
    write_json(target, report.numbers())
    if page is not None:
        from vslam_ref.conformance.report import verification_page
        from vslam_ref.support import files

        files.write_text(page, verification_page(report))


def _print(report: Report, options: argparse.Namespace) -> None:
    from vslam_ref.commands.verify_text import text

    print(text(report, _again(options)))
    print_notes(report.notes)
    if options.self:
        print_backend()


def _again(options: argparse.Namespace) -> str:
    """The command line of this run without its choice of cases and its outputs."""
    import shlex

    words = ["vslam-ref", "verify"]
    for name in ("program", "module", "convention"):
        if getattr(options, name) is not None:
            words += [f"--{name}", getattr(options, name)]
    words += [f"--{name}" for name in ("self", "float32") if getattr(options, name)]
    words += ["--timeout", f"{options.timeout:g}"] if options.timeout != 10.0 else []
    return shlex.join(words)

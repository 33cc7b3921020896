"""``vslam-ref verify``: the conformance vectors against a program."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vslam_ref.commands.options import add_json, file_target, json_target, print_backend, write_json

if TYPE_CHECKING:
    from vslam_ref.conformance.nees_runs import Judgement
    from vslam_ref.conformance.program import Asked
    from vslam_ref.conformance.runner import Report
    from vslam_ref.conformance.vectors_format import VectorFile

HELP = "verify a program's formulas, signs and conventions with the conformance vectors"
EPILOG = """\
The program is started once. It reads one request a line and writes one reply a line, both JSON:
  {"id": "...", "function": "so3.exp", "inputs": {"phi": [0.1, 0.2, 0.3]}}
  {"id": "...", "value": {"R": [[...], [...], [...]]}}, or
  {"id": "...", "unsupported": true}, or {"id": "...", "error": "..."}
'vslam-ref vectors list' names the functions. A program with conventions of its own says so in a JSON file:
  {"transform": "world_from_cam", "perturbation": "right", "tangent_order": "rotation_first"}

--nees judges a filter by its simulated runs, at least 10, each with the same steps: a CSV with the columns
run, step, e1..ed, P11..Pdd (row by row), or an .npz with the arrays run, step, error, covariance. Its
--report is a page (.html) or the figure alone (.png, .svg).

Status: 0 all answered cases pass, 1 some fail, 2 bad use.

examples, the first after 'vslam-ref sample adapter --out samples':
  vslam-ref verify --program "python samples/adapter/my_slam_adapter.py" \\
      --convention samples/adapter/convention.json
  vslam-ref verify --module my_package.adapter --chapter 2 --convention mine.json
  vslam-ref verify --self
  vslam-ref verify --nees runs.csv --dof 3"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    which = parser.add_mutually_exclusive_group(required=True)
    which.add_argument("--program", metavar="CMD", help="command that answers lines")
    which.add_argument(
        "--module", metavar="NAME", help="Python module, or file.py, with answer(function, inputs)"
    )
    which.add_argument("--self", action="store_true", help="check this library")
    which.add_argument("--nees", metavar="FILE", help="judge a filter's simulated runs")
    parser.add_argument(
        "--chapter", metavar="C", type=int, action="append", help="only this chapter; may repeat"
    )
    parser.add_argument("--topic", metavar="T", action="append", help="only this topic, as so3; may repeat")
    parser.add_argument("--case", metavar="ID", action="append", help="only this case; may repeat")
    parser.add_argument("--convention", metavar="FILE", help="the program's conventions, JSON")
    parser.add_argument("--float32", action="store_true", help="tolerances of single precision")
    parser.add_argument("--timeout", metavar="S", type=float, default=10.0, help="seconds a reply may take")
    parser.add_argument("--report", metavar="FILE", help="write a page with every failure")
    parser.add_argument("--dof", metavar="D", type=int, help="with --nees: length d of the error")
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Ask, judge, print, and write what was asked for."""
    target = json_target(options)
    page = file_target(options.report)
    if options.nees is not None:
        return _nees(options, target, page)
    if not 0 < options.timeout < float("inf"):
        raise ValueError(f"--timeout {options.timeout:g}: need seconds, more than 0")
    from vslam_ref.conformance.conventions import Convention, read

    convention = Convention() if options.convention is None else read(Path(options.convention))
    chosen = _files(options)
    asked = _asked(options)
    try:
        report = _run(asked, chosen, convention, "float32" if options.float32 else "float64")
    finally:
        asked.close()
    _show(report)
    if options.self:
        print_backend()
    if page is not None:
        from vslam_ref.conformance.report import verification_page as html
        from vslam_ref.support import files

        files.write_text(page, html(report))
    write_json(target, report.numbers())
    return 0 if report.passed else 1


def _asked(options: argparse.Namespace) -> Asked:
    from vslam_ref.conformance.program import InProcess, Program

    if options.program is not None:
        return Program(options.program, options.timeout)
    return InProcess("vslam_ref.conformance.adapters.itself" if options.self else options.module)


def _files(options: argparse.Namespace) -> list[VectorFile]:
    """The files that were asked for; ValueError where there are none."""
    from vslam_ref.conformance.vectors_format import load, names

    found = [load(name) for name in names()]
    kept = [
        file
        for file in found
        if (not options.chapter or file.chapter in options.chapter)
        and (not options.topic or Path(file.name).stem in options.topic)
    ]
    if options.case:
        chosen = [file._replace(cases=[c for c in file.cases if c.id in options.case]) for file in kept]
        kept = [file for file in chosen if file.cases]
        missing = set(options.case) - {c.id for file in kept for c in file.cases}
        if missing:
            raise ValueError(f"no case {sorted(missing)[0]!r} in the chosen chapters and topics")
    if not kept:
        chapters = ", ".join(map(str, sorted({file.chapter for file in found})))
        topics = ", ".join(Path(file.name).stem for file in found)
        raise ValueError(f"no vectors of that chapter or topic; chapters: {chapters}; topics: {topics}")
    return kept


def _run(asked: Asked, chosen: list[VectorFile], convention: Any, profile: Any) -> Report:
    """Run with a progress bar where somebody watches."""
    from tqdm import tqdm

    from vslam_ref.conformance.runner import run as run_cases

    total = sum(len(file.cases) for file in chosen)
    with tqdm(total=total, unit="case", disable=None, leave=False) as bar:
        return run_cases(asked, chosen, convention, profile, lambda _: bar.update())


def _show(report: Report) -> None:
    from vslam_ref.commands.tables import table

    numbers = report.numbers()
    rows = [
        [chapter, *(str(counts[key]) for key in ("passed", "failed", "unsupported", "errors"))]
        for chapter, counts in numbers["by_chapter"].items()
    ]
    total = [str(numbers[key]) for key in ("passed", "failed", "unsupported", "errors")]
    print(f"{report.program}: {numbers['cases']} cases")
    print(table(["chapter", "passed", "failed", "unsupported", "errors"], [*rows, ["all", *total]]))
    for found in numbers["diagnoses"][:20]:
        print(f"{found['function']}: {found['cause']} ({found['cases']} cases, first {found['first']})")
    first = numbers["first_failure"]
    if first is not None:
        print(f"\nfirst failure: {first['id']} ({first['file']}, {first['equation']})")
        for key in ("inputs", "where", "expected", "got", "difference", "allowed", "cause"):
            print(f"  {key:<10} {_short(first[key])}")
    if not any(o.status == "passed" for o in report.outcomes):
        print("nothing passed: a program that answers nothing is not verified")
    elif report.passed:
        print("all answered cases pass")


def _short(value: Any, most: int = 300) -> str:
    text = str(value)
    return text if len(text) <= most else f"{text[:most]} …"


def _nees(options: argparse.Namespace, target: Path | None, page: Path | None) -> int:
    """Judge a filter's runs."""
    from vslam_ref.conformance.nees_files import read
    from vslam_ref.conformance.nees_runs import MEANINGS, judge

    if page is not None and page.suffix not in (".html", ".png", ".svg"):
        raise ValueError(f"--report {page}: need a name that ends in .html, .png or .svg")
    runs = read(Path(options.nees), options.dof)
    found = judge(runs)
    print(f"{options.nees}: {found.runs} runs of {found.steps} steps, errors of {found.dof} numbers")
    if found.invalid:
        print(
            f"{found.invalid} covariances of {found.runs * found.steps} are not symmetric positive definite"
        )
    else:
        _show_windows(found)
    print(f"{found.verdict}: {MEANINGS[found.verdict]}")
    if page is not None:
        from vslam_ref.conformance.nees_page import write

        write(page, str(options.nees), runs, found)
    write_json(target, found.numbers())
    return 0 if found.consistent else 1


def _show_windows(found: Judgement) -> None:
    from vslam_ref.commands.tables import table

    words = {-1: "below", 0: "inside", 1: "above"}
    rows = [
        [
            w.name,
            f"{w.mean:.3f}",
            f"{w.low:.3f}",
            f"{w.high:.3f}",
            words[w.side],
            f"{w.independent_steps:.1f}",
        ]
        for w in found.windows
    ]
    print(table(["window", "mean NEES", "low", "high", "mean is", "independent steps"], rows))
    low, high = found.interval
    print(f"all steps: {found.mean:.3f} for {found.dof}; 95 % over resampled runs: {low:.3f} to {high:.3f}")
    print(f"an honest filter is called otherwise in about {100 * found.false_alarm:g} % of such studies")

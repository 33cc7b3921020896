"""What ``vslam-ref verify`` prints: counts, functions with failures, names, what to do next."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from vslam_ref.commands.tables import table
from vslam_ref.conformance.regimes import RegimeRow, rows
from vslam_ref.conformance.report import regime_cells
from vslam_ref.conformance.results import KEYS, Report

FEW_ROWS = 30
MOST_ROWS = 40
MOST_NAMES = 20
LONGEST_NAME = 56
LONGEST_VALUE = 300


def text(report: Report, again: str) -> str:
    """Return the text.

    Parameters
    ----------
    report : Report
    again : str
        The command line that asks this program once more, without a choice of cases.
    """
    parts = [_counts(report), _regimes(report), _names(report), _first(report), _next(report, again)]
    return "\n\n".join(part for part in ("\n".join(lines) for lines in parts) if part)


def _counts(report: Report) -> Iterator[str]:
    numbers = report.numbers()
    keys = list(KEYS.values())
    found = [[chapter, *(str(c[key]) for key in keys)] for chapter, c in numbers["by_chapter"].items()]
    total = ["all", *(str(numbers[key]) for key in keys)]
    yield f"{report.program}: {numbers['cases']} cases"
    yield table(["chapter", *(key.replace("_", " ") for key in keys)], [*found, total])
    if report.not_asked:
        why = f": {report.stopped}" if report.stopped else ""
        yield f"not asked: {report.not_asked} cases more{why}"


def _regimes(report: Report) -> Iterator[str]:
    """The table function x regime: all of a short one, else the rows in which not all cases pass."""
    found = rows(report.outcomes, report.functions_named)
    if not found:
        return
    wrong = [row for row in found if row.passed < row.cases]
    chosen = found if len(found) <= FEW_ROWS else wrong[:MOST_ROWS]
    if chosen:
        heads = ["function", "regime", "cases", "passed", "digits lost", "digits", "worst", "what is wrong"]
        cells = [regime_cells(row) for row in chosen]
        yield table(heads, [[*row[:-1], _short(row[-1], LONGEST_NAME)] for row in cells])
    if len(found) > FEW_ROWS and len(wrong) > MOST_ROWS:
        yield f"{len(wrong) - MOST_ROWS} rows more with failures: --report or --json FILE has them"
    if len(found) > FEW_ROWS:
        yield from _right([row for row in found if row.passed == row.cases])


def _right(right: list[RegimeRow]) -> Iterator[str]:
    digits = [(row.digits_worst, row.function, row.regime) for row in right if row.digits_worst is not None]
    if not right:
        return
    count = len({row.function for row in right})
    worst = f"; fewest right digits: {min(digits)[0]:.1f} in {'/'.join(min(digits)[1:])}" if digits else ""
    yield f"all cases pass in {len(right)} regimes of {count} functions{worst}"


def _names(report: Report) -> Iterator[str]:
    """Names of whole functions, then the causes of single cases of the others, then what has none."""
    named = report.functions_named
    for function, sentence in list(named.items())[:MOST_NAMES]:
        yield f"{function}: {sentence}"
    causes = [d for d in report.diagnoses if d["function"] not in named]
    for found in causes[:MOST_NAMES]:
        plural = "s" if found["cases"] > 1 else ""
        yield f"{found['function']}: {found['cause']} ({found['cases']} case{plural}, first {found['first']})"
    more = max(len(named) - MOST_NAMES, 0) + max(len(causes) - MOST_NAMES, 0)
    if more:
        yield f"{more} causes more: --report or --json FILE has them"
    left = report.unexplained
    if left:
        those = ", ".join(f"{function} {count}" for function, count in list(left.items())[:10])
        more_functions = f", and {len(left) - 10} functions more" if len(left) > 10 else ""
        yield f"without a name: {sum(left.values())} failures ({those}{more_functions})"


def _first(report: Report) -> Iterator[str]:
    first = report.numbers()["first_failure"]
    if first is None:
        return
    yield f"look here first: {first['id']} ({first['file']}, {first['equation']})"
    for key in ("inputs", "where", "expected", "got", "difference", "allowed", "cause"):
        if first[key] not in (None, ""):
            yield f"  {key:<10} {_short(first[key], LONGEST_VALUE)}"


def _next(report: Report, again: str) -> Iterator[str]:
    """The verdict, and what to do now."""
    lost = report.count("lost digits")
    if lost:
        yield (
            f"digits lost: {lost} of the answers, right to fewer digits than a careful formula gives; no "
            "failure, unless --strict"
        )
    first = report.first
    if first is not None:
        count = len({o.case.function for o in report.outcomes if o.bad})
        yield f"not verified: failures in {count} function{'s' if count > 1 else ''}"
        if report.stopped.startswith("given up"):
            yield "next: see why it gives no reply. Ask one case, which shows what the program prints:"
        else:
            yield (
                f"next: mend {first.case.function}, the most basic of them; functions built on it may fail "
                "with it. Ask it alone:"
            )
            yield f"  {again} --function {first.case.function}"
        yield f"  {again} --case {first.case.id}      # shows what the program prints"
    elif not any(o.status in ("passed", "lost digits") for o in report.outcomes):
        yield "nothing passed: a program that answers nothing is not verified"
        if report.count("unsupported"):
            yield (
                "next: it calls everything unsupported; does it know the functions by their names, as "
                "so3.exp? 'vslam-ref vectors list' prints them"
            )
    elif report.passed:
        yield "all answered cases pass"
    else:
        yield "not verified: not all cases were asked; those that were pass"


def _short(value: Any, most: int) -> str:
    shown = str(value)
    return shown if len(shown) <= most else f"{shown[:most]} …"

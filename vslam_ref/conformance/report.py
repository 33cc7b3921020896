"""A page with everything the runner found: summary, probable causes, every failure."""

from __future__ import annotations

from html import escape
from typing import Any

from vslam_ref.conformance.runner import Outcome, Report

MOST_FAILURES = 500
STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem }
table { border-collapse: collapse; margin: 1rem 0 } td, th { padding: .2rem .8rem; text-align: left }
th { border-bottom: 2px solid #888 } td { border-bottom: 1px solid #ddd; vertical-align: top }
td.n, th.n { text-align: right } code, pre { font: 13px/1.4 ui-monospace, monospace }
pre { background: #f4f4f4; padding: .5rem; overflow-x: auto } .bad { color: #a33a00 } .good { color: #00694b }
"""


def page(report: Report) -> str:
    """HTML text of a report; it needs nothing but itself."""
    numbers, name = report.numbers(), escape(report.program)
    word = "all answered cases pass" if report.passed else "not verified"
    mark = "good" if report.passed else "bad"
    parts = [
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>Verification of {name}</title>",
        f"<style>{STYLE}</style><h1>Verification of <code>{name}</code></h1>",
        f"<p class='{mark}'><strong>{word}</strong>: {numbers['passed']} passed, ",
        f"{numbers['failed']} failed, ",
        f"{numbers['errors']} without a usable reply, {numbers['unsupported']} not supported.</p>",
        _chapters(numbers["by_chapter"]),
        _causes(numbers["diagnoses"]),
        _failures([o for o in report.outcomes if o.status in ("failed", "error")]),
        "</html>\n",
    ]
    return "".join(parts)


def _chapters(chapters: dict[str, dict[str, int]]) -> str:
    keys = ("passed", "failed", "unsupported", "errors")
    head = "".join(f"<th class='n'>{key}</th>" for key in keys)
    rows = "".join(
        f"<tr><td>{escape(name)}</td>"
        + "".join(f"<td class='n'>{counts[key]}</td>" for key in keys)
        + "</tr>"
        for name, counts in chapters.items()
    )
    return f"<h2>By chapter</h2><table><tr><th>chapter</th>{head}</tr>{rows}</table>"


def _causes(diagnoses: list[dict[str, Any]]) -> str:
    if not diagnoses:
        return ""
    rows = "".join(
        f"<tr><td><code>{escape(d['function'])}</code></td><td>{escape(d['cause'])}</td>"
        f"<td class='n'>{d['cases']}</td><td><code>{escape(d['first'])}</code></td></tr>"
        for d in diagnoses
    )
    head = "<tr><th>function</th><th>probable cause</th><th class='n'>cases</th><th>first</th></tr>"
    return f"<h2>Probable causes</h2><table>{head}{rows}</table>"


def _failures(bad: list[Outcome]) -> str:
    if not bad:
        return ""
    parts = [f"<h2>Failures</h2><p>{len(bad)} in all, the first {min(len(bad), MOST_FAILURES)} shown.</p>"]
    for o in bad[:MOST_FAILURES]:
        lines = [f"inputs    {o.case.inputs}"]
        if o.difference is not None:
            d = o.difference
            lines += [
                f"where     {d.where}",
                f"expected  {d.expected}",
                f"got       {d.got}",
                f"differs   {d.size:.3g}, allowed {d.allowed:.3g}: {o.case.tolerance['reason']}",
            ]
        lines += [f"oracle    {o.case.oracle}"] + ([f"cause     {o.cause}"] if o.cause else [])
        title = f"<code>{escape(o.case.id)}</code> ({escape(o.case.equation)})"
        parts.append(f"<details><summary>{title}</summary><pre>{escape(chr(10).join(lines))}</pre></details>")
    return "".join(parts)

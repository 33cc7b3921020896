"""A page with everything the runner found: summary, probable causes, every failure."""

from __future__ import annotations

from typing import Any

from vslam_ref.conformance.runner import Outcome, Report
from vslam_ref.support.pages import Html, details, page, table, tag

MOST_FAILURES = 500


def verification_page(report: Report) -> str:
    """HTML text of a report; it needs nothing but itself."""
    numbers = report.numbers()
    word = "all answered cases pass" if report.passed else "not verified"
    counts = (
        f": {numbers['passed']} passed, {numbers['failed']} failed, {numbers['errors']} without a usable "
        "reply, "
        f"{numbers['unsupported']} not supported."
    )
    return page(
        f"Verification of {report.program}",
        tag("p", tag("strong", word), counts, class_="good" if report.passed else "bad"),
        _chapters(numbers["by_chapter"]),
        _causes(numbers["diagnoses"]),
        _failures([o for o in report.outcomes if o.status in ("failed", "error")]),
        heading=Html(f"Verification of {tag('code', report.program)}"),
    )


def _chapters(chapters: dict[str, dict[str, int]]) -> Html:
    keys = ("passed", "failed", "unsupported", "errors")
    rows = [[name, *(counts[key] for key in keys)] for name, counts in chapters.items()]
    return Html(tag("h2", "By chapter") + table(["chapter", *keys], rows, caption="Cases", kind="numbers"))


def _causes(diagnoses: list[dict[str, Any]]) -> Html | None:
    if not diagnoses:
        return None
    rows = [[tag("code", d["function"]), d["cause"], d["cases"], tag("code", d["first"])] for d in diagnoses]
    heads = ["function", "probable cause", "cases", "first"]
    return Html(tag("h2", "Probable causes") + table(heads, rows, caption="Causes", kind="plain"))


def _failures(bad: list[Outcome]) -> Html | None:
    if not bad:
        return None
    shown = bad[:MOST_FAILURES]
    note = tag("p", f"{len(bad)} in all, the first {len(shown)} shown.")
    return Html(tag("h2", "Failures") + note + "".join(_failure(o) for o in shown))


def _failure(o: Outcome) -> Html:
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
    title = Html(f"{tag('code', o.case.id)} {tag('span', f'({o.case.equation})')}")
    return details(title, tag("pre", "\n".join(lines)))

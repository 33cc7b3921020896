"""A page with everything the runner found: what to look at first, functions and regimes, names, failures."""

from __future__ import annotations

import json
from typing import Any

from vslam_ref.conformance.pictures import GROUPS, MOST_PICTURES, ErrorPicture, pictures
from vslam_ref.conformance.regimes import RegimeRow, basic_first, regime, rows
from vslam_ref.conformance.results import KEYS, Outcome, Report, bounded
from vslam_ref.support.pages import Html, details, page, table, tag

MOST_FAILURES = 400
MOST_OF_A_FUNCTION = 12
LONGEST_TEXT = 1500


def verification_page(report: Report) -> str:
    """HTML text of a report; it needs nothing but itself."""
    return page(
        f"Verification of {report.program}",
        _verdict(report),
        _first(report),
        _names(report),
        _functions(report),
        _pictures(report),
        _failures(report),
        _chapters(report),
        heading=Html(f"Verification of {tag('code', report.program)}"),
    )


def _verdict(report: Report) -> Html:
    word = "all answered cases pass" if report.passed else "not verified"
    counts = (
        f": {report.count('passed')} passed, {report.count('failed')} failed, {report.count('error')} "
        f"without a usable reply, {report.count('lost digits')} lost digits, "
        f"{report.count('unsupported')} not supported."
    )
    said = [tag("p", tag("strong", word), counts, class_="good" if report.passed else "bad")]
    if report.not_asked:
        why = f" ({report.stopped})" if report.stopped else ""
        said.append(tag("p", f"{report.not_asked} more cases were not asked{why}.", class_="bad"))
    said += [tag("p", f"Note: {note}.") for note in report.notes]
    return Html("".join(said))


def _first(report: Report) -> Html | None:
    first = report.first
    if first is None:
        return None
    words = (
        "The plainest failure of the most basic function that fails. Functions that are built on it may fail "
        "with it: mend this one, then run again."
    )
    return Html(tag("h2", "Look here first") + tag("p", words) + _block(report, first, is_open=True))


def _names(report: Report) -> Html | None:
    named = [[tag("code", f), sentence] for f, sentence in report.functions_named.items()]
    causes = [
        [tag("code", d["function"]), d["cause"], d["cases"], tag("code", d["first"])]
        for d in report.diagnoses
    ]
    parts = []
    if named:
        parts.append(table(["function", "what is probably wrong"], named, caption="Functions", kind="plain"))
    if causes:
        heads = ["function", "probable cause of a case", "cases", "first"]
        parts.append(table(heads, causes, caption="Cases", kind="plain"))
    left = report.unexplained
    if left:
        those = [[tag("code", function), count] for function, count in left.items()]
        words = f"{sum(left.values())} failures have no name."
        parts += [
            tag("p", words),
            table(["function", "failures without a name"], those, caption="Unexplained", kind="plain"),
        ]
    return Html(tag("h2", "Probable causes") + "".join(parts)) if parts else None


def _functions(report: Report) -> Html | None:
    found = rows(report.outcomes, report.functions_named)
    if not found:
        return None
    wrong = [row for row in found if row.passed < row.cases]
    right = [row for row in found if row.passed == row.cases]
    words = (
        "A regime is a kind of inputs, as near_pi. Digits: how many decimal digits are right, at most 16, in "
        "the median and in the worst answer with numbers."
    )
    parts = [tag("h2", "Functions and regimes"), tag("p", words)]
    if wrong:
        parts.append(_regimes(wrong, "Not all cases pass"))
    if right:
        parts.append(
            details(f"{len(right)} regimes in which all cases pass", _regimes(right, "All cases pass"))
        )
    return Html("".join(parts))


def _regimes(found: list[RegimeRow], caption: str) -> Html:
    heads = [
        "function",
        "regime",
        "cases",
        "passed",
        "digits lost",
        "digits, median",
        "digits, worst",
        "name",
    ]
    cells = [[tag("code", r.function), *regime_cells(r)[1:]] for r in found]
    return table(heads, cells, caption=caption, kind="plain")


def regime_cells(row: RegimeRow) -> list[str]:
    """A row of the table function x regime as words."""
    digits = ["–" if x is None else f"{x:.1f}" for x in (row.digits_median, row.digits_worst)]
    counts = (row.cases, row.passed, row.digits_lost)
    return [row.function, row.regime, *map(str, counts), *digits, row.name]


def _pictures(report: Report) -> Html | None:
    found = pictures(report.outcomes)
    if not found:
        return None
    shown = found[:MOST_PICTURES]
    cut = f" The first {len(shown)} of {len(found)} functions." if len(found) > len(shown) else ""
    words = (
        "Relative errors of the answers. A step where a branch begins, a slope where digits cancel, or one "
        "level everywhere each tell another story."
    )
    parts = [tag("h3", tag("code", p.function)) + _drawn(p) for p in shown]
    return Html(tag("h2", "Errors over the inputs") + tag("p", words + cut) + "".join(parts))


def _drawn(picture: ErrorPicture) -> Html:
    from vslam_ref.plot.saving import figure_bytes
    from vslam_ref.plot.verification import error_figure

    half_turn = picture.function.partition(".")[0] in GROUPS
    figure = error_figure(
        picture.at, picture.errors, picture.verdicts, axis=picture.axis, half_turn=half_turn
    )
    svg = figure_bytes(figure, "svg", picture.function).decode()
    return Html(svg[svg.index("<svg") :])  # without the XML declaration


def _failures(report: Report) -> Html | None:
    bad = basic_first(o for o in report.outcomes if o.status not in ("passed", "unsupported"))
    if not bad:
        return None
    groups: dict[str, list[Outcome]] = {}
    for o in bad:
        groups.setdefault(o.case.function, []).append(o)
    left, parts = MOST_FAILURES, []
    for function, those in groups.items():
        shown = those[: min(left, MOST_OF_A_FUNCTION)]
        left -= len(shown)
        cut = f", {len(shown)} shown" if len(shown) < len(those) else ""
        head = tag("h3", tag("code", function), f": {len(those)} cases{cut}")
        parts.append(head + "".join(_block(report, o, is_open=k == 0) for k, o in enumerate(shown)))
    total = MOST_FAILURES - left
    note = "All are shown." if total == len(bad) else f"{total} are shown: --json has all."
    return Html(tag("h2", "Failures") + tag("p", f"{len(bad)} in all. {note}") + "".join(parts))


def _block(report: Report, o: Outcome, *, is_open: bool) -> Html:
    """One failing case in full, folded or not."""
    lines = [f"inputs    {_text(o.case.inputs)}"]
    d = o.difference
    if d is not None:
        lines += [
            f"where     {_text(d.where)}",
            f"expected  {_text(d.expected)}",
            f"got       {_text(d.got)}",
            f"differs   {d.size:.3g}, allowed {d.allowed:.3g}: {o.case.tolerance['reason']}",
        ]
    lines += [f"oracle    {o.case.oracle}"]
    lines += [f"cause     {cause}" for cause in [report.name(o) or o.cause] if cause]
    what = f"{o.status}, {regime(o.case)}, {o.case.equation}"
    title = Html(f"{tag('code', o.case.id)} {tag('span', f'({what})')}")
    shown = tag("pre", "\n".join(lines))
    return Html(tag("p", title) + shown) if is_open else details(title, shown)


def _text(value: Any) -> str:
    """A value as text, cut where it is long."""
    if not isinstance(value, str):
        value = json.dumps(bounded(value), ensure_ascii=False, default=str)
    return value if len(value) <= LONGEST_TEXT else f"{value[:LONGEST_TEXT]} … ({len(value)} letters)"


def _chapters(report: Report) -> Html:
    keys = list(KEYS.values())
    found = report.numbers()["by_chapter"]
    cells = [[name, *(counts[key] for key in keys)] for name, counts in found.items()]
    heads = ["chapter", *(key.replace("_", " ") for key in keys)]
    return Html(tag("h2", "By chapter") + table(heads, cells, caption="Cases", kind="numbers"))

"""``OUT/index.html``: every experiment in the folder, its figure, its claims, its assumptions.

Verdicts are shown by words and signs as well as by colour.  What was found stands as one sentence; the rule
and the raw values are folded under it.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from vslam_ref.experiments.framework.claims import VERDICTS, WORST_FIRST, small_sample_note
from vslam_ref.support import files
from vslam_ref.support.pages import Html, details, html, image, links, page, shown, table, tag

SIGNS = {"reproduced": "✓", "not reproduced": "✗", "not testable": "–"}
KINDS = {"reproduced": "good", "not reproduced": "bad", "not testable": "open"}
TITLE = "Reproduced figures and their claims"
QUICK = (
    "Quick run: a small version of the experiment. Its verdicts show that everything works, not who is right."
)


def write_index(out: Path) -> Path:
    """Write ``out/index.html`` from every ``out/*/result.json`` and return its path."""
    path = out / "index.html"
    files.write_text(path, index([read_result(folder) for folder in result_folders(out)]))
    return path


def result_folders(out: Path) -> list[Path]:
    """Return the folders of ``out`` that hold a result, sorted by name; temporaries are left out.

    Left out are also the results of other commands (``vslam-ref run``, ``grid``), which are no experiments.
    """
    paths = sorted(p for p in out.glob("*/result.json") if not p.parent.name.startswith("."))
    return [path.parent for path in paths if not _of_another_command(path)]


def _of_another_command(path: Path) -> bool:
    """Tell whether a readable result has nothing of an experiment's."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(content, dict) and not {"experiment", "claims", "assumptions"} & set(content)


def read_result(folder: Path) -> dict[str, Any]:
    """Read a result and name its folder; one that cannot be read gets an ``error`` to show."""
    try:
        content = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        if not (_records(content, "claims") and _records(content, "assumptions")):
            raise ValueError("it is not the result of an experiment")
    except (OSError, ValueError) as error:
        content = {"error": f"result.json cannot be read: {error}", "claims": []}
    return {**content, "folder": folder.name, "claims": worst_first(content["claims"])}


def _records(content: Any, key: str) -> bool:
    """Whether ``content[key]`` is a list of JSON objects."""
    rows = content.get(key) if isinstance(content, dict) else None
    return isinstance(rows, list) and all(isinstance(row, dict) for row in rows)


def worst_first(claims: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return claims with the failed ones first, otherwise in their order."""
    order = {verdict: rank for rank, verdict in enumerate(WORST_FIRST)}
    return sorted(claims, key=lambda claim: order.get(claim.get("verdict", ""), -1))


def index(results: Sequence[Mapping[str, Any]]) -> str:
    """Return the whole page."""
    return page(TITLE, _overview(results), *(_section(result) for result in results))


def _overview(results: Sequence[Mapping[str, Any]]) -> Html:
    rows = []
    for result in results:
        verdicts = [claim.get("verdict") for claim in result["claims"]]
        name = result["folder"]
        title = (
            f"{result.get('title', result.get('error', ''))}{' (quick run)' if result.get('quick') else ''}"
        )
        rows.append([tag("a", name, href=f"#{name}"), title, *(verdicts.count(v) for v in VERDICTS)])
    heads = ["experiment", "title", *(f"{SIGNS[v]} {v}" for v in VERDICTS)]
    return table(heads, rows, caption="All experiments in this folder")


def _section(result: Mapping[str, Any]) -> Html:
    name = result["folder"]
    title = str(result.get("title", name))
    head = tag("h2", f"{name}: {title}", id=f"{name}-title")
    if "error" in result:
        body = [tag("p", f"✗ {result['error']}", class_="bad")]
    else:
        body = _body(result, title)
    return tag("section", Html("\n".join([head, *body])), id=name, aria_labelledby=f"{name}-title")


def _body(result: Mapping[str, Any], title: str) -> list[Html]:
    at = quote(result["folder"])
    seconds = result.get("seconds")
    time = f"{seconds:.1f}" if isinstance(seconds, float) else shown(seconds)
    facts = f"seed {shown(result.get('seed'))}, runs {shown(result.get('runs'))}, seconds {time}"
    names = ("figure.svg", "figure.png", "result.json", "runs.npz")
    return [
        tag("p", f"{result.get('source', '')}. {facts}. ", links({n: f"{at}/{n}" for n in names})),
        tag("p", QUICK, class_="open") if result.get("quick") else Html(""),
        image(f"{at}/figure.svg", f"Figure: {title}"),
        _claims_table(result["claims"]),
        details(
            "Assumptions, arrays and versions",
            _assumptions_table(result["assumptions"]),
            table(["key", "content"], _items(result, "arrays"), caption="Arrays of runs.npz"),
            table(["what", "version"], _items(result, "versions"), caption="Versions"),
        ),
    ]


def _claims_table(claims: Sequence[Mapping[str, Any]]) -> Html:
    rows = [[_verdict(claim), _statement(claim), _finding(claim)] for claim in claims]
    return table(["verdict", "the paper says", "found"], rows, caption="Claims, failed ones first")


def _verdict(claim: Mapping[str, Any]) -> Html:
    word = str(claim.get("verdict"))
    mark = tag("span", f"{SIGNS.get(word, '?')} {word}", class_=f"strong {KINDS.get(word, 'open')}")
    note = small_sample_note(claim)
    return Html(mark + (tag("p", note, class_="open") if note else ""))


def _statement(claim: Mapping[str, Any]) -> Html:
    source = " · ".join(str(claim[key]) for key in ("id", "source") if claim.get(key))
    return Html(f"{html(claim.get('text', ''))}<br>{tag('small', source)}")


def _finding(claim: Mapping[str, Any]) -> Html:
    """The sentence, and folded under it the rule and the raw values."""
    numbers = [(key, shown(claim.get(key))) for key in ("ci", "null_rate", "share", "runs", "least_runs")]
    rows = [*_items(claim, "measured"), *numbers]
    sentence = claim.get("sentence") or f"{str(claim.get('verdict', '')).capitalize()}."
    rule = tag("p", tag("small", f"Rule: {claim.get('rule', '')}"))
    return Html(html(sentence) + details("rule and raw values", rule, table([], rows, kind="plain")))


def _assumptions_table(records: Sequence[Mapping[str, Any]]) -> Html:
    rows = []
    for record in records:
        value, default = record.get("value"), record.get("default")
        text: Any = shown(value)
        if value != default:
            text = Html(f"{tag('span', text, class_='strong')} (changed; default {html(shown(default))})")
        rows.append([record.get("key"), text, *(record.get(k, "") for k in ("unit", "reason"))])
    return table(["setting", "value", "unit", "reason of the default"], rows, caption="Assumptions")


def _items(record: Mapping[str, Any], key: str) -> list[tuple[str, str]]:
    inner = record.get(key)
    return [(k, shown(v)) for k, v in inner.items()] if isinstance(inner, dict) else []

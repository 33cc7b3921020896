"""``OUT/index.html``: every experiment in the folder, its figure, its claims, its assumptions.

One self-contained page: no script, no font, no request except for the figures beside it.  Verdicts
are told by words and signs as well as by colour.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

from vslam_ref.experiments.framework.claims import VERDICTS, WORST_FIRST
from vslam_ref.support import files

SIGNS = {"reproduced": "✓", "not reproduced": "✗", "not testable": "–"}

_STYLE = """
:root { color-scheme: light dark; --ink: #1b1b1b; --paper: #fff; --line: #c8c8c8; --soft: #f3f3f3;
  --good: #0b5a2a; --bad: #a1161b; --open: #6b4a00; --link: #0b4f9e; }
@media (prefers-color-scheme: dark) { :root { --ink: #ececec; --paper: #161616; --line: #555; --soft: #242424;
  --good: #7fd79c; --bad: #ff9b97; --open: #f0c869; --link: #8ec2ff; } }
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); max-width: 72rem;
  margin: 0 auto; padding: 1rem; }
a { color: var(--link); }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .875rem; margin: .5rem 0 1rem; }
th, td { border: 1px solid var(--line); padding: .3rem .5rem; text-align: left; vertical-align: top; }
th { background: var(--soft); }
table { font-variant-numeric: tabular-nums; }
.verdict { font-weight: 700; white-space: nowrap; }
.reproduced { color: var(--good); }
.not-reproduced { color: var(--bad); }
.not-testable { color: var(--open); }
img { max-width: 100%; height: auto; background: #fff; border: 1px solid var(--line); }
.changed { font-weight: 700; }
"""


def write_index(out: Path) -> Path:
    """Write ``out/index.html`` from every ``out/*/result.json`` and return its path."""
    path = out / "index.html"
    files.write_text(path, page([read_result(folder) for folder in result_folders(out)]))
    return path


def result_folders(out: Path) -> list[Path]:
    """Return the folders of ``out`` that hold a result, sorted by name; temporaries are left out."""
    return sorted(p.parent for p in out.glob("*/result.json") if not p.parent.name.startswith("."))


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
    """Tell whether ``content[key]`` is a list of JSON objects."""
    rows = content.get(key) if isinstance(content, dict) else None
    return isinstance(rows, list) and all(isinstance(row, dict) for row in rows)


def worst_first(claims: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return claims with the failed ones first, otherwise in their order."""
    order = {verdict: rank for rank, verdict in enumerate(WORST_FIRST)}
    return sorted(claims, key=lambda claim: order.get(claim.get("verdict", ""), -1))


def page(results: Sequence[Mapping[str, Any]]) -> str:
    """Return the whole page."""
    body = "\n".join([_overview(results), *(_section(result) for result in results)])
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<link rel="icon" href="data:,">\n'
        f"<title>Reproduced figures and their claims</title>\n<style>{_STYLE}</style>\n</head>\n"
        f"<body>\n<main>\n<h1>Reproduced figures and their claims</h1>\n{body}\n</main>\n</body>\n</html>\n"
    )


def _overview(results: Sequence[Mapping[str, Any]]) -> str:
    rows = []
    for result in results:
        verdicts = [claim.get("verdict") for claim in result["claims"]]
        counts = [f"{verdicts.count(v)}" for v in VERDICTS]
        link = f'<a href="#{escape(result["folder"])}">{escape(result["folder"])}</a>'
        title = escape(str(result.get("title", result.get("error", ""))))
        rows.append([link, title, *counts])
    heads = ["experiment", "title", *(f"{SIGNS[v]} {v}" for v in VERDICTS)]
    return _table("All experiments in this folder", heads, rows)


def _section(result: Mapping[str, Any]) -> str:
    name = escape(result["folder"])
    title = escape(str(result.get("title", name)))
    parts = [
        f'<section id="{name}" aria-labelledby="{name}-title">',
        f'<h2 id="{name}-title">{name}: {title}</h2>',
    ]
    if "error" in result:
        return "\n".join([*parts, f'<p class="not-reproduced">✗ {escape(result["error"])}</p>', "</section>"])
    facts = ", ".join(f"{key} {_show(result.get(key))}" for key in ("seed", "runs", "seconds"))
    at = quote(result["folder"])
    links = " · ".join(
        f'<a href="{at}/{f}">{f}</a>' for f in ("figure.svg", "figure.png", "result.json", "runs.npz")
    )
    parts += [
        f"<p>{escape(str(result.get('source', '')))}. {escape(facts)}. {links}</p>",
        f'<p><img src="{at}/figure.svg" alt="Figure: {title}"></p>',
        _claims_table(result["claims"]),
        "<details><summary>Assumptions and versions</summary>",
        _assumptions_table(result["assumptions"]),
        _table(
            "Versions",
            ["what", "version"],
            [[escape(k), escape(_show(v))] for k, v in _items(result, "versions")],
        ),
        "</details>\n</section>",
    ]
    return "\n".join(parts)


def _claims_table(claims: Sequence[Mapping[str, Any]]) -> str:
    heads = ["verdict", "claim", "the paper says", "rule", "measured", "interval", "null rate", "share"]
    rows = []
    for claim in claims:
        word = str(claim.get("verdict"))
        kind = word.replace(" ", "-") if word in SIGNS else "not-testable"
        measured = "<br>".join(f"{escape(k)} = {escape(_show(v))}" for k, v in _items(claim, "measured"))
        texts = [escape(str(claim.get(key, ""))) for key in ("id", "text", "rule")]
        texts[1] += f"<br><small>{escape(str(claim.get('source', '')))}</small>"
        numbers = [escape(_show(claim.get(key))) for key in ("ci", "null_rate", "share")]
        rows.append(
            [
                f'<span class="verdict {kind}">{SIGNS.get(word, "?")} {escape(word)}</span>',
                *texts,
                measured,
                *numbers,
            ]
        )
    return _table("Claims, failed ones first", heads, rows)


def _assumptions_table(records: Sequence[Mapping[str, Any]]) -> str:
    rows = []
    for record in records:
        value, default = record.get("value"), record.get("default")
        shown = escape(_show(value))
        if value != default:
            shown = f'<span class="changed">{shown}</span> (changed; default {escape(_show(default))})'
        rows.append(
            [
                escape(str(record.get("key"))),
                shown,
                *(escape(str(record.get(k, ""))) for k in ("unit", "reason")),
            ]
        )
    return _table("Assumptions", ["setting", "value", "unit", "reason of the default"], rows)


def _table(caption: str, heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table; cells are HTML already."""
    head = "".join(f'<th scope="col">{h}</th>' for h in heads)
    body = "\n".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(caption)}">\n<table>\n'
        f"<caption>{escape(caption)}</caption>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table>\n</div>"
    )


def _items(record: Mapping[str, Any], key: str) -> list[tuple[str, Any]]:
    inner = record.get(key)
    return list(inner.items()) if isinstance(inner, dict) else []


def _show(value: Any) -> str:
    """Write a value for a reader: four significant digits, lists in brackets, a dash for nothing."""
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return "[" + ", ".join(_show(v) for v in value) + "]"
    return str(value)

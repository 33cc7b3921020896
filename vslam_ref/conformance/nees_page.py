"""The verdict on a filter's runs as a page, or its figure alone."""

from __future__ import annotations

from html import escape
from pathlib import Path

from vslam_ref.conformance.nees_files import Runs
from vslam_ref.conformance.nees_runs import MEANINGS, Judgement
from vslam_ref.conformance.report import STYLE
from vslam_ref.support import files


def write(path: Path, name: str, runs: Runs, found: Judgement) -> None:
    """Write the page (``.html``) or the figure (``.png``, ``.svg``).

    Parameters
    ----------
    path : Path
        Its suffix tells which.
    name : str
        What was judged.
    runs : Runs
    found : Judgement
        Of these runs.
    """
    from vslam_ref.plot.nees_runs import nees_runs_figure
    from vslam_ref.plot.saving import figure_bytes

    title = f"{Path(name).name}: {found.verdict}"
    figure = nees_runs_figure(
        runs.steps, found.curve, found.windows, runs=found.runs, dof=found.dof, title=title
    )
    if path.suffix == ".html":
        files.write_text(path, _page(name, found, figure_bytes(figure, "svg", "nees").decode()))
    else:
        files.write_bytes(path, figure_bytes(figure, path.suffix[1:], "nees"))


def _page(name: str, found: Judgement, svg: str) -> str:
    picture = svg[svg.index("<svg") :]  # without the XML declaration
    mark = "good" if found.consistent else "bad"
    head = "<tr><th>window</th><th>steps</th><th>mean NEES</th><th>band</th><th>independent steps</th></tr>"
    rows = "".join(
        f"<tr><td>{w.name}</td><td>{w.first + 1} to {w.last + 1}</td><td>{w.mean:.3f}</td>"
        f"<td>{w.low:.3f} to {w.high:.3f}</td><td>{w.independent_steps:.1f}</td></tr>"
        for w in found.windows
    )
    return "".join(
        [
            "<!doctype html><html lang='en'><meta charset='utf-8'>",
            f"<title>Consistency of {escape(name)}</title><style>{STYLE} svg {{ max-width: 100% }}</style>",
            f"<h1>Consistency of <code>{escape(name)}</code></h1>",
            f"<p class='{mark}'><strong>{found.verdict}</strong>: {MEANINGS[found.verdict]}.</p>",
            f"<p>{found.runs} runs of {found.steps} steps, errors of {found.dof} numbers. ",
            f"An honest filter is called otherwise in about {100 * found.false_alarm:g} % ",
            "of such studies.</p>",
            f"<table>{head}{rows}</table>",
            picture,
            "</html>\n",
        ]
    )

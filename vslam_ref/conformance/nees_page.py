"""The verdict on a filter's runs as a page, or its figure alone."""

from __future__ import annotations

from pathlib import Path

from vslam_ref.conformance.nees_files import Runs
from vslam_ref.conformance.nees_runs import MEANINGS, Judgement
from vslam_ref.support import files
from vslam_ref.support.pages import Html, page, table, tag


def write(path: Path, name: str, runs: Runs, found: Judgement) -> None:
    """Write the page (``.html``) or the figure (``.png``, ``.svg``).

    Parameters
    ----------
    path : Path
        Its suffix says which.
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
    rows = [
        [
            w.name, f"{w.first + 1} to {w.last + 1}", f"{w.mean:.3f}", f"{w.low:.3f} to {w.high:.3f}",
            f"{w.independent_steps:.1f}",
        ]
        for w in found.windows
    ]  # fmt: skip
    heads = ["window", "steps", "mean NEES", "band", "independent steps"]
    words = (
        f"{found.runs} runs of {found.steps} steps, errors of {found.dof} numbers. An honest filter is "
        "called "
        f"otherwise in about {100 * found.false_alarm:g} % of such studies."
    )
    verdict = tag("strong", found.verdict)
    return page(
        f"Consistency of {name}",
        tag("p", verdict, f": {MEANINGS[found.verdict]}.", class_="good" if found.consistent else "bad"),
        tag("p", words),
        table(heads, rows, caption="Windows", kind="numbers"),
        Html(svg[svg.index("<svg") :]),  # without the XML declaration
        heading=Html(f"Consistency of {tag('code', name)}"),
    )

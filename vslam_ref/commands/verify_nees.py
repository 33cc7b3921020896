"""``vslam-ref verify --nees``: a filter judged by its simulated runs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from vslam_ref.commands.options import write_json

if TYPE_CHECKING:
    from vslam_ref.conformance.nees_runs import Judgement


def judge_runs(options: argparse.Namespace, target: Path | None, page: Path | None) -> int:
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

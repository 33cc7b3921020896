"""What ``vslam-ref run`` leaves: numbers, trajectories, maps, figures and one page that shows them.

::

    OUT/result.json               the numbers that were printed
    OUT/trajectory_<filter>.csv   time, x, y, theta, sd of each; the run's own frame (start = origin)
    OUT/map_<filter>.csv          id, x, y, variances and covariance; same frame
    OUT/map.svg, .png             map and trajectory beside the truth
    OUT/errors.svg, .png          errors with 3 sigma bands; only where there is truth
    OUT/report.html
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.slam_log.compare import Comparison
from vslam_ref.geometry import se2, so2
from vslam_ref.plot.saving import save_figure
from vslam_ref.plot.slam_log import Drawn, error_figure, map_figure
from vslam_ref.support import files, pages
from vslam_ref.support.json_text import to_json
from vslam_ref.systems.slam_log import KEYS, LogRun, LogTruth, place
from vslam_ref.systems.slam_log.evaluate import reference_point

TRAJECTORY = "time_s,x_m,y_m,theta_rad,sd_x_m,sd_y_m,sd_theta_rad"
MAP = "id,x_m,y_m,var_x_m2,cov_xy_m2,var_y_m2"

UNITS = {"rmse_heading_rad": "rad", "landmarks": "", "nees_mean": "", "rejected": ""}
WORDS = {
    "rmse_position_m": "position, aligned",
    "rmse_position_unaligned_m": "position, not aligned",
    "rmse_heading_rad": "heading, aligned",
    "landmarks": "landmarks",
    "landmark_rmse_m": "landmarks, aligned",
    "nees_mean": "mean NEES (3 is consistent)",
    "rejected": "rejected sightings",
}


def write_report(out: Path, comparison: Comparison, content: Mapping[str, Any]) -> None:
    """Write everything into a temporary folder and let it take the place of ``out``."""
    drawn = {name: drawn_run(run, comparison.source.truth) for name, run in all_runs(comparison).items()}
    title = comparison.source.log.name
    truth = comparison.source.truth
    path = truth_path(truth) if truth is not None else np.zeros((0, 2))
    marks = truth.landmarks if truth is not None else np.zeros((0, 2))
    with files.new_folder(out) as folder:
        (folder / "result.json").write_text(to_json(content), encoding="utf-8", newline="\n")
        for name, run in all_runs(comparison).items():
            _write_csv(folder / f"trajectory_{name}.csv", TRAJECTORY, _trajectory(run))
            _write_csv(folder / f"map_{name}.csv", MAP, _map(run), integers=1)
        save_figure(map_figure(drawn, path, marks, title), folder, title, "map")
        errors = error_figure(
            drawn, f"{title}: errors, not aligned" if _exact(truth) else f"{title}: errors, aligned"
        )
        if errors is not None:
            save_figure(errors, folder, title, "errors")
        (folder / "report.html").write_text(
            page(content, title, errors is not None), encoding="utf-8", newline="\n"
        )


def all_runs(comparison: Comparison) -> dict[str, LogRun]:
    """Filters and, last, the batch solution."""
    bound = {} if comparison.batch is None else {"batch": comparison.batch}
    return {**comparison.runs, **bound}


def _exact(truth: LogTruth | None) -> bool:
    return truth is not None and truth.exact


def truth_path(truth: LogTruth) -> Array:
    """True positions (N, 2) with a row of NaN where the truth is interrupted."""
    gaps = np.flatnonzero(np.diff(truth.times) > truth.max_gap) + 1
    return np.insert(truth.T_world_vehicle[:, :2], gaps, np.nan, axis=0)


def drawn_run(run: LogRun, truth: LogTruth | None) -> Drawn:
    """A run in the world frame: path and map aligned; errors unaligned where the truth is exact."""
    aligned = place(run, truth, aligned=True) if truth is not None else None
    T = aligned.T_world_run if aligned is not None else np.zeros(3)
    shown = place(run, truth, aligned=False) if truth is not None and truth.exact else aligned
    R = so2.exp(T[2])
    empty = np.zeros((0, 3))
    lever = truth.lever if truth is not None else np.zeros(2)
    at, _ = reference_point(run.T_run_vehicle, run.covs, lever)
    return Drawn(
        name=run.filter,
        path=se2.compose(T, at)[:, :2],
        landmarks=se2.act(T, run.map.mean[0]),
        landmark_cov=R @ run.map.cov[0] @ R.T,
        times=shown.times if shown is not None else empty[:, 0],
        errors=shown.errors if shown is not None else empty,
        sigmas=np.sqrt(np.einsum("kii->ki", shown.covs)) if shown is not None else empty,
    )


def _trajectory(run: LogRun) -> Array:
    return np.column_stack([run.times, run.T_run_vehicle, np.sqrt(np.einsum("kii->ki", run.covs))])


def _map(run: LogRun) -> Array:
    cov = run.map.cov[0]
    return np.column_stack([run.map.ids, run.map.mean[0], cov[:, 0, 0], cov[:, 0, 1], cov[:, 1, 1]])


def _write_csv(path: Path, head: str, rows: Array, integers: int = 0) -> None:
    """Write numbers that read back to 9 digits; unknown ones are empty fields."""
    lines = [head]
    for row in rows.tolist():
        words = [f"{int(v)}" for v in row[:integers]]
        words += ["" if np.isnan(v) else f"{v:.9g}" for v in row[integers:]]
        lines.append(",".join(words))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def number_rows(content: Mapping[str, Any]) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of the table of numbers: one row a key, one column a filter."""
    columns = dict(content["filters"])
    if content["batch"] is not None:
        columns["batch"] = content["batch"]
    rows = []
    for key in KEYS:
        unit = UNITS.get(key, "m")
        label = f"{WORDS[key]} [{unit}]" if unit else WORDS[key]
        rows.append([label, *(_show(numbers[key]) for numbers in columns.values())])
    return ["", *columns], rows


def _show(value: Any) -> str:
    if value is None:
        return "-"
    return str(value) if isinstance(value, int) else f"{value:.4g}"


def page(content: Mapping[str, Any], title: str, errors: bool) -> str:
    """``report.html``: figures beside it, the table of numbers in it."""
    heads, rows = number_rows(content)
    dropped = ", ".join(f"{n} {what}" for what, n in content["dropped"].items()) or "none"
    notes = f"{content['sightings']} sightings; dropped by the reader: {dropped}. "
    notes += f"Reference: {content['truth'] or 'none'}."
    return pages.page(
        title,
        pages.tag("p", notes),
        pages.table(heads, rows, caption="Numbers", kind="numbers"),
        pages.image("map.svg", "Map and trajectory beside the truth"),
        pages.image("errors.svg", "Errors with 3 sigma bands") if errors else None,
        pages.tag("p", pages.links({"result.json": "result.json"})),
    )

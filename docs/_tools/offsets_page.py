"""Make ``docs/ptam-offsets.md`` from the results of ``ptam-offsets`` and ``ptam-scenes``.

    vslam-ref reproduce ptam-offsets ptam-scenes --out out
    for p in ptam2007 no_warp least_squares absolute_score no_search_back; do
      vslam-ref reproduce ptam-offsets --set preset=$p --out out/$p
    done
    python docs/_tools/offsets_page.py out

The runs take minutes and need recorded data, so the page is committed with the numbers of one run.  Nothing
on it is written by hand but the words around the tables.
"""

from __future__ import annotations

import json
import math
import shutil
import statistics
import sys
from pathlib import Path
from typing import Any

import book

PAGE = book.DOCS / "ptam-offsets.md"
FIGURES = book.DOCS / "_static"
CAPTION = "Each dot is a run; the line is their median, dashed is the bound."
HEAD = """\
# PTAM from ten first pictures

How good is the system of {doc}`chapter 12 <chapters/12_ptam>`? One run over one clip says little: where it
begins decides which two pictures make the map. So every recorded sequence is run from ten first pictures,
written down in a table before the runs, and the median is judged. All ten are shown. To repeat it, with the
data sets:

```sh
vslam-ref reproduce ptam-offsets ptam-scenes --out out
```

A run that has no map in time counts as one that tracked nothing. "Of all" are the pictures from the first one
to the last; those between the two of the start are tracked afterwards, and count. The error is that of the
final path, root mean square, after a similarity. The live path is what was told at each picture, before
anything later could mend it. The drift is the scale of the last third of the path over that of the first: 1
is none, below 1 the map grew.

**How much this proves.** The system's settings were chosen while looking at the kitchen, at Tsukuba, at KITTI
and at alva; the fixed camera and the rendered scenes of these seeds were not looked at. The kitchen's truth
is itself worth 3 to 4 cm: no error below that can be told from it, and the distance from COLMAP's path is the
second opinion. alva has no truth; its unit is a tenth of COLMAP's path.
"""


def shown(value: Any, digits: int = 3) -> str:
    """A number as people read it; a dash where there is none."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "–"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def percent(share: Any) -> str:
    """A share in percent."""
    return "–" if share is None or not math.isfinite(share) else f"{100 * share:.1f} %"


def middle(values: list[Any]) -> float:
    """Median; a run without a number counts as infinite."""
    return statistics.median(math.inf if v is None or not math.isfinite(v) else v for v in values)


def table(heads: list[str], rows: list[list[str]]) -> str:
    """A table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def summary(series: dict[str, Any]) -> str:
    """One line a sequence, and one for each other program."""
    rows = []
    for name, runs in series.items():
        if not any(runs["started"]):
            rows.append(
                [f"**{name}** (must not start)", f"0 of {len(runs['started'])}", "–", "–", "–", "–", "–"]
            )
            continue
        share = [s if started else 0.0 for s, started in zip(runs["share_all"], runs["started"], strict=True)]
        finite = [e for e in runs["error"] if e is not None and math.isfinite(e)]
        rows.append([
            f"**{name}**", f"{sum(runs['started'])} of {len(share)}", percent(statistics.median(share)),
            percent(middle(runs["share_after"])), f"{shown(middle(runs['error']))} {runs['unit']}",
            shown(max(finite)), shown(middle(runs["drift"])),
        ])  # fmt: skip
        rows += [
            [f"{name}, {other['system']} ({other['source']})", "", percent(other.get("share_all")), "",
             f"{shown(other.get('error'))} {runs['unit']}", "", ""]
            for other in runs["beside"]
        ]  # fmt: skip
    heads = ["", "started", "with a pose, of all", "after the start", "error, median", "worst", "drift"]
    return table(heads, rows)


def every_run(name: str, runs: dict[str, Any]) -> str:
    """All runs of a sequence."""
    rows = [
        [str(runs["offset"][k]),
         "–" if not runs["started"][k] else f"{runs['first'][k]}, {runs['second'][k]}",
         percent(runs["share_all"][k]), percent(runs["share_after"][k]), shown(runs["error"][k]),
         shown(runs["live"][k]), shown(runs["second_error"][k]), shown(runs["drift"][k]),
         str(runs["keyframes"][k]), str(runs["points"][k])]
        for k in range(len(runs["offset"]))
    ]  # fmt: skip
    refined = any(v is not None and math.isfinite(v) for v in runs["refined_error"])
    if refined:
        for k, row in enumerate(rows):
            row += [shown(runs["refined_error"][k]), shown(runs["refined_drift"][k])]
    heads = ["first", "start", "of all", "after", f"error [{runs['unit']}]", "live", "to COLMAP", "drift",
             "keyframes", "points"] + ["refined: error", "refined: drift"] * refined  # fmt: skip
    reasons = sorted({r for r in runs["reason"] if r})
    told = "".join(f"\n\nNo start: {reason}" for reason in reasons)
    return f"### {name}: every run\n\n{table(heads, rows)}{told}"


def verdicts(result: dict[str, Any]) -> str:
    """Every claim with its verdict, failed ones first."""
    order = {"not reproduced": 0, "not testable": 1, "reproduced": 2}
    claims = sorted(result["claims"], key=lambda claim: order[claim["verdict"]])
    return table(["bound", "found"], [[c["text"], c["sentence"]] for c in claims])


def presets(out: Path, whole: dict[str, Any]) -> str:
    """The same table of medians for the system with one part taken out, and as it was published."""
    from vslam_ref.systems.ptam.presets import PRESETS

    found = {"as it is": whole} | {
        name: json.loads(path.read_text(encoding="utf-8"))["series"]
        for name in PRESETS
        if (path := out / name / "ptam-offsets" / "result.json").is_file()
    }
    names = [name for name, runs in whole.items() if any(runs["started"])]
    rows = []
    for preset, series in found.items():
        cells = []
        for name in names:
            runs = series[name]
            share = [a if s else 0.0 for a, s in zip(runs["share_all"], runs["started"], strict=True)]
            error = middle(runs["error"])
            cells.append(f"{percent(statistics.median(share))}; {shown(error)} {runs['unit'].split()[0]}")
        meaning = PRESETS[preset].meaning if preset in PRESETS else ""
        rows.append([f"`{preset}`" if meaning else f"**{preset}**", meaning, *cells])
    words = (
        "Medians of the ten runs: pictures with a pose, of all, and error. A run without a map in time "
        "counts as "
        "the worst, so an error of – means that most had none. On easy films one part more or less "
        "changes little: the parts overlap. `vslam-ref reproduce ptam-parts` takes each out where it "
        "should matter."
    )
    heads = ["settings", "what they are", *names]
    return f"## One part taken out, and as it was published\n\n{words}\n\n{table(heads, rows)}"


def main(arguments: list[str]) -> int:
    """Write the page from a folder of results."""
    if len(arguments) != 1:
        print("usage: python docs/_tools/offsets_page.py FOLDER", file=sys.stderr)
        return 2
    parts = [HEAD]
    titles = {"ptam-offsets": "Recorded sequences", "ptam-scenes": "Rendered scenes"}
    for id, title in titles.items():
        folder = Path(arguments[0]) / id
        result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        if result["quick"]:
            print(f"{folder}: a quick run is no result", file=sys.stderr)
            return 2
        shutil.copyfile(folder / "figure.png", FIGURES / f"{id}.png")
        made = result["versions"]
        parts += [
            f"## {title}",
            summary(result["series"]),
            f"```{{figure}} _static/{id}.png\n{CAPTION}\n```",
            "\n\n".join(every_run(name, runs) for name, runs in result["series"].items()),
            f"### Bounds\n\n{verdicts(result)}",
            f"Measured with version {made['vslam_ref']}, backend {made.get('backend', 'numba')}, "
            f"NumPy {made['numpy']}.",
        ]
        if id == "ptam-offsets":
            parts.append(presets(Path(arguments[0]), result["series"]))
    PAGE.write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    print(PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

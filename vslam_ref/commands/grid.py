"""``vslam-ref grid``: static and dynamic maps of a laser log."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vslam_ref.commands.options import (
    add_json,
    json_target,
    print_backend,
    print_notes,
    progress_bar,
    warm,
    write_json,
)

if TYPE_CHECKING:
    from vslam_ref.datasets.carmen import CarmenLog
    from vslam_ref.experiments.grid_log.mapping import GridConfig, Mapped

HELP = "draw the static and the dynamic map of a laser log with known poses"
EPILOG = """\
LOG is a log in CARMEN's text format, plain or '.gz', whose poses are known (a corrected log), or the name
of one of the set carmen_2d, found through VSLAM_REF_DATA: intel, csail, aces, freiburg-079, edmonton, fhw.
Its scans are FLASER lines, or ROBOTLASER1, or RAWLASER1 with the poses of ODOM.  The field of view is the
file's where it tells one (ROBOTLASER1, RAWLASER1, PARAM laser_front_laser_fov), else half a circle for 180,
181, 360 and 361 beams; another number of beams is taken for the likeliest scanner, with a note, and '--fov'
tells the field of view.

numbers (also in --json): scans, stamps that do not move forward, beams by kind, cells looked at, mean entropy
of the static map in bit per cell, cells that were ever dynamic, things that moved at least a metre,
and the time that the two maps took.

'--set map.settle_seconds=none' and '--set map.explained_by=0' give the table of the book as it is printed.

examples, after 'vslam-ref sample laser --out samples':
  vslam-ref grid samples/laser/office.log --out out/office
  vslam-ref grid samples/laser/office.log --out out/fine --resolution 0.05 --json fine.json
and with known data sets:
  vslam-ref grid intel --out out/intel
  vslam-ref grid freiburg-079-corrected.log.gz --out out/fr079"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument("log", metavar="LOG", help="laser log; see below")
    parser.add_argument("--out", metavar="DIR", required=True, help="write maps, film and page there")
    parser.add_argument(
        "--fov",
        type=field_of_view,
        metavar="DEGREES",
        help="field of view, whatever the file says of it",
    )
    parser.add_argument(
        "--resolution", type=float, metavar="M", help="side of a cell in metres (default: 0.1)"
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="change a setting; may be repeated"
    )
    parser.add_argument(
        "--video",
        choices=("small", "half", "full", "none"),
        default="small",
        help="film: 320 pixels wide (small, the default), half or full size of the pictures, or none",
    )
    add_json(parser)


def field_of_view(text: str) -> float:
    """Read degrees, more than 0 and up to a full circle."""
    try:
        degrees = float(text)
    except ValueError:
        degrees = 0.0
    if not 0 < degrees <= 360:
        raise argparse.ArgumentTypeError(f"{text!r}: expected degrees, more than 0 and up to 360")
    return degrees


def run(options: argparse.Namespace) -> int:
    """Read the log, draw the maps, print and write the numbers."""
    target = json_target(options)

    from vslam_ref import _kernels
    from vslam_ref.commands.tables import table
    from vslam_ref.datasets import carmen
    from vslam_ref.experiments.grid_log import report
    from vslam_ref.experiments.grid_log.mapping import GridConfig
    from vslam_ref.support import files
    from vslam_ref.support.config import apply_overrides, config_to_dict
    from vslam_ref.support.provenance import versions

    out = files.require_new_folder(options.out, "result.json")
    given = [] if options.resolution is None else [f"map.resolution={options.resolution!r}"]
    config = apply_overrides(GridConfig(), [*given, *options.set])
    fov = None if options.fov is None else math.radians(options.fov)
    log = carmen.read(find_log(options.log), field_of_view=fov)
    warm("grids")
    with files.new_folder(out) as folder:
        mapped = draw(log, config, folder, options.video)
        content: dict[str, Any] = mapped.numbers() | {"backend": _kernels.backend()}
        content |= {"notes": list(log.notes), "config": config_to_dict(config), "versions": versions()}
        report.write_report(folder, mapped, content)
    print(table(["what", "value", "unit"], report.number_rows(content)))
    print_notes(log.notes)
    print_backend()
    print(f"page: {out / 'report.html'}")
    write_json(target, content)
    return 0


def find_log(name: str) -> Path:
    """Return the file of that name, or the log of the known set that is called so."""
    from vslam_ref.datasets import catalogue
    from vslam_ref.datasets.text import FormatError

    path = Path(name)
    if path.is_file():
        return path
    folder = catalogue.find("carmen_2d")
    known = {p.name.split("-corrected")[0]: p for p in sorted(folder.glob("*.log.gz"))} if folder else {}
    if name in known:
        return known[name]
    others = f", or one of {', '.join(known)}" if known else ""
    raise FormatError(path, None, f"no such file; expected a CARMEN log{others}")


def draw(log: CarmenLog, config: GridConfig, folder: Path, video_size: str) -> Mapped:
    """Run over the log with a film and a progress bar."""
    from vslam_ref.datasets import video
    from vslam_ref.experiments.grid_log.frames import Director
    from vslam_ref.experiments.grid_log.mapping import map_log
    from vslam_ref.experiments.grid_log.report import FILM

    with progress_bar(len(log.times), "scan") as bar:

        def progress(done: int) -> None:
            bar.update(done - bar.n)

        if not config.video_frames or video_size == "none":
            return map_log(log, config, None, progress)
        with video.webm(folder / FILM, video_size) as film:
            return map_log(log, config, Director(film, len(log.times), config.video_frames), progress)

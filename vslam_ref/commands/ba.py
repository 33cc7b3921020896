"""``vslam-ref ba``: bundle adjustment of a file."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from vslam_ref.commands.options import (
    add_json,
    add_set,
    file_target,
    json_target,
    print_notes,
    warm,
    write_json,
)
from vslam_ref.commands.steps import StepTable

if TYPE_CHECKING:
    from vslam_ref.datasets.bundle_files import BundleFile
    from vslam_ref.estimation.bundle import BundleProblem, BundleResult, Robust

HELP = "adjust a bundle: cameras and points from their images"
EPILOG = """\
formats (seen from the content): BAL text, plain or with .gz or .bz2; libmv .bin; Bundler bundle.out; a folder
with COLMAP's cameras, images and points3D, all .bin or all .txt (with both, the binary ones, as COLMAP does).
Its cameras may be of several lens families; its poses are those of rigs and frames where these files are
there, but every image moves by itself.

What is odd in a file and harmless is told in lines 'note: ...', and in the list 'notes' of --json.

--out FOLDER (new, empty, or with such a model) is written in COLMAP's text form; with --binary in its binary
form, from which COLMAP also reads image names with blanks. All outputs are checked before the work; --json is
written first, and whatever becomes of the others.

losses: l2 (least squares, the default), huber, cauchy, geman-mcclure, tukey. A robust loss needs the size of
an honest error: pixels, or 'adaptive', from the median of the errors after every step, as in PTAM.

Poses and points move; of the intrinsics those that the format says, or those that --free names (f is one
focal length for both axes, 'none' is none). Nothing is written where there is nothing to adjust.

examples, after 'vslam-ref sample bal colmap --out samples':
  vslam-ref ba samples/bal/problem.txt --json result.json --ply scene.ply
  vslam-ref ba samples/bal/problem.txt --free f --loss tukey --scale 1.5
  vslam-ref ba samples/colmap/model --out adjusted --set cost=1e-10 --set max_iterations=200
and with a known data set:
  vslam-ref ba problem-16-22106-pre.txt.bz2"""

LOSSES = ("l2", "huber", "cauchy", "geman-mcclure", "tukey")
BACKENDS = ("auto", "numpy", "numba")
HOPELESS = {
    "no_observations": "has no observations",
    "no_images": "has every observed point behind its camera",
    "all_outliers": "has no error that is small against the scale",
    "nothing_free": "has nothing that may move",
    "not_finite": "has a cost that is not finite",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument("file", metavar="FILE", help="the problem; see below")
    parser.add_argument("--loss", choices=LOSSES, default="l2", help="loss of an error (default: l2)")
    parser.add_argument(
        "--scale",
        metavar="PIXELS",
        help="standard deviation of an honest error, or 'adaptive' (default with a robust loss)",
    )
    parser.add_argument("--free", metavar="NAMES", help="intrinsics that move, as f,k1,k2; or none")
    parser.add_argument(
        "--gauge",
        choices=("free", "fixed"),
        default="free",
        help="fixed: hold the first view, and the scale (default: free)",
    )
    parser.add_argument("--backend", choices=BACKENDS, default="auto", help="NumPy or Numba (default: auto)")
    parser.add_argument(
        "--out", metavar="FILE", help="write the result: BAL (.txt, .gz, .bz2) or a COLMAP folder"
    )
    parser.add_argument("--binary", action="store_true", help="--out a COLMAP folder in its binary form")
    parser.add_argument("--ply", metavar="FILE", help="write points and cameras for a viewer (.ply)")
    add_set(parser, "cost, gradient, scale, max_iterations, damping, method")
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Read, adjust, print the numbers and write what was asked for."""
    from vslam_ref import _kernels
    from vslam_ref.datasets.bundle_files import read_bundle
    from vslam_ref.datasets.bundle_files.misread import likely_misread
    from vslam_ref.estimation.bundle import Options, bundle_adjust
    from vslam_ref.estimation.bundle.diagnosis import diagnose
    from vslam_ref.support.config import apply_overrides

    outputs = _Outputs.checked(options)
    settings = apply_overrides(Options(), options.set)
    robust = _robust(options.loss, options.scale)
    file = read_bundle(Path(options.file))
    file = replace(file, problem=_problem(file, options))
    told = outputs.sayable(file)
    views, points, seen = file.problem.sizes
    print(f"{options.file}: {views} cameras, {points} points, {seen} observations")
    if not (points and seen):
        raise ValueError(_nothing(options.file, views, points))
    notes = print_notes([*file.notes, *diagnose(file.problem).sentences(), *told])
    with _kernels.use_backend(options.backend) as backend:
        warm("bundle", "bundle_schur")  # compiling is no part of the time
        wall, cpu = time.perf_counter(), time.process_time()
        result = bundle_adjust(file.problem, robust, settings, StepTable())
        spent = {"seconds": time.perf_counter() - wall, "cpu_seconds": time.process_time() - cpu}
        why = likely_misread(file, result, lambda other: bundle_adjust(other, robust, settings))
    if result.reason in HOPELESS:
        end = "nothing was adjusted, nothing written"
        raise ValueError(f"{options.file} {HOPELESS[result.reason]}: {end}{why and '; '}{why}")
    numbers = _numbers(result) | spent | {"backend": backend}
    _show(numbers, result)
    notes += print_notes([*_unfinished(result), *([why] if why else [])])
    outputs.write({**numbers, "notes": notes}, file.at(result.problem.scene))
    return 0


class _Outputs(NamedTuple):
    """Checked paths of what is written in the end."""

    json: Path | None
    ply: Path | None
    out: Path | None
    binary: bool

    @classmethod
    def checked(cls, options: argparse.Namespace) -> _Outputs:
        """Check names and folders, before anything is read."""
        from vslam_ref.datasets.bundle_files import require_target

        if options.binary and options.out is None:
            raise ValueError("--binary: a form of --out's COLMAP folder; give --out FOLDER")
        out = None if options.out is None else require_target(options.out, binary=options.binary)
        found = cls(json_target(options), file_target(options.ply, (".ply",)), out, options.binary)
        paths = [path.resolve() for path in found[:3] if path is not None]
        if len(set(paths)) < len(paths):
            raise ValueError("two outputs have one name: --json, --ply and --out must differ")
        return found

    def sayable(self, file: BundleFile) -> tuple[str, ...]:
        """Refuse what the format of ``--out`` cannot say, before any work; what is told of it."""
        from vslam_ref.datasets.bundle_files import require_sayable

        return () if self.out is None else require_sayable(self.out, file, binary=self.binary)

    def write(self, numbers: dict[str, Any], after: BundleFile) -> None:
        """Write all: the numbers first, and one that fails keeps none of the others from being written."""
        from vslam_ref.datasets.bundle_files import write_bundle, write_ply

        work: tuple[tuple[Path | None, Callable[[Path], None]], ...] = (
            (self.json, lambda path: write_json(path, numbers)),
            (self.out, lambda path: write_bundle(path, after, binary=self.binary)),
            (self.ply, lambda path: write_ply(path, after)),
        )
        failed: list[Exception] = []
        for path, write in work:
            try:
                if path is not None:
                    write(path)
            except (OSError, ValueError) as error:
                failed.append(error)
        if failed:
            raise failed[0]


def _nothing(name: str, views: int, points: int) -> str:
    """Why a file without points or observations is not adjusted."""
    if points:
        return f"{name} has {points} points and no observations of them: nothing to adjust"
    hint = "poses alone, as of a model with known poses; triangulate points first (colmap point_triangulator)"
    return f"{name} has {views} cameras and no points: nothing to adjust ({hint})"


def _unfinished(result: BundleResult) -> list[str]:
    """What is told of an adjustment that did not come to rest."""
    if result.converged:
        return []
    if result.reason != "max_iterations":
        return [f"not converged after {result.iterations} steps: {result.message}"]
    last = next((step.decrease for step in reversed(result.history) if step.accepted), 0.0)
    still = (
        f"the last one still lowered the cost by {last / result.cost:.1g} of itself"
        if last
        else "none helped"
    )
    return [f"not converged after {result.iterations} steps: {still}; --set max_iterations=N takes more"]


def _robust(name: str, scale: str | None) -> Robust:
    """The loss with its 95 % constant for plane errors, and its scale."""
    from vslam_ref.estimation.bundle import Robust
    from vslam_ref.estimation.robust import LOSSES as BY_NAME
    from vslam_ref.estimation.robust import TUNED_95

    if name == "l2":
        if scale is not None:
            raise ValueError("--scale: least squares has no scale; choose a robust --loss")
        return Robust()
    loss = BY_NAME[name](TUNED_95[name, 2])
    if scale in (None, "adaptive"):
        return Robust(loss, "adaptive")
    try:
        return Robust(loss, float(scale or ""))
    except ValueError:
        raise ValueError(f"--scale {scale!r}: expected pixels, a number > 0, or 'adaptive'") from None


def _problem(file: BundleFile, options: argparse.Namespace) -> BundleProblem:
    """The file's problem with the freedom that was asked for."""
    from vslam_ref.estimation.bundle import freedom
    from vslam_ref.estimation.bundle.gauge import fix_gauge

    problem = file.problem
    if options.free is not None:
        words = [word.strip() for word in options.free.split(",") if word.strip()]
        names = () if words == ["none"] else tuple(words)
        problem = replace(problem, free=freedom(problem.model, problem.scene, intrinsics=names))
    return fix_gauge(problem) if options.gauge == "fixed" else problem


def _numbers(result: BundleResult) -> dict[str, Any]:
    views, points, seen = result.problem.sizes
    return {
        "cameras": views,
        "points": points,
        "observations": seen,
        "initial_cost": result.initial_cost,
        "final_cost": result.cost,
        "iterations": result.iterations,
        "reason": result.reason,
        "converged": result.converged,
        "rmse_px": result.rmse_px,
        "sigma": result.sigma,
        "set_aside": int(result.aside.sum()),
    }


def _show(numbers: dict[str, Any], result: BundleResult) -> None:
    from vslam_ref.commands.tables import table

    rows = [
        ["cost at the start", f"{numbers['initial_cost']:.6f}"],
        ["cost at the end", f"{numbers['final_cost']:.6f}"],
        ["RMSE [px]", f"{numbers['rmse_px']:.6f}"],
        ["iterations", str(numbers["iterations"])],
        ["ended", f"{result.reason}: {result.message}"],
        ["backend", numbers["backend"]],
        ["seconds (CPU)", f"{numbers['seconds']:.3f} ({numbers['cpu_seconds']:.3f})"],
    ]
    if result.aside.any():
        rows.append(["observations set aside", f"{numbers['set_aside']} without an image at the start"])
    print(table(["what", "value"], rows))

"""``vslam-ref calibrate``: a camera from images of a checkerboard."""

from __future__ import annotations

import argparse
import time
from typing import TYPE_CHECKING, Any

from vslam_ref.commands.options import (
    add_json,
    file_target,
    json_target,
    print_backend,
    print_notes,
    write_json,
)

if TYPE_CHECKING:
    from vslam_ref.commands.board_images import BoardImages
    from vslam_ref.estimation.calibration import Calibration

HELP = "calibrate a camera from images of a checkerboard"
EPILOG = """\
The board is given by its INNER corners: a board of 10 x 7 squares is 9x6. OpenCV finds the corners. Take 10
or more images, with the whole board in sight, tilted by 30 to 45 degrees in different directions, near and
far, and into all corners of the image.

models:
  radtan    fx fy cx cy k1 k2 p1 p2 k3: radial and tangential (OpenCV, Kalibr, EuRoC); the default
  fov       fx fy cx cy omega: one angle (PTAM, TUM-mono)
  fisheye   fx fy cx cy k1 k2 k3 k4: equidistant, for lenses of more than about 120 degrees
  pinhole   fx fy cx cy: no distortion
  rational  as radtan, with k4 k5 k6: needs many images

Nothing is written, and the status is 2, where the images do not determine the camera: a focal length or a
centre with a standard deviation of more than 5 % of the focal length. The line names the parameters and the
cause, as boards that are all parallel. What is only weak is told by a line 'note: ...': a sensor beyond 1 %,
or a lens that leaves the place of a ray open by more than 2 % of the focal length, RMS over the picture (no
board near the picture's border). Images without a board are named and left out, and so are copies: images
whose corners are within 0.25 px of those of another.

examples, after 'vslam-ref sample boards --out samples':
  vslam-ref calibrate samples/boards/radtan --board 9x6 --out camera.yaml
  vslam-ref calibrate samples/boards/fov --board 9x6 --model fov --square 0.025 --json calibration.json
  vslam-ref calibrate samples/boards/radtan --board 9x6 --fix k3=0 --aspect 1 --loss tukey
and with your own pictures:
  vslam-ref calibrate left*.jpg --board 9x6"""

LOSSES = ("l2", "huber", "tukey")
MODELS = ("radtan", "fov", "fisheye", "pinhole", "rational")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument("images", metavar="IMAGES", nargs="+", help="image files, or folders of images")
    parser.add_argument("--board", metavar="CxR", required=True, help="inner corners of the board, as 9x6")
    parser.add_argument("--model", choices=MODELS, default="radtan", help="lens model (default: radtan)")
    parser.add_argument(
        "--square",
        metavar="SIZE",
        type=float,
        default=1.0,
        help="side of a square, the unit of poses (default: 1)",
    )
    parser.add_argument(
        "--fix",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="keep a parameter, as k3=0",
    )
    parser.add_argument("--aspect", metavar="RATIO", type=float, help="keep fy = RATIO fx")
    parser.add_argument(
        "--loss", choices=LOSSES, default="l2", help="robust loss, against wrong corners (default: l2, none)"
    )
    parser.add_argument("--out", metavar="FILE", help="write the camera to FILE, as OpenCV's YAML")
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Find the corners, calibrate, print the numbers and write what was asked for."""
    from vslam_ref.commands.board_images import find_boards
    from vslam_ref.datasets.calibration_files import CameraFile, write_opencv
    from vslam_ref.datasets.pictures import image_files
    from vslam_ref.estimation.calibration import Board, calibrate, calibrate_robustly, doubts

    target = json_target(options)
    out = file_target(options.out)
    board = Board.from_text(options.board, options.square)
    fixed = _fixed(options.fix)
    began = time.perf_counter()
    found = find_boards(image_files(options.images), board)
    views = [(board.points, uv) for uv in found.corners]
    more: dict[str, Any] = {"fixed": fixed, "aspect": options.aspect}
    try:
        if options.loss == "l2":
            result = calibrate(views, found.size, options.model, **more)
        else:
            result = calibrate_robustly(views, found.size, options.model, options.loss, **more).calibration
        _refuse(result)
    except ValueError as error:
        raise ValueError(f"{error}{found.aside()}") from None
    seconds = time.perf_counter() - began
    notes = [*found.notes(), *doubts(result, found.size)]
    numbers = _numbers(options.model, found, result, seconds) | {"notes": notes}
    _show(numbers, result)
    write_json(target, numbers)
    if out is not None:
        write_opencv(out, CameraFile(result.camera, found.size))
        print(f"camera written to {out}")
    return 0


def _fixed(words: list[str]) -> dict[str, float]:
    """Read ``NAME=VALUE``."""
    fixed: dict[str, float] = {}
    for word in words:
        name, _, value = word.partition("=")
        try:
            fixed[name.strip()] = float(value)
        except ValueError:
            raise ValueError(f"--fix {word!r}: expected NAME=VALUE, as k3=0") from None
    return fixed


def _refuse(result: Calibration) -> None:
    """Say in one line why there is no camera."""
    if result.undetermined:
        raise ValueError(f"the images do not determine the camera: {result.undetermined}")
    if not result.converged:
        raise ValueError(
            f"not converged after {result.iterations} iterations ({result.reason}): {result.message}"
        )


def _numbers(model: str, found: BoardImages, result: Calibration, seconds: float) -> dict[str, Any]:
    camera = result.camera
    return {
        "model": model,
        "image_size": list(found.size),
        "images": found.total,
        "used": len(found.used),
        "skipped": [str(path) for path in found.skipped],
        "copies": [{"file": str(path), "of": str(first)} for path, first in found.copies],
        "rms_px": result.rms_px,
        "mean_px": result.mean_px,
        "camera_matrix": camera.matrix.tolist(),
        "distortion": camera.params[4:].tolist(),
        "parameters": dict(zip(camera.names(), camera.params.tolist(), strict=True)),
        "std": result.std,
        "per_image": [
            {"file": str(path), "rms_px": rms}
            for path, rms in zip(found.used, result.view_rms_px.tolist(), strict=True)
        ],
        "iterations": result.iterations,
        "reason": result.reason,
        "seconds": seconds,
    }


def _show(numbers: dict[str, Any], result: Calibration) -> None:
    from vslam_ref.commands.tables import table

    rows = [[str(one["file"]), f"{one['rms_px']:.4f}"] for one in numbers["per_image"]]
    print(table(["image", "rms [px]"], rows))
    print_notes(numbers["notes"])
    print()
    values, std = numbers["parameters"], numbers["std"]
    unit = dict.fromkeys(("fx", "fy", "cx", "cy"), "px") | {"omega": "rad"}
    print(
        table(
            [numbers["model"], "value", "std", "unit"],
            [
                [n, f"{values[n]:.6f}", f"{std[n]:.6f}" if std[n] else "fixed", unit.get(n, "")]
                for n in values
            ],
        )
    )
    print()
    print(f"rms {numbers['rms_px']:.5f} px, mean {numbers['mean_px']:.5f} px", end=" ")
    print(f"over {len(result.residual)} corners of {numbers['used']} images;", end=" ")
    print(f"{numbers['iterations']} iterations ({numbers['reason']}), {numbers['seconds']:.1f} s")
    ignored = int((result.weights == 0.0).sum())
    if ignored:
        print(f"{ignored} corners are so far off that they weigh nothing")
    print_backend()

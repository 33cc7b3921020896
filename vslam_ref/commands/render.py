"""``vslam-ref render``: a film of the hall, and the truth of every picture."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from vslam_ref.commands.options import (
    add_json,
    at_least,
    file_target,
    json_target,
    print_backend,
    progress_bar,
    warm,
    write_json,
)

if TYPE_CHECKING:
    from vslam_ref.worlds.rendered import Effects, RenderedScene

HELP = "render a film of a lobby that a vehicle drives around, with the truth of every picture"
EPILOG = """\
hall is a textured lobby. A vehicle drives once around it, on a square of 20 m with rounded corners, in
79.6 s: 2387 pictures of 640 x 480 at 30 Hz. The camera (f = 525 px, no lens) is on the rear axle, 1.2 m up
and level.

--truth FILE.csv has a line a picture, after the line of names
  number,time,x,y,theta,tx,ty,tz,qx,qy,qz,qw
time in seconds; x, y (metres) and theta (radians, against the clock from the world's x axis) are the pose of
the vehicle; tx ty tz (metres) and qx qy qz qw are T_world_cam: X_world = R(q) X_cam + t. The world's z points
up, its origin is on the floor in the middle of the hall; the camera's frame is x right, y down, z ahead.

--light S: the exposure swings by a share S around 1, with a period of 7 s. --blur S: the shutter is open for
S seconds around the picture's time. --covered FROM,TO: something lies on the lens from FROM to before TO,
in seconds. Each changes nothing else. The same command gives the same pictures.

numbers (also in --json): pictures, seconds, landmarks of the hall, and how many of them a picture shows:
least and median over every tenth picture.

'vslam-ref run ptam hall' and 'hall-ahead' take the pictures without a film ('hall:7': with the seed 7).

examples:
  vslam-ref render hall --out hall.webm --truth hall.csv --frames 90
  vslam-ref render hall --camera ahead --out ahead.webm --passers-by 8 --noise 3 --blur 0.01 --light 0.3"""
CAMERAS = {"right": "hall", "ahead": "hall-ahead"}
NAMES = "number,time,x,y,theta,tx,ty,tz,qx,qy,qz,qw"
EVERY = 10
"""Pictures from one count of landmarks to the next."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument("scene", metavar="SCENE", choices=("hall",), help="hall")
    parser.add_argument("--out", metavar="FILE.webm", required=True, help="write the film there")
    parser.add_argument("--truth", metavar="FILE.csv", help="write the poses there")
    parser.add_argument("--camera", choices=tuple(CAMERAS), default="right", help="where the camera looks")
    parser.add_argument("--seed", type=at_least(0), default=1, metavar="N", help="of the hall (default: 1)")
    parser.add_argument("--frames", type=at_least(1), metavar="N", help="only the first pictures")
    parser.add_argument(
        "--noise", type=between(0, 100), default=0.0, metavar="S", help="standard deviation, grey levels"
    )
    parser.add_argument(
        "--blur", type=between(0, 1 / 30), default=0.0, metavar="S", help="seconds, up to 1/30"
    )
    parser.add_argument(
        "--light", type=between(0, 0.9), default=0.0, metavar="S", help="change of the exposure, 0 to 0.9"
    )
    parser.add_argument(
        "--passers-by", type=at_least(0), default=0, metavar="N", help="people who walk about, up to 99"
    )
    parser.add_argument(
        "--covered", type=interval, action="append", default=[], metavar="FROM,TO", help="may be repeated"
    )
    add_json(parser)


def between(low: float, high: float) -> Any:
    """Return a reader of numbers from ``low`` to ``high``."""

    def read(text: str) -> float:
        try:
            number = float(text)
        except ValueError:
            number = float("nan")
        if not low <= number <= high + 1e-12:
            raise argparse.ArgumentTypeError(f"{text!r}: expected a number from {low:g} to {high:.4g}")
        return number

    return read


def interval(text: str) -> tuple[float, float]:
    """Read two times, seconds, the first before the second.

    Examples
    --------
    >>> interval("2,3.5")
    (2.0, 3.5)
    """
    try:
        first, last = (float(part) for part in text.split(","))
    except ValueError:
        first = last = float("nan")
    if not 0 <= first < last < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r}: expected FROM,TO in seconds, FROM before TO")
    return first, last


def run(options: argparse.Namespace) -> int:
    """Draw all pictures, write film, truth and numbers."""
    target = json_target(options)
    out, truth = file_target(options.out, (".webm",)), file_target(options.truth, (".csv",))
    assert out is not None

    from vslam_ref.commands.tables import table
    from vslam_ref.datasets import video
    from vslam_ref.support import files
    from vslam_ref.worlds.rendered import RATE, Effects

    effects = Effects(options.noise, options.light, options.blur, covered=tuple(options.covered))
    world = made(options, effects)
    warm("rendered")
    with files.new_file(out) as film, video.webm(film, "full", fps=RATE) as add:
        shown = filmed(world, add)
    if truth is not None:
        files.write_text(truth, truth_text(world))
    content = numbers(world, shown) | {"scene": options.scene, "camera": options.camera, "seed": options.seed}
    print(table(["what", "value"], [[key, str(value)] for key, value in content.items()]))
    print_backend()
    print(f"film: {out}")
    write_json(target, content)
    return 0


def made(options: argparse.Namespace, effects: Effects) -> RenderedScene:
    """Return the scene that was asked for."""
    from vslam_ref.worlds.rendered import scene

    name = CAMERAS[options.camera]
    return scene(name, options.seed, frames=options.frames, effects=effects, passers_by=options.passers_by)


def filmed(world: RenderedScene, add: Any) -> list[int]:
    """Hand every picture to ``add``, one after the other; return how many landmarks each tenth one shows."""
    import numpy as np

    shown = []
    with progress_bar(len(world), "picture") as bar:
        for k in range(len(world)):
            add(np.repeat(world.frame(k)[..., None], 3, -1))
            if k % EVERY == 0:
                shown.append(int(world.landmark_track(k).visible.sum()))
            bar.update()
    return shown


def numbers(world: RenderedScene, shown: list[int]) -> dict[str, Any]:
    """What is printed of a film."""
    import numpy as np

    return {
        "frames": len(world),
        "seconds": float(world.times[-1]),
        "landmarks": len(world.landmarks),
        "landmarks_shown_least": min(shown),
        "landmarks_shown_median": float(np.median(shown)),
    }


def truth_text(world: RenderedScene) -> str:
    """The lines of ``--truth``; numbers with as many digits as tell them apart."""
    from vslam_ref.geometry import quaternion

    assert world.vehicle is not None
    path, poses = world.trajectory(), world.vehicle(world.times)
    quaternions = quaternion.of_rotation(path.R_world_body)[:, [1, 2, 3, 0]]  # wxyz inside
    lines = [NAMES]
    for k, time in enumerate(world.times.tolist()):
        row = [time, *poses[k].tolist(), *path.t_world_body[k].tolist(), *quaternions[k].tolist()]
        lines.append(",".join([str(k), *(repr(value) for value in row)]))
    return "\n".join(lines) + "\n"

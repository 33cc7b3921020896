"""What all systems that track one moving camera over pictures have in common: arguments and run."""

from __future__ import annotations

import argparse
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vslam_ref.commands.options import (
    add_json,
    add_set,
    at_least,
    folder_target,
    json_target,
    print_backend,
    print_notes,
    progress_bar,
    warm,
    write_json,
)

if TYPE_CHECKING:
    from vslam_ref.datasets.sequences import Sequence
    from vslam_ref.experiments.visual_slam.interrupting import Interrupts
    from vslam_ref.experiments.visual_slam.kinds import SystemKind
    from vslam_ref.experiments.visual_slam.running import Run
    from vslam_ref.systems.visual_map.chosen_start import ChosenStart

SOURCE = """\
SOURCE is a folder of pictures (plain, KITTI odometry, TUM RGB-D, EuRoC or 7-Scenes layout), a video file, the
name of a data set that VSLAM_REF_DATA finds, or a rendered scene (desk, corridor, rotation, building, hall,
hall-ahead). Where no camera lies beside the pictures, give --camera, a file whose kind is seen from its
content: OpenCV (YAML, XML, JSON), ROS camera_info, ORB-SLAM's settings, Kalibr, EuRoC, KITTI, PTAM, TUM
monoVO, or one line 'fx fy cx cy width height'."""
NUMBERS = """\
numbers (also in --json): pictures, those with a pose, lost, relocalised; keyframes, points; ATE of the final
and the live path after alignment by a similarity (null without truth); scale_drift, the scale that brings the
last third of the path to the truth over that of the first (below 1: the map grew); pictures a second without
reading and drawing."""
REST = """\
--refine-camera: what the motion does not determine keeps its value, and is named with its standard deviation
(sigma). camera_shift_px: how far from its place the refined camera shows what the given one sees in a pixel,
largest and RMS over the picture. Run again with '--camera DIR/camera.yaml' to use the camera from the start.

Ctrl-C saves the run so far and ends with status 130; twice in one stage, it saves nothing. While the film is
drawn, the first one ends the film.
A scene that allows no start ends with status 0 and the reason."""
VIDEO = "film: 320 pixels wide (small, the default), half or full size of the pictures, or none"
START = "start from pictures I and J, by their numbers in the source (default: the system finds two)"
REFINE = "free the camera in the last adjustment, as far as the motion determines it; writes camera.yaml"
INTERRUPTED = 128 + signal.SIGINT


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of a system over pictures."""
    parser.add_argument("source", metavar="SOURCE", help="pictures; see below")
    parser.add_argument("--out", metavar="DIR", required=True, help="write paths, map, film and page there")
    parser.add_argument("--camera", metavar="FILE", help="camera, instead of that beside the pictures")
    parser.add_argument(
        "--from", dest="first", type=at_least(0), default=0, metavar="I", help="first picture (default: 0)"
    )
    parser.add_argument("--to", dest="end", type=at_least(1), metavar="J", help="end before picture J")
    parser.add_argument(
        "--every", type=at_least(1), default=1, metavar="K", help="only every K-th picture (default: 1)"
    )
    parser.add_argument("--start", type=two_pictures, metavar="I,J", help=START)
    parser.add_argument("--truth", metavar="FILE", help="true path (TUM, KITTI or EuRoC format)")
    parser.add_argument("--refine-camera", action="store_true", help=REFINE)
    clock = parser.add_mutually_exclusive_group()
    clock.add_argument("--times", metavar="FILE", help="one time a line, seconds")
    clock.add_argument("--rate", type=float, metavar="HZ", help="pictures a second, where no times are known")
    parser.add_argument("--video", choices=("small", "half", "full", "none"), default="small", help=VIDEO)
    add_set(parser)
    add_json(parser)


def run(options: argparse.Namespace, kind: SystemKind, settings: Any, **given: Any) -> int:
    """Run a system over the pictures, print and write what there is to tell.

    What else is given goes to :func:`vslam_ref.experiments.visual_slam.running.run`.
    """
    import time

    target, out = json_target(options), folder_target(options.out)
    keep_inputs(options)

    from vslam_ref.commands.tables import table
    from vslam_ref.experiments.visual_slam import numbers, report
    from vslam_ref.experiments.visual_slam.interrupting import interrupts
    from vslam_ref.support import files

    assert out is not None  # --out is required
    sequence = open_source(options)
    chosen = chosen_start(options.start, sequence)
    warm(*kind.kernels)
    with files.new_folder(out) as folder, interrupts() as interrupted:
        began = time.perf_counter()
        done = follow(sequence, settings, interrupted, chosen=chosen, **given)
        draw(folder / report.FILM, done, options.video, interrupted)
        content = numbers.document(done, time.perf_counter() - began)
        report.write_report(folder, done, content)
        done.interrupted |= interrupted.asked
    print(table(["what", "value", "unit"], numbers.number_rows(content)))
    print_notes(content["notes"])
    print_backend()
    print(f"page: {out / 'report.html'}")
    write_json(target, content)
    return INTERRUPTED if done.interrupted else 0


def keep_inputs(options: argparse.Namespace) -> None:
    """Refuse to replace a folder that holds what the run reads."""
    from vslam_ref.support.errors import InputError

    out = Path(options.out).resolve()
    given = {"SOURCE": options.source, "--camera": options.camera, "--truth": options.truth,
             "--times": options.times, "--vocabulary": vars(options).get("vocabulary")}  # fmt: skip
    for name, path in given.items():
        if path is not None and Path(path).exists() and Path(path).resolve().is_relative_to(out):
            raise InputError(f"{name} {path} lies in --out {options.out}, which is replaced: give another")


def open_source(options: argparse.Namespace) -> Sequence:
    """Open the pictures that were asked for."""
    from vslam_ref.datasets.sequences import open_sequence

    sequence = open_sequence(
        options.source,
        camera=options.camera,
        times=options.times,
        rate=options.rate,
        truth=options.truth,
    )
    return sequence.part(options.first, options.end, options.every)


def two_pictures(text: str) -> tuple[int, int]:
    """Read the numbers of two pictures.

    Examples
    --------
    >>> two_pictures("4,12")
    (4, 12)
    """
    first, comma, last = text.partition(",")
    if not (comma and first.strip().isdecimal() and last.strip().isdecimal() and int(first) < int(last)):
        what = "expected two numbers of pictures, the first one smaller, as 4,12"
        raise argparse.ArgumentTypeError(f"{text!r}: {what}")
    return int(first), int(last)


def chosen_start(pictures: tuple[int, int] | None, sequence: Sequence) -> ChosenStart | None:
    """The start that was chosen; refused if the run does not come by both pictures."""
    from vslam_ref.support.errors import InputError
    from vslam_ref.systems.visual_map.chosen_start import ChosenStart

    if pictures is None:
        return None
    numbers = sequence.numbers
    for number in pictures:
        if number not in numbers:
            step = numbers[1] - numbers[0] if len(numbers) > 1 else 1
            steps = f" in steps of {step}" if step > 1 else ""
            has = f"it has {numbers[0]} to {numbers[-1]}{steps}"
            words = ",".join(map(str, pictures))
            raise InputError(f"--start {words}: picture {number} is not in this run; {has}")
    return ChosenStart(*pictures)


def follow(sequence: Sequence, settings: Any, interrupted: Interrupts, **given: Any) -> Run:
    """Run with a progress bar; Ctrl-C ends it after the picture."""
    from vslam_ref.experiments.visual_slam import running

    with progress_bar(len(sequence), "picture", "tracking") as bar:
        done = running.run(sequence, settings, lambda _: interrupted.asked, bar.update, **given)
    done.interrupted |= interrupted.asked  # perhaps at the last picture
    interrupted.asked = False  # the next ends the film
    interrupted.ends = "ending the film, saving the run (again: stop at once, save nothing)"
    return done


def draw(target: Path, done: Run, size: str, interrupted: Interrupts) -> None:
    """Make the film, if one is wanted; Ctrl-C ends it early."""
    from vslam_ref.experiments.visual_slam import overlay

    if size == "none":
        return
    with progress_bar(len(done.frames), "picture", "film") as bar:
        done.filmed = overlay.film(target, done, size, lambda: interrupted.asked, bar.update)
    done.interrupted |= interrupted.asked

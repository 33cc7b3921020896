"""``vslam-ref run ptam``: monocular tracking and mapping over pictures."""

from __future__ import annotations

import argparse

from vslam_ref.commands import run_visual

SYSTEMS = {"ptam": "PTAM: a path and a map of points from the pictures of one moving camera"}
SETS = """\
--concurrent: the mapper works in a thread of its own, and the tracker waits for it only where a keyframe was
handed over mapper.lag pictures ago. Paths differ a little from run to run; without it, the same pictures give
the same bytes.

'--set tracker.fine_points=500' changes a setting. '--set preset=NAME' changes several; others given beside it
win:
  ptam2007        the constants and rules of PTAM as it was published
  no_warp         a patch is compared as it was first seen, on the level that fits its size
  least_squares   the tracker and every adjustment minimise squares instead of Tukey's loss
  absolute_score  a patch must be alike by an absolute limit, not by a share of its own contrast
  no_search_back  a match on the epipolar curve is not searched back into its source
  corners_only    patches are looked for at corners only, not first where they are expected
  no_following    a lost camera is found again by keyframes only, not by following the last patches"""
START = """\
--start I,J: corners are followed from picture I to J, and one start is tried there: it holds, or the run ends
without a map and says why. Pictures between both are tracked afterwards; those before I are not."""
EPILOG = "\n\n".join([run_visual.SOURCE, run_visual.NUMBERS, START, SETS, run_visual.REST])
EXAMPLES = """\
examples, after 'vslam-ref sample video --out samples':
  vslam-ref run ptam samples/video --out out/desk
  vslam-ref run ptam samples/video/film.avi --camera samples/video/calib.txt --video full --out out/film
with a rendered scene, which has its own camera and truth:
  vslam-ref run ptam desk --to 60 --out out/desk
with your own pictures:
  vslam-ref run ptam walk.mp4 --camera camera.yaml --out out/walk
  vslam-ref run ptam pictures/ --camera camera.yaml --rate 10 --truth groundtruth.txt --out out/pictures
  vslam-ref run ptam walk.mp4 --camera camera.yaml --start 30,45 --out out/walk
and with known data sets:
  vslam-ref run ptam new_tsukuba_150 --out out/tsukuba --json tsukuba.json
  vslam-ref run ptam kitti07_head --refine-camera --out out/kitti
  vslam-ref run ptam kitti07_head --camera out/kitti/camera.yaml --out out/kitti2
  vslam-ref run ptam 7scenes_redkitchen --from 100 --to 250 --every 2 --video half --out out/kitchen"""
CONCURRENT = "mapping in a thread of its own, beside tracking: quicker, but not the same bytes each time"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this system."""
    run_visual.add_arguments(parser)
    parser.add_argument("--concurrent", action="store_true", help=CONCURRENT)


def run(options: argparse.Namespace) -> int:
    """Run PTAM over the pictures."""
    from vslam_ref.experiments.visual_slam.kinds import PTAM
    from vslam_ref.systems.ptam.presets import settings_from

    settings = settings_from([*options.set, *(["camera.refine=true"] * options.refine_camera)])
    return run_visual.run(options, PTAM, settings, concurrent=options.concurrent)

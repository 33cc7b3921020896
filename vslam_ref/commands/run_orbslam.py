"""``vslam-ref run orbslam``: features that are recognised, a map that is thinned out."""

from __future__ import annotations

import argparse

from vslam_ref.commands import run_visual

SYSTEMS = {"orbslam": "ORB-SLAM: the same with features that are recognised, and a map that is thinned out"}
START = """\
loops, loops_rejected, essential_edges, culled_keyframes: loops that were closed; earlier keyframes that
looked alike in words and were refused (a note says why); edges of the graph that the last closing moved;
keyframes that added nothing to others.

--vocabulary: words by which a place is recognised, where loops may close and where a lost camera may be. A
vocabulary must be made of descriptors like these: the one that comes with the program is ('make vocabulary'
trains it); those of other programs know other comparisons of pixels and recognise less.

--start I,J: the features of picture I are matched with those of J, and one start is tried there: it holds, or
the run ends without a map and says why. Pictures between both are tracked afterwards; those before I are not.
Choose two that show the same things, with the camera moved sideways between them by a tenth of their distance
or so: if it only turned, or hardly moved, many motions explain the pictures.

'--set features.features=2000' changes a setting. Parts are left out so: features.spread=false (features
where corners are strongest), mapper.fuse=false (points made twice stay two), mapper.local_steps=0 (no
adjustment after a keyframe), mapper.redundant=1 (no keyframe is culled), loops.close=false (no loop is
closed). A loop may turn the path by loops.turn=30 degrees at most: what asks for more is a place that looks
alike. Two places that look alike in every point, and in the same direction, are taken for one."""
EPILOG = "\n\n".join([run_visual.SOURCE, run_visual.NUMBERS, START, run_visual.REST])
VOCABULARY = "words of places: .npz of this program, DBoW2, DBoW3 or ORB-SLAM file (default: its own)"
EXAMPLES = """\
examples, after 'vslam-ref sample video --out samples':
  vslam-ref run orbslam samples/video --out out/orb
with a rendered scene, which has its own camera and truth:
  vslam-ref run orbslam corridor --to 150 --out out/orb-corridor
with your own pictures:
  vslam-ref run orbslam walk.mp4 --camera camera.yaml --out out/orb-walk
and with known data sets:
  vslam-ref run orbslam new_tsukuba_150 --out out/orb-tsukuba --json tsukuba.json
  vslam-ref run orbslam kitti07_head --refine-camera --out out/orb-kitti"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this system."""
    run_visual.add_arguments(parser)
    parser.add_argument("--vocabulary", metavar="FILE", help=VOCABULARY)


def run(options: argparse.Namespace) -> int:
    """Run ORB-SLAM over the pictures."""
    from vslam_ref.datasets.vocabulary_files import read_vocabulary
    from vslam_ref.experiments.visual_slam.kinds import ORBSLAM
    from vslam_ref.support.config import apply_overrides
    from vslam_ref.systems.orbslam import Settings

    words = [*options.set, *(["camera.refine=true"] * options.refine_camera)]
    settings = apply_overrides(Settings(), words)
    given = None if options.vocabulary is None else read_vocabulary(options.vocabulary).vocabulary
    return run_visual.run(options, ORBSLAM, settings, vocabulary=given)

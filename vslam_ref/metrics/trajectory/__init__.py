"""How far an estimated trajectory is from the true one.

============================  =====================================================================
module                        holds
============================  =====================================================================
``poses``                     a trajectory: times, positions, rotations of a body in the world
``association``               which estimated pose belongs to which true one
``ate``                       absolute trajectory error: distances after one alignment of the whole
``rpe``                       relative pose error: what each step of the way adds
``evaluation``                all of it for one pair of trajectories
``partners``                  which poses found no partner, and the likely reason
``clocks``                    the unit of time and the offset with which two trajectories would meet
``hints``                     both in words
``order``                     whether quaternions were read with w in the wrong place
============================  =====================================================================

The two errors answer different questions.  One wrong turn in the middle bends everything behind it: the
absolute error is large everywhere, the relative one large once.  A slow drift is the reverse.  A camera alone
does not know the scale, so its path is aligned by a similarity, and the scale that was needed is part of the
result.
"""

from vslam_ref.metrics.trajectory.association import MAX_DIFFERENCE, Pairs, associate
from vslam_ref.metrics.trajectory.ate import MODES, AbsoluteError, absolute_error, pose_logarithms
from vslam_ref.metrics.trajectory.evaluation import Evaluation, evaluate, pair_up
from vslam_ref.metrics.trajectory.hints import no_pairs, pairing_notes
from vslam_ref.metrics.trajectory.order import Order, judge_order
from vslam_ref.metrics.trajectory.poses import Summary, Trajectory, summary
from vslam_ref.metrics.trajectory.rpe import RelativeError, relative_error, rotation_angle

__all__ = [
    "MAX_DIFFERENCE",
    "MODES",
    "AbsoluteError",
    "Evaluation",
    "Order",
    "Pairs",
    "RelativeError",
    "Summary",
    "Trajectory",
    "absolute_error",
    "associate",
    "evaluate",
    "judge_order",
    "no_pairs",
    "pair_up",
    "pairing_notes",
    "pose_logarithms",
    "relative_error",
    "rotation_angle",
    "summary",
]

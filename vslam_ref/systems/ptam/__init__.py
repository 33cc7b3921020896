"""PTAM: a camera is tracked while a map is made of what it sees.

==================  ==============================================================================
module              holds
==================  ==============================================================================
``ptam``            :class:`Ptam`: a picture in, a pose out, in a fixed order
``settings``        every number and its reason
``presets``         named sets of them: PTAM as it was published, and one part taken out
``look``            pyramid and corners of a picture
``trails``          before there is a map: corners followed from picture to picture
``start``           two pictures to a first map, or why not yet
``chosen``          trails from one picture that the user chose to the other
``tracker``         the pose of every picture
``policy``          which pictures become keyframes
``mapper``          what happens to these
``concurrent``      the same with the mapper in a thread of its own
==================  ==============================================================================

A system takes pictures; it opens no files and draws nothing.
"""

from vslam_ref.systems.ptam.concurrent import ConcurrentPtam
from vslam_ref.systems.ptam.ptam import STAGES, PictureOutcome, Pose, Ptam
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.tracker.quality import Quality
from vslam_ref.systems.ptam.tracker.tracker import Tracked
from vslam_ref.systems.visual_map.chosen_start import ChosenStart

KERNELS = (
    "bundle", "bundle_schur", "curves", "features", "looking", "patches", "points", "pose", "visibility",
)  # fmt: skip
"""Modules of compiled loops that a run needs, for those who prepare them before they look at a clock."""

__all__ = [
    "KERNELS",
    "STAGES",
    "ChosenStart",
    "ConcurrentPtam",
    "PictureOutcome",
    "Pose",
    "Ptam",
    "Quality",
    "Settings",
    "Tracked",
]

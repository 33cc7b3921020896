"""Loop closing: a place is recognised, the map is bent until both visits agree.

================  ===================================================================================
module            holds
================  ===================================================================================
``words``         candidates by the words of a vocabulary
``consistency``   a place is believed when three keyframes in a row propose it
``verify``        matches, a similarity, more matches by it, the whole place found again
``correction``    the Sim(3) pose graph over the essential graph; points moved with their keyframes
``join``          a loop closed in the map: points fused, the error spread
``closer``        all of it, after each keyframe
``book``          the correction edge by edge in full matrices, to be read and to be compared with
================  ===================================================================================
"""

from vslam_ref.systems.orbslam.loop_settings import LoopSettings
from vslam_ref.systems.orbslam.loops.closer import Candidates, LoopCloser
from vslam_ref.systems.orbslam.loops.verify import LoopVerdict
from vslam_ref.systems.orbslam.loops.words import CandidatesByWords

__all__ = ["Candidates", "CandidatesByWords", "LoopCloser", "LoopSettings", "LoopVerdict"]

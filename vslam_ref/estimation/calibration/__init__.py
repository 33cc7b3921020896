"""Camera calibration from images of a flat board, for every camera model: what PTAM's calibrator does.

==================  ==========================================================================
module              holds
==================  ==========================================================================
``book``            the algorithm of the chapter, to be read
``board``           the board, its corners in each view
``homography``      board plane to image, by the normalised direct linear transform
``zhang``           sensor from homographies, pose from a homography
``parameters``      which intrinsics are free
``start``           where to begin, for lenses with and without much distortion
``problem``         the residual and its Jacobians
``arrow``           the normal equations, poses eliminated
``solver``          Levenberg-Marquardt over poses and intrinsics
``robustly``        the same with a robust loss, for corners some of which are wrong
``result``          what comes back; covariance; what the corners do not determine
``ptam``            the step of PTAM's calibrator, as it was
==================  ==========================================================================
"""

from vslam_ref.estimation.calibration import book, ptam
from vslam_ref.estimation.calibration.arrow import reduce
from vslam_ref.estimation.calibration.board import Board, BoardCorners, BoardView, stack
from vslam_ref.estimation.calibration.homography import apply_homography, homography
from vslam_ref.estimation.calibration.parameters import Free
from vslam_ref.estimation.calibration.problem import CalibrationProblem, CalibrationState
from vslam_ref.estimation.calibration.result import Calibration, tilt
from vslam_ref.estimation.calibration.robustly import RobustCalibration, calibrate_robustly
from vslam_ref.estimation.calibration.solver import calibrate
from vslam_ref.estimation.calibration.start import Start, find_start, poses_for
from vslam_ref.estimation.calibration.weakness import doubts, picture_uncertainty
from vslam_ref.estimation.calibration.zhang import Sensor, pose_from_homography, sensor_from_homographies

__all__ = [
    "Board",
    "Calibration",
    "BoardCorners",
    "Free",
    "CalibrationProblem",
    "RobustCalibration",
    "Sensor",
    "Start",
    "CalibrationState",
    "BoardView",
    "apply_homography",
    "book",
    "calibrate",
    "calibrate_robustly",
    "doubts",
    "find_start",
    "homography",
    "picture_uncertainty",
    "pose_from_homography",
    "poses_for",
    "ptam",
    "reduce",
    "sensor_from_homographies",
    "stack",
    "tilt",
]

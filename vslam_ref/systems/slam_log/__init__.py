"""EKF-SLAM, IEKF-SLAM and the anchored EKF on recorded logs.

============================  =====================================================================
module                        holds
============================  =====================================================================
``log``                       a log in the house's convention; its truth, apart
``calibration``               gains, delays and noises of vehicle and sensor
``timeline``                  the log cut into the steps of a filter
``gaps``                      where a log is silent: told, and doubted
``runner``                    a filter over a log, with a gate that sees the innovation and S only
``simulated``                 what a robot would have logged in a world with exact truth
``evaluate``                  errors with and without alignment, NEES
============================  =====================================================================
"""

from vslam_ref.systems.slam_log.calibration import RobotCalibration
from vslam_ref.systems.slam_log.evaluate import KEYS, Placed, place, summary, truth_at
from vslam_ref.systems.slam_log.gaps import gap_notes
from vslam_ref.systems.slam_log.log import Drive, LoggedSighting, LogTruth, SlamLog
from vslam_ref.systems.slam_log.runner import FILTERS, LogRun, RunSettings, SeenLandmarks, run_log
from vslam_ref.systems.slam_log.timeline import Timeline, build_timeline

__all__ = [
    "FILTERS",
    "KEYS",
    "RobotCalibration",
    "Drive",
    "LogRun",
    "Placed",
    "RunSettings",
    "SeenLandmarks",
    "LoggedSighting",
    "SlamLog",
    "Timeline",
    "LogTruth",
    "build_timeline",
    "gap_notes",
    "place",
    "run_log",
    "summary",
    "truth_at",
]

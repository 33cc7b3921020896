"""Calibration files: what other programs know about a camera, in this package's conventions.

=====================  ==========================================  =========================================
module                 reads                                       converts
=====================  ==========================================  =========================================
``opencv_yaml``        OpenCV's FileStorage YAML (3 to 5)          nothing; it also writes
``kalibr``             Kalibr's camchain                           nothing
``euroc``              EuRoC's sensor.yaml                         T_BS (body from sensor) to ``T_cam_rig``
``ptam``               PTAM's camera.cfg                           relative numbers and the pixel origin
``tum_mono``           TUM monoVO's (DSO's) camera.txt             relative numbers and the pixel origin
=====================  ==========================================  =========================================

Every reader answers with :class:`CameraFile`; every error is one line with file, line, and what is right.
"""

from vslam_ref.datasets.calibration_files.euroc import read_euroc
from vslam_ref.datasets.calibration_files.kalibr import read_kalibr
from vslam_ref.datasets.calibration_files.opencv_yaml import read_opencv, write_opencv
from vslam_ref.datasets.calibration_files.ptam import read_ptam
from vslam_ref.datasets.calibration_files.record import CameraFile, pixels_from_relative
from vslam_ref.datasets.calibration_files.tum_mono import TumMonoFile, read_tum_mono

__all__ = [
    "CameraFile",
    "TumMonoFile",
    "pixels_from_relative",
    "read_euroc",
    "read_kalibr",
    "read_opencv",
    "read_ptam",
    "read_tum_mono",
    "write_opencv",
]

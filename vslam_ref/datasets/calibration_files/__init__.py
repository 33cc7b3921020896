"""Calibration files: what other programs know about a camera, in this package's conventions.

=====================  ==========================================  =========================================
module                 reads                                       converts
=====================  ==========================================  =========================================
``opencv_storage``     OpenCV's FileStorage: YAML, XML, JSON,      nothing; it also writes YAML
                       plain or packed
``camera_info``        messages of ROS 1 and 2                     region of interest and binning
``orbslam``            settings of ORB-SLAM 2 and 3, stella_vslam  the camera's pose in the body is inverted
``kalibr``             Kalibr's camchain                           T_imu_cam is inverted, chains are followed
``euroc``              EuRoC's sensor.yaml                         T_BS (body from sensor) to ``T_cam_rig``
``camodocal``          camodocal's (VINS'), where it is no mirror  its fisheye's k2 to k5 are our k1 to k4
``kitti_raw``          KITTI's calib_cam_to_cam.txt                the rectified camera, or that before
``ost``                ROS' ost.txt                                nothing
``ptam``               PTAM's camera.cfg                           relative numbers and the pixel origin
``tum_mono``           TUM monoVO's (DSO's) camera.txt             relative numbers and the pixel origin
=====================  ==========================================  =========================================

``lenses`` knows the names of lenses, and what to do where no camera here has such a one.
Every reader answers with :class:`CameraFile`; every error is one line with file, line, and what is right.
"""

from vslam_ref.datasets.calibration_files.camera_info import read_camera_info
from vslam_ref.datasets.calibration_files.camodocal import from_camodocal
from vslam_ref.datasets.calibration_files.euroc import read_euroc
from vslam_ref.datasets.calibration_files.kalibr import read_kalibr
from vslam_ref.datasets.calibration_files.kitti_raw import read_kitti_raw
from vslam_ref.datasets.calibration_files.opencv_storage import read_opencv, write_opencv
from vslam_ref.datasets.calibration_files.orbslam import read_orbslam
from vslam_ref.datasets.calibration_files.ost import read_ost
from vslam_ref.datasets.calibration_files.ptam import read_ptam
from vslam_ref.datasets.calibration_files.record import CameraFile, pixels_from_relative
from vslam_ref.datasets.calibration_files.tum_mono import TumMonoFile, read_tum_mono

__all__ = [
    "CameraFile",
    "TumMonoFile",
    "from_camodocal",
    "pixels_from_relative",
    "read_camera_info",
    "read_euroc",
    "read_kalibr",
    "read_kitti_raw",
    "read_opencv",
    "read_orbslam",
    "read_ost",
    "read_ptam",
    "read_tum_mono",
    "write_opencv",
]

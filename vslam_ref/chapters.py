"""The table of contents, once: numbers, titles, parts, rooms and pages of the book.

``vslam-ref list``, the README's table, the site and the tools in ``docs/_tools`` are made from it or checked
against it.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

PACKAGE = Path(__file__).resolve().parent


class Chapter(NamedTuple):
    """One chapter.

    Attributes
    ----------
    number : int
        Fixed for good.
    title, part : str
    room : str
        The module or package that it explains, relative to ``vslam_ref/``.
    page : str
        Name of its page in ``docs/chapters/`` without ``.md``; empty while it is planned.
    """

    number: int
    title: str
    part: str
    room: str
    page: str = ""

    @property
    def module(self) -> str:
        """Dotted name of the room."""
        return "vslam_ref." + self.room.replace("/", ".")

    @property
    def has_code(self) -> bool:
        """Whether the room exists."""
        path = PACKAGE / self.room
        return (path / "__init__.py").is_file() or path.with_suffix(".py").is_file()

    @property
    def state(self) -> str:
        """``here`` with page and code, ``code`` with code only, else ``planned``."""
        if not self.has_code:
            return "planned"
        return "here" if self.page else "code"


CHAPTERS = (
    Chapter(1, "Multi-view geometry", "Geometry", "geometry/multiview", "01_multiview"),
    Chapter(2, "Rigid motions", "Geometry", "geometry/se3", "02_rigid_motions"),
    Chapter(3, "Projection models", "Geometry", "geometry/cameras", "03_projection_models"),
    Chapter(4, "Robust loss", "Estimation", "estimation/robust", "04_robust_loss"),
    Chapter(5, "Levenberg-Marquardt", "Estimation", "estimation/least_squares", "05_least_squares"),
    Chapter(6, "Bundle adjustment", "Estimation", "estimation/bundle", "06_bundle_adjustment"),
    Chapter(7, "Camera calibration", "Estimation", "estimation/calibration", "07_calibration"),
    Chapter(8, "Image features", "From images to a map", "features", "08_features"),
    Chapter(9, "Two views", "From images to a map", "geometry/multiview/two_views", "09_two_views"),
    Chapter(10, "Tracking", "From images to a map", "systems/ptam/tracker", "10_tracking"),
    Chapter(11, "Mapping", "From images to a map", "systems/ptam/mapper", "11_mapping"),
    Chapter(12, "PTAM", "From images to a map", "systems/ptam", "12_ptam"),
    Chapter(13, "Pose graphs", "Closing loops", "estimation/posegraph", "13_pose_graphs"),
    Chapter(14, "ORB-SLAM", "Closing loops", "systems/orbslam", "14_orb_slam"),
    Chapter(15, "Ackermann EKF-SLAM", "Filters", "filters/ekf_slam", "15_ekf_slam"),
    Chapter(16, "IEKF-SLAM", "Filters", "filters/carleman_ekf", "16_carleman_ekf"),
    Chapter(17, "Consistency", "Filters", "metrics/consistency", "17_consistency"),
    Chapter(18, "AR registration", "Registration", "systems/registration"),
    Chapter(19, "Static and dynamic grids", "A world that moves", "grids", "19_grids"),
    Chapter(20, "Landmarks among moving things", "A world that moves", "grids/landmarks", "20_landmarks"),
    Chapter(21, "Filter SLAM: MonoSLAM and MSCKF", "Other families", "systems/monoslam"),
    Chapter(22, "Direct SLAM: LSD-SLAM and DTAM", "Other families", "systems/direct"),
    Chapter(23, "The methods compared", "Comparing and verifying", "experiments/methods"),
    Chapter(24, "Verify your implementation", "Comparing and verifying", "conformance", "24_verify"),
)

"""The table of the real data sets the project knows; none of them is part of the project."""

from __future__ import annotations

from typing import NamedTuple

LICENCE_CLASSES = {
    "A": "redistributable (public domain, BSD, MIT, Apache, CC BY)",
    "B": "CC BY-NC-SA 3.0: attribution, non-commercial, share alike",
    "C": "GPL-2 data",
    "D": "open research data without a licence text: cite it",
    "E": "non-commercial research only",
}


class DataSet(NamedTuple):
    """One data set.

    Parameters
    ----------
    name : str
        Its folder.
    what : str
        Content and use.
    licence : str
        Key of ``LICENCE_CLASSES``; where files differ, the strictest.
    source : str
        Where a user gets it.
    files : tuple of str
        Paths inside the folder that must exist for the set to count as found.
    """

    name: str
    what: str
    licence: str
    source: str
    files: tuple[str, ...]


DATA_SETS: tuple[DataSet, ...] = (
    DataSet(
        "7scenes_redkitchen",
        "650 handheld colour pictures with poses; monocular SLAM, relocalisation",
        "E",
        "github.com/andyzeng/tsdf-fusion-python, data/ (Microsoft Research 7-Scenes)",
        ("images", "groundtruth_tum.txt", "calib.txt"),
    ),
    DataSet(
        "bal",
        "bundle adjustment problems 16-22106 and dubrovnik 3-7; Schur Levenberg-Marquardt",
        "D",
        "grail.cs.washington.edu/projects/bal; github.com/borglab/gtsam, examples/Data",
        ("problem-16-22106-pre.txt.bz2", "dubrovnik-3-7-pre.txt"),
    ),
    DataSet(
        "bal_libmv",
        "bundle adjustment, 333 views of one shared camera",
        "A",
        "github.com/ceres-solver/ceres-solver, data/libmv-ba-problems",
        ("problem_01.bin",),
    ),
    DataSet(
        "camera_models",
        "camera files: FOV, radial-tangential, KITTI; parameters only",
        "B",
        "DSO documentation; github.com/MIT-SPARK/Kimera-VIO, tests/data",
        ("tum_mono_fov_camera.txt", "euroc_cam0_radtan.yaml"),
    ),
    DataSet(
        "carmen_2d",
        "corrected laser logs: intel, csail, aces, fr079, edmonton, fhw; static grids",
        "D",
        "github.com/acschaefer/ple, data/carmen (Radish repository)",
        ("intel-corrected.log.gz",),
    ),
    DataSet(
        "dbow2_demo",
        "four pictures for a bag of words; 1 and 3 match",
        "A",
        "github.com/dorian3d/DBoW2, demo/images",
        ("image0.png", "image3.png"),
    ),
    DataSet(
        "dbow2_vocab_small",
        "two ORB vocabularies, 4983 and 692 words",
        "A",
        "github.com/gaoxiang12/slambook2, ch11; github.com/MIT-SPARK/Kimera-VIO, tests/data",
        ("slambook2_vocabulary.yml.gz", "kimera_small_voc.yml.gz"),
    ),
    DataSet(
        "euroc_calib",
        "one stereo pair with calibration; distortion, rectification",
        "D",
        "github.com/MIT-SPARK/Kimera-VIO, tests/data/MicroEurocDataset",
        ("cam0.png", "cam0_sensor.yaml"),
    ),
    DataSet(
        "freiburg_course",
        "simulated odometry and sightings of 9 landmarks; EKF-SLAM, odometry calibration",
        "D",
        "github.com/salihmarangoz/RobotMappingCourse",
        ("world.dat", "sensor_data.dat"),
    ),
    DataSet(
        "kitti07_head",
        "first 80 grey pictures of KITTI 07 with poses; monocular odometry",
        "B",
        "cvlibs.net/datasets/kitti, odometry 07",
        ("image_0", "poses.txt", "calib.txt"),
    ),
    DataSet(
        "middlebury_temple",
        "16 views with exact cameras; resection, bundle adjustment",
        "D",
        "vision.middlebury.edu/mview, templeSparseRing",
        ("templeSR_par.txt", "templeSR0001.png"),
    ),
    DataSet(
        "msckf_utias",
        "gyro, velocity and stereo tracks with truth; MSCKF, sliding windows",
        "B",
        "github.com/utiasSTARS/msckf-swf-comparison, datasets/",
        ("dataset3.mat",),
    ),
    DataSet(
        "new_tsukuba_150",
        "150 rendered pictures with exact poses; tracking and mapping",
        "D",
        "New Tsukuba Stereo Dataset, CVLab Tsukuba; github.com/felixchenfy/Monocular-Visual-Odometry-Data",
        ("images", "groundtruth_tum.txt"),
    ),
    DataSet(
        "nist_nls",
        "15 regressions with certified digits; Levenberg-Marquardt",
        "A",
        "github.com/ceres-solver/ceres-solver, data/nist (NIST StRD)",
        ("Chwirut1.dat", "Lanczos1.dat"),
    ),
    DataSet(
        "opencv_reference",
        "recorded OpenCV 5.0.0 features and calibration on pictures of other sets",
        "B",
        "run opencv-contrib-python 5.0.0 on opencv_samples, kitti07_head, euroc_calib",
        ("box_features.npz", "chessboard_corners_calib.npz"),
    ),
    DataSet(
        "opencv_samples",
        "chessboards, planar objects, a stereo pair; calibration, homography",
        "A",
        "Debian package opencv-doc, or opencv's samples/data",
        ("chessboard/left01.jpg", "planar/box.png"),
    ),
    DataSet(
        "planar_mono_sapienza",
        "336 odometry steps, noise-free sightings of 999 landmarks; bearing-only SLAM",
        "D",
        "github.com/ibiscp/Planar-Monocular-SLAM, dataset/",
        ("trajectory.dat", "world.dat", "camera.dat"),
    ),
    DataSet(
        "plaza_range",
        "odometry and ranges to 4 beacons with surveyed truth; range-only SLAM",
        "D",
        "github.com/borglab/gtsam, examples/Data",
        ("Plaza1_.mat", "Plaza1_DR.txt"),
    ),
    DataSet(
        "pose_graphs",
        "pose graphs from tinyGrid3D to sphere2500 and manhattan",
        "B",
        "github.com/david-m-rosen/SE-Sync, data/; github.com/borglab/gtsam, examples/Data",
        ("sphere2500.g2o", "intel.g2o"),
    ),
    DataSet(
        "rtabmap_loop_samples",
        "84 corridor pictures with loop truth; place recognition",
        "A",
        "github.com/introlab/rtabmap, data/samples",
        ("samples", "samples_GT.bmp"),
    ),
    DataSet(
        "slambook2",
        "loop pictures, RGB-D frames, a trajectory pair, a sphere",
        "A",
        "github.com/gaoxiang12/slambook2",
        ("trajectory_pair/estimated.txt", "sphere.g2o"),
    ),
    DataSet(
        "strecha_mvs",
        "fountain-P11 and castle-P30 with laser-scan truth; wide baselines",
        "D",
        "github.com/openMVG/SfM_quality_evaluation, reduced 4 times",
        ("fountain-P11/groundtruth_tum.txt", "castle-P30/groundtruth_tum.txt"),
    ),
    DataSet(
        "trajectories",
        "estimated and true trajectories with published errors; alignment, ATE, RPE",
        "B",
        "github.com/MichaelGrupp/evo, test/data",
        ("fr2_desk_ORB.txt", "fr2_desk_groundtruth.txt"),
    ),
    DataSet(
        "tum_fr3_office_1hz",
        "17 pictures one second apart with motion-capture poses",
        "A",
        "cvg.cit.tum.de, RGB-D benchmark, fr3/long_office_household",
        ("rgb", "groundtruth.txt", "calib.txt"),
    ),
    DataSet(
        "utias_mrclam",
        "MRCLAM set 6, robots 1 and 3: range and bearing with true poses and map",
        "D",
        "asrl.utias.utoronto.ca/datasets/mrclam, data set 6",
        ("MRCLAM_Dataset6",),
    ),
    DataSet(
        "victoria_park",
        "Ackermann vehicle among trees, odometry and GPS; EKF and IEKF-SLAM",
        "D",
        "github.com/tzuyichiu/EKF-SLAM-2D (.mat files); github.com/borglab/gtsam, examples/Data (.txt)",
        ("aa3_dr.mat", "aa3_gpsx.mat", "victoria_park.txt"),
    ),
    DataSet(
        "visp_apriltag",
        "one picture of tags with their poses; planar pose",
        "C",
        "Debian package visp-images-data, AprilTag/",
        ("AprilTag.png", "ground_truth_pose.txt"),
    ),
    DataSet(
        "visp_castle_simu",
        "40 rendered pictures with depth, CAD model and exact poses; registration",
        "C",
        "Debian package visp-images-data, ViSP-images/mbt-depth/Castle-simu",
        ("image", "model", "pose"),
    ),
)

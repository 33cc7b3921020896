"""COLMAP's models, a folder with three files, binary or text: read and written.

::

    cameras     CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]
    images      IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME      world to camera, z ahead, y down
                X Y POINT3D_ID, for all features; none without a point
    points3D    POINT3D_ID X Y Z R G B ERROR TRACK[] as (IMAGE_ID, POINT2D_IDX)
    rigs, frames    where they are there: the poses that COLMAP takes; read, and not written

*Pixels.*  COLMAP's origin is the outer corner of the top-left pixel, whose centre is (0.5, 0.5); ours is that
centre.  Both measurements and principal points are half a pixel less here than in the file.

*Models.*  ``SIMPLE_PINHOLE``, ``PINHOLE``, ``SIMPLE_RADIAL``, ``RADIAL``, ``OPENCV`` and ``FULL_OPENCV`` are
one family; files that mix them get the smallest of ``Pinhole``, ``Radtan`` and ``Rational`` that can say
all of them.  ``OPENCV_FISHEYE`` and its simpler kin are ``Fisheye``, ``FOV`` is ``Fov``; the formulas are the
same, coefficient by coefficient.  With cameras of several families, each has a block of the intrinsics
(:mod:`vslam_ref.estimation.bundle.families`).

Told in ``notes``: features without a point (left out), a second sight of a point in an image (left out),
cameras that no image has (left out, of whatever model), a few tracks that differ from the images, rigs and
frames, poses of images that frames correct.

====================  ===========================================
module                holds
====================  ===========================================
``parts``             what the files say
``text``, ``binary``  the two forms, read
``tracks``            what the points say once more, compared
``rigs``              rigs and frames
``models``            COLMAP's camera models and ours
``lenses``            the cameras as sets of intrinsics
``reading``           the parts made a problem
``rows``              what is written of each camera, image, point
``text_writing``      the rows printed
``binary_writing``    the rows packed
``writing``           a problem made rows
====================  ===========================================
"""

from vslam_ref.datasets.bundle_files.colmap.binary import FILES as BINARY_FILES
from vslam_ref.datasets.bundle_files.colmap.reading import read_colmap
from vslam_ref.datasets.bundle_files.colmap.text import FILES as TEXT_FILES
from vslam_ref.datasets.bundle_files.colmap.writing import require_colmap, require_free, write_colmap

__all__ = ["BINARY_FILES", "TEXT_FILES", "read_colmap", "require_colmap", "require_free", "write_colmap"]

"""COLMAP's text model, a folder with three files: read and written.

::

    cameras.txt    CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]
    images.txt     IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME      world to camera, z ahead, y down
                   X Y POINT3D_ID, for all features; -1 without a point         (may be empty)
    points3D.txt   POINT3D_ID X Y Z R G B ERROR TRACK[] as (IMAGE_ID, POINT2D_IDX)

*Pixels.*  COLMAP's origin is the outer corner of the top-left pixel, whose centre is (0.5, 0.5); ours is that
centre.  Both measurements and principal points are half a pixel less here than in the file.

*Models.*  ``SIMPLE_PINHOLE``, ``PINHOLE``, ``SIMPLE_RADIAL``, ``RADIAL``, ``OPENCV`` and ``FULL_OPENCV`` are
one family; files that mix them get the smallest of ``Pinhole``, ``Radtan`` and ``Rational`` that can say
all of them.  ``SIMPLE_RADIAL_FISHEYE``, ``RADIAL_FISHEYE`` and ``OPENCV_FISHEYE`` are ``Fisheye``, ``FOV``
is ``Fov``; the formulas are the same, coefficient by coefficient.  No problem has cameras of two families.

Features without a point are left out and counted in ``notes``.
"""

from vslam_ref.datasets.bundle_files.colmap.reading import FILES, read_colmap
from vslam_ref.datasets.bundle_files.colmap.writing import write_colmap

__all__ = ["FILES", "read_colmap", "write_colmap"]

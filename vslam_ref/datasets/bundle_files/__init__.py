"""Bundle adjustment problems of other programs, in this package's conventions.

============  ==============================================  =======  =================================
module        format                                          in, out  converts
============  ==============================================  =======  =================================
``bal``       BAL text, plain, ``.gz``, ``.bz2``              in, out  cameras that look along -z
``bundler``   Bundler's ``bundle.out`` v0.3                   in       cameras that look along -z
``libmv``     libmv's binary dump                             in       numbers of images and tracks
``colmap``    COLMAP's model, binary or text, a folder        in, out  the pixels' origin
``ply``       PLY: points and cameras, to look at             out      nothing
============  ==============================================  =======  =================================

``by_content`` chooses by the file's first bytes.  Every reader answers with :class:`BundleFile`; every error
is one line with file, line (of a binary file: what and where), and what is right.  Counts are compared with
the file's size before memory is taken for them, and archives are unpacked up to a limit only.  Points seen
once, cameras without points and points behind cameras are no errors here: the adjustment names them.
"""

from vslam_ref.datasets.bundle_files.bal import read_bal, write_bal
from vslam_ref.datasets.bundle_files.bundler import read_bundler
from vslam_ref.datasets.bundle_files.by_content import (
    detect,
    read_bundle,
    require_sayable,
    require_target,
    write_bundle,
)
from vslam_ref.datasets.bundle_files.colmap import read_colmap, write_colmap
from vslam_ref.datasets.bundle_files.libmv import read_libmv
from vslam_ref.datasets.bundle_files.ply import write_ply
from vslam_ref.datasets.bundle_files.record import BundleFile

__all__ = [
    "BundleFile",
    "detect",
    "read_bal",
    "read_bundle",
    "read_bundler",
    "read_colmap",
    "read_libmv",
    "require_sayable",
    "require_target",
    "write_bal",
    "write_bundle",
    "write_colmap",
    "write_ply",
]

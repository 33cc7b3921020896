"""Rendered scenes: what a camera sees of flat textured things, with exact poses, depths and tracks.

::

    scenes      desk, corridor, rotation, building, hall, hall-ahead: things and a path, from a seed
      quads       rectangles and boxes               motion      smooth paths, a hand's tremor
      painting    grey values of their surfaces      record      pictures, depth, tracks, effects
      printing    corners at known places            people      passers-by
    raster      from quads to pixels                 textures    mip levels, footprints

    RenderedScene.frame(k):   T_cam_world -> placed (a homography for each quad, a box in the image)
                                  -> nearest (H, W) -> shade (H, W) -> borders again, finer
                                  -> mean over the shutter, exposure, noise -> uint8 (H, W)

Everything is exact but the grey values: poses are those of a function of time, depths those of planes, and a
point's pixel is the camera's own projection.  Grey values are means over each pixel's footprint, so corners
stay where their points are projected, which a test measures.  Lengths are real metres; z points up, and a
camera's frame is x right, y down, z ahead.  With NumPy a picture of 640 x 480 takes a quarter of a
second, with Numba about a seventh of it or less: what is the same arithmetic for all pixels runs in vectors.
"""

from vslam_ref.worlds.rendered.record import Effects, LandmarkTrack, PointTracks, RenderedScene
from vslam_ref.worlds.rendered.scenes import NAMES, RATE, pinhole, scene, wide

__all__ = [
    "NAMES",
    "RATE",
    "Effects",
    "LandmarkTrack",
    "PointTracks",
    "RenderedScene",
    "pinhole",
    "scene",
    "wide",
]

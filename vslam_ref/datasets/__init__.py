"""Floor 5: foreign formats and image sources.  One convention inside, conversion at this door.

==========================================  ============================================================
module                                      holds
==========================================  ============================================================
``known``, ``catalogue``                    the table of data sets, and where they are on disk
``text``, ``numbers``, ``matfile``          numbers in files, and where a file is wrong
``mrclam``, ``victoria_park``, ``carmen``   logs of robots; ``noise``: what was identified from them
``bundle_files``                            bundle adjustment problems
``calibration_files``                       cameras
``trajectories``                            poses over time
``nist``                                    certified regressions
``nist_models``                             their fifteen model functions, with Jacobians
``pictures``, ``checkerboard``              grey values, and the corners in them
``sequences``                               pictures in their order, with times, camera and truth
``middlebury``, ``matching``                pictures with exact cameras; the same points in several
``yaml_nodes``, ``storage_nodes``           YAML, and OpenCV's storage, as trees that know their lines
``grid_files``, ``map_cells``, ``video``    occupancy maps, what their pixels mean, and films
==========================================  ============================================================
"""

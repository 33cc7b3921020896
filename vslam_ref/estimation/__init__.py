"""Floor 2: estimation by least squares, from one robust loss to a whole map.

============================  =====================================================================
room                          holds
============================  =====================================================================
``robust``                    losses that wrong matches cannot bend, and the scale they need
``least_squares``             Levenberg-Marquardt: the loop of every solver, and small dense problems
``bundle``                    poses, points and intrinsics from everything that was seen
``calibration``               a camera from images of a flat board
``resection``                 one pose from points, with any lens and any loss
``triangulation``             points from poses, with any lens
============================  =====================================================================
"""

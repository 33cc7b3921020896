"""Floor 5: pictures.  The only room that imports matplotlib.

============================  =====================================================================
module                        holds
============================  =====================================================================
``style``                     colours, line styles and names of filters; figures without global state
``consistency``               mean NEES and mean error over Monte Carlo runs (B's figures 2-4)
``floor_plan``                floors with people, beams, maps and landmarks
``plane``                     vehicles, landmarks and covariance ellipses
``trajectory``                estimated and true path from above, error over time
``slam_log``                  map, trajectory and 3 sigma bands of a recorded log
``visual_slam``               map and path from three sides, tracking over the pictures
``saving``                    figures as files, the same bytes every time
============================  =====================================================================

Functions return a :class:`matplotlib.figure.Figure` that belongs to no window and no global list.
"""

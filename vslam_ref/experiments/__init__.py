"""Floor 6: figures, tables and claims that are drawn again, one folder per family.

A family's folder has the name its ids begin with.  ``framework/`` holds what all share (the driver, claims,
results on disk); ``registry`` finds the experiments by reading the sources, so nothing has to be listed
anywhere.  ``slam_log`` and ``grid_log`` are what ``vslam-ref run`` and ``vslam-ref grid`` do with a log.
"""

"""Recorded logs: noises identified without truth, the batch bound, and the run that compares filters.

============================  =====================================================================
module                        holds
============================  =====================================================================
``preintegration``            odometry between two sightings as one relative pose
``batch``                     least squares over a whole log, the bound for every filter
``identify``                  gains, delays and noises of a data set, without its truth
``compare``                   the three filters and the batch solution of one log, beside the truth
``report``                    what ``vslam-ref run`` writes
============================  =====================================================================
"""

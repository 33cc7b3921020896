"""Floor 2: how good an estimate is.

============================  =====================================================================
package                       holds
============================  =====================================================================
``consistency``               is the covariance honest? NEES, NIS, chi-squared bands, bootstrap
                              over whole Monte Carlo runs
``alignment``                 rigid alignment in the plane
``trajectory``                how far a path is from the true one? association in time, alignment,
                              absolute and relative errors (ATE, RPE)
============================  =====================================================================
"""

"""Floor 2: vehicle models and the filters that estimate a pose and a map of landmarks.

============================  =====================================================================
module                        holds
============================  =====================================================================
``book``                      EKF-SLAM for one run in full matrices, to be read
``vehicle``                   motion models (B4 and its alternative), increments and their noise
``observation``               a landmark seen from the vehicle (B20, B21) and its inverse (B23-B25)
``range_bearing``             range and bearing converted without bias
``block_covariance``          the covariance in pose and map blocks, and its measurement update
``ekf_slam``                  EKF-SLAM, the anchored EKF and the ideal EKF
``estimates``                 what goes into every filter and comes out; which landmarks are known
``carleman_ekf``              the *improved* EKF of seed B: a second-order Carleman lift.  It is
                              neither the invariant nor the iterated EKF
``observability``             the nullity of the linearised system along a run
============================  =====================================================================
"""

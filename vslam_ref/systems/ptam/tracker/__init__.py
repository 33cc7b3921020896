"""A pose for every picture.

==================  ==============================================================================
module              holds
==================  ==============================================================================
``tracker``         one picture to one pose: guesses, two passes, recovery; what is remembered
``coarse_fine``     the two passes: few large points in a wide search, many in a narrow one
``quality``         good, poor or lost
``recover``         without a guess: patches followed, three points, keyframes that look alike
==================  ==============================================================================

The pose of a pass is that of :mod:`vslam_ref.estimation.pose_tracking`.
"""

"""What happens to a keyframe.

==================  ==============================================================================
module              holds
==================  ==============================================================================
``mapper``          the order of things: look again, new points, neighbours, adjustment, culling
``new_points``      corners that nothing explains yet, found in a neighbour and back, with depth
``curve_search``    corners near the curve along which a point may appear
``associate``       known points, looked for where a known pose puts them
``book``            the same in plain loops, as chapter 11 reads it
==================  ==============================================================================
"""

"""Loop closing: a place is recognised, the map is bent until both visits agree.

================  ===================================================================================
module            holds
================  ===================================================================================
``correction``    the Sim(3) pose graph over the essential graph; points moved with their keyframes
``book``          the same, edge by edge in full matrices, to be read and to be compared with
================  ===================================================================================
"""

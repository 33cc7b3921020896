"""What the studies of chapters 19 and 20 compute in the floor plan's world.

``readings`` hands a recording to the maps, ``separation``, ``localisation`` and ``choice`` measure one run
each; the experiments themselves are ``grids_separation``, ``grids_localisation`` and ``grids_landmarks``.
"""

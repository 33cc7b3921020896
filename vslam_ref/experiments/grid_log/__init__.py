"""S, D and a plain grid of a recorded laser log: what ``vslam-ref grid`` does.

``mapping`` runs over the log and counts, ``frames`` draws it as it goes, ``report`` writes the folder.
"""

"""Static and dynamic grids, and localisation in them, on a floor with people: the experiments ``grids-*``.

``beams`` reads a simulated recording as maps and filters want it; ``counting`` compares maps with the truth.
"""

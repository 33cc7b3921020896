"""Floor 5: foreign formats and image sources.  One convention inside, conversion at this door.

``known`` is the table of data sets, ``catalogue`` finds them on disk.  ``text`` and ``matfile`` read
numbers and say where a file is wrong; ``mrclam`` and ``victoria_park`` make logs of them; ``noise`` holds
what was identified from those logs.  ``bundle_files`` reads and writes bundle adjustment problems,
``calibration_files`` cameras, ``trajectories`` poses over time.  ``middlebury`` reads pictures with exact cameras, and ``matching`` finds
the same points in several pictures.
"""

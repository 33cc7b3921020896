"""Floor 5: foreign formats and image sources.  One convention inside, conversion at this door.

``known`` is the table of data sets, ``catalogue`` finds them on disk.
"""

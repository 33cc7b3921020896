"""A visual system over a sequence of pictures: what ``vslam-ref run ptam`` and ``run orbslam`` do.

::

    sequence -> running (one picture after the other) -> Run
                                                         |-> numbers   what is printed and written as JSON
                                                         |-> overlay   the film, drawn with solids and raster
                                                         '-> report    the folder: paths, map, page

``kinds`` says what a system must offer, and which there are.  ``interrupting`` lets a first Ctrl-C end the
work between two pictures, so that what there is can be saved.
"""

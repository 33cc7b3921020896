"""Sequences: pictures of one camera in their order, from folders, videos and rendered scenes.

::

    source ---- contents, films, scenes ----> pictures, times, camera, truth, as far as they are there
                  |                                    |
              listing (order, gaps)      cameras, times (files beside)
                                                       |
                                opening ----> Sequence ----> Image(number, time, grey, colour, problem)

A sequence always runs to its end.  A picture that is missing, damaged, or of another size comes as an
:class:`Image` without values that says so; ``Sequence.notes`` counts these, and tells what else is odd:
assumed times, equal stamps, a truth that covers a part only.  What makes the whole useless is a
``FormatError`` at opening: a malformed list, a camera for another resolution.

*Times.*  From the source or a file; else the k-th picture, from 0, is at k/30 s.  Equal stamps are kept; of
equal ones only the first is paired with the truth (``Sequence.pairs``).

*Safety.*  Names in lists cannot lead out of their folder, the size of a picture is read before it is
unpacked, and a video must begin like one: a playlist could name other places.
"""

from vslam_ref.datasets.sequences.cameras import read_camera, write_plain_camera
from vslam_ref.datasets.sequences.opening import open_sequence
from vslam_ref.datasets.sequences.record import PROBLEMS, Image, Sequence

__all__ = ["PROBLEMS", "Image", "Sequence", "open_sequence", "read_camera", "write_plain_camera"]

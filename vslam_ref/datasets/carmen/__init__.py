"""Reader and writer of laser logs in CARMEN's text format, plain or gzipped.

One message a line, its name first; ``#`` begins a comment.  Read are the scans of the front laser, from the
first of these messages that the file has: ``FLASER``, ``ROBOTLASER1``, ``RAWLASER1`` (:mod:`.messages`).
Readings are metres, from right to left.  The laser's pose of the first two is the one in the line; in
*corrected* logs it is what scan matching found.  RAWLASER1 tells none: it is what ODOM says at that time.
Other messages (``NEFF``, ``RLASER``, ...) are counted and left alone.

What the format leaves open, and what is taken here:

* *Where the beams look.*  What the user says counts first, then the message itself (ROBOTLASER1 and RAWLASER1
  tell it, also for FLASER lines of as many beams), then ``PARAM`` lines, then the number of beams: 180, 181,
  360 and 361 are half a circle in steps of a whole or a half degree from -90 degrees on; 181 and 361 beams
  span it with both ends, 180 and 360 lack one.  (On intel, aces and fhw every other choice blurs the map.)
  Another number may stand for several fields of view; what is taken is told (:mod:`.view`).
* *When nothing came back.*  The scanners send 81.91, 81.83, 51.15 or 50 m then, by make and driver, or the
  maximum range that the message tells.  Readings of 50 m (:data:`MAX_RANGE`) and more count as "no return";
  no wall of a building is seen from there.  Where that is nearly every beam, the likely unit is told
  (:mod:`.units`).
* *Time.*  ``ipc_time``, as it is.  Stamps that run backwards or stand still are counted, and never refused.
* *Readings* may be zero, negative, ``nan`` or ``inf``: the maps count them.  Poses and times must be finite.
"""

from vslam_ref.datasets.carmen.reading import MAX_RANGE, CarmenLog, read, scanner
from vslam_ref.datasets.carmen.writing import NO_RETURN, write

__all__ = ["MAX_RANGE", "NO_RETURN", "CarmenLog", "read", "scanner", "write"]

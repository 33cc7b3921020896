"""Floor 3: occupancy grids of a world in which things move.

A laser scan and a pose change two maps: S, what stays, and D, what is moving now.

==================  =================================================================================
module              holds
==================  =================================================================================
``lattice``         :class:`Lattice`: cells <-> world, growth, the limit of memory
``log_odds``        :class:`LogOddsGrid`: probabilities as bounded log-odds; decided above 0.9, below 0.1
``scan``            :class:`Scan`, :class:`LaserScanner`; which beams say something, counted
``rays``            every cell that a beam crosses, once, exactly
``inverse_sensor``  :class:`InverseSensor`: the table S_{t-1} x (hit, miss, graze), for S and for D
``recursion``       the odds recursion of A's chapter 4, and what its readings make of it
``map_config``      :class:`MapConfig`: every number of S and D, with its reason
``static_dynamic``  :class:`StaticDynamicMap`: S and D over time
``plain``           :class:`PlainMap`: one occupancy grid that knows nothing of motion
``clusters``        things in D: place, size and velocity over time
==================  =================================================================================

Conventions: ``pose`` is (x, y, theta) of the laser in the world, metres and radians.  Beam ``i`` looks along
``theta + angles[i]``.  Arrays of cells are ``(rows, columns)``: rows go along y, columns along x, cell
``[0, 0]`` lies at ``origin_xy``.  Times are seconds.

This room does not import :mod:`vslam_ref.worlds`, nor the other way round:
:meth:`StaticDynamicMap.update` takes every object with the fields of :class:`Scan`.
"""

from vslam_ref.grids.inverse_sensor import InverseSensor
from vslam_ref.grids.lattice import Lattice
from vslam_ref.grids.log_odds import LogOddsGrid
from vslam_ref.grids.map_config import AS_PRINTED, MapConfig
from vslam_ref.grids.plain import PlainMap
from vslam_ref.grids.scan import LaserScanner, Scan, ScanLike
from vslam_ref.grids.static_dynamic import StaticDynamicMap

__all__ = [
    "AS_PRINTED",
    "InverseSensor",
    "LaserScanner",
    "Lattice",
    "LogOddsGrid",
    "MapConfig",
    "PlainMap",
    "Scan",
    "ScanLike",
    "StaticDynamicMap",
]

"""A floor with rooms, doors, people and things that are moved; a robot drives through it and looks.

::

    FloorPlan ---> Crowd (social force) ---> discs ---.
        |  doors, things (schedules) ---> segments ---+--> cast (exact) --> noise, dropouts --> ranges
        `--> route --> true poses --> odometry        |
                                                      `--> cell_truth, seen_cells

==============  ====================================================================
module          holds
==============  ====================================================================
``config``      every number, with its reason
``plan``        walls, doors, boxes, zones, the route; ``office`` and ``hall``
``rays``        exact ray casting against segments and discs
``cells``       exact cover of a raster by segments and discs
``crowd``       people: goals, social force, legs
``carts``       boxes that are pushed to and fro
``robot``       the route driven, and odometry
``recording``   ``simulate``: one run with everything that was true
``truth``       which cells are static, which are moving, which could be seen
==============  ====================================================================

**Moving** means: occupied now by something whose pose changed within the last T seconds
(``FloorPlanConfig.memory``). A chair put down is moving for T seconds more, then static.  A person who
stands still longer than T is static.

**Crowd density** means: the share of the free floor that people's bodies cover.
"""

from vslam_ref.worlds.floor_plan.carts import with_carts
from vslam_ref.worlds.floor_plan.cells import Cells, cells_on_segments, disc_cells, segment_cells
from vslam_ref.worlds.floor_plan.config import CrowdConfig, FloorPlanConfig, LaserConfig, RobotConfig
from vslam_ref.worlds.floor_plan.plan import Box, Door, FloorPlan, hall, office
from vslam_ref.worlds.floor_plan.rays import Hits, cast
from vslam_ref.worlds.floor_plan.recording import LaserScan, Recording, Surfaces, simulate, turned
from vslam_ref.worlds.floor_plan.truth import CellTruth, Seen, cell_truth, cover, seen_cells

__all__ = [
    "Box",
    "CellTruth",
    "Cells",
    "CrowdConfig",
    "Door",
    "FloorPlan",
    "FloorPlanConfig",
    "Hits",
    "LaserConfig",
    "LaserScan",
    "Recording",
    "RobotConfig",
    "Seen",
    "Surfaces",
    "cast",
    "cell_truth",
    "cells_on_segments",
    "cover",
    "disc_cells",
    "hall",
    "office",
    "seen_cells",
    "segment_cells",
    "simulate",
    "turned",
    "with_carts",
]

"""Which functions a run called, in their order: what is drawn is compared with what happened.

A box of the figure names a function of the system by its module and name.  The interpreter tells of every
call while a picture is worked on; those of functions with a box are noted.  Nothing in the system is changed.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import CodeType, FrameType
from typing import Any, NamedTuple

SYSTEM = "vslam_ref.systems.orbslam."


class FlowStage(NamedTuple):
    """A box: its process, its words, the function that does it (in ``systems.orbslam``), its stopwatch."""

    process: str
    name: str
    function: str
    stage: str


STAGES = (
    FlowStage("tracking", "ORB\nfeatures", "look:describe_picture", "features"),
    FlowStage("tracking", "points in\nwindows", "tracker.passes:look_for", "search"),
    FlowStage("tracking", "pose", "tracker.passes:posed", "pose"),
    FlowStage("tracking", "local map", "tracker.local_map:local_points", "local map"),
    FlowStage("tracking", "recover", "tracker.tracker:FeatureTracker._relocalised", "recover"),
    FlowStage("tracking", "keyframe?", "policy:CovisibilityPolicy.wants", "rest"),
    FlowStage("local mapping", "keyframe in", "feature_map:FeatureMap.add_keyframe", "keyframe in"),
    FlowStage("local mapping", "cull points", "mapper.cull:unproven", "keyframe in"),
    FlowStage("local mapping", "new points", "mapper.new_points:new_points", "new points"),
    FlowStage("local mapping", "fuse", "mapper.fuse:fuse_with_neighbours", "fuse"),
    FlowStage("local mapping", "local BA", "mapper.adjusting:adjust_local", "local"),
    FlowStage("local mapping", "cull\nkeyframes", "mapper.cull:cull_redundant", "cull"),
    FlowStage("loop closing", "candidates\nby words", "loops.words:CandidatesByWords.__call__", "loops"),
    FlowStage("loop closing", "three in\na row", "loops.consistency:Consistency.take", "loops"),
    FlowStage("loop closing", "similarity", "loops.verify:verify", "loops"),
    FlowStage("loop closing", "fuse, find\nthe pairs", "loops.join:join", "loops"),
    FlowStage("loop closing", "pose graph", "loops.correction:close_loop", "loops"),
    FlowStage("loop closing", "global BA", "mapper.adjusting:adjust_all", "loops"),
)
PROCESSES = tuple(dict.fromkeys(stage.process for stage in STAGES))


def code_of(function: str) -> CodeType:
    """The code of a function, named as ``module:name`` below the system's package.

    Examples
    --------
    >>> code_of("policy:CovisibilityPolicy.wants").co_name
    'wants'
    """
    module, _, path = function.partition(":")
    found: Any = importlib.import_module(SYSTEM + module)
    for name in path.split("."):
        found = getattr(found, name)
    code = getattr(getattr(found, "__wrapped__", found), "__code__", None)
    if not isinstance(code, CodeType):
        raise ValueError(f"{function}: need a function that is written in Python")
    return code


@contextmanager
def noted(stages: Iterable[FlowStage], into: list[int]) -> Iterator[None]:
    """Note the numbers of the stages whose functions are called meanwhile, in the order of the calls."""
    number = {code_of(stage.function): k for k, stage in enumerate(stages)}

    def see(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and frame.f_code in number:
            into.append(number[frame.f_code])

    before: Callable[..., Any] | None = sys.getprofile()
    sys.setprofile(see)
    try:
        yield
    finally:
        sys.setprofile(before)

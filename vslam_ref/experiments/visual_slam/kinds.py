"""What a visual system must offer to a run, its numbers and its page; and the systems that there are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.datasets.vocabulary_files import shipped_vocabulary
from vslam_ref.features.vocabulary import Vocabulary
from vslam_ref.geometry.cameras import Camera
from vslam_ref.systems import orbslam, ptam
from vslam_ref.systems.visual_map import KeyframeMap
from vslam_ref.systems.visual_map.chosen_start import ChosenStart
from vslam_ref.systems.visual_map.refine_camera import RefinedCamera
from vslam_ref.systems.visual_map.telling import PictureOutcome, Pose, Trail


class VisualSystem(Protocol):
    """Pictures in, poses and a map out.

    Attributes
    ----------
    map : KeyframeMap or None
        None before the start.
    chosen : ChosenStart or None
    poses : dict of int to Pose
    started_at : tuple of int, or None
    refined : RefinedCamera or None
    """

    @property
    def map(self) -> KeyframeMap | None: ...  # noqa: D102

    chosen: ChosenStart | None
    poses: dict[int, Pose]
    started_at: tuple[int, int] | None
    refined: RefinedCamera | None

    def step(self, number: int, grey: ArrayLike) -> PictureOutcome:
        """Take the next picture."""

    def finish(self) -> None:
        """Adjust everything once more."""

    def close(self) -> None:
        """Leave nothing running."""

    def trajectory(self, T_kf_world: Array | None = None) -> tuple[Array, Array]:
        """Numbers of pictures and their poses; with other poses of the keyframes, if such are given."""

    def trail(self) -> Trail | None:
        """Points that are followed before there is a map."""


class SystemKind(NamedTuple):
    """One of the systems.

    Attributes
    ----------
    name, title : str
        In commands; in texts.
    settings : type
    make : callable
        From a camera, settings, a chosen start or None, whether mapping has a thread of its own, and a
        vocabulary or None for the one that comes with the package.
    stages, mapping : tuple of str
        Of a step, in their order; those of a picture that becomes a keyframe.
    kernels : tuple of str
        Modules of compiled loops.
    counts : callable
        Further numbers of a run, by their keys.
    notes : callable
        What a reader of these should know, in lines.
    rows : tuple of (str, str, str)
        Their words and units, for the table.
    width : callable
        From settings to the width of a pixel of a level over that of the next finer one.
    """

    name: str
    title: str
    settings: type
    make: Callable[[Camera, Any, ChosenStart | None, bool, Vocabulary | None], VisualSystem]
    stages: tuple[str, ...]
    mapping: tuple[str, ...]
    kernels: tuple[str, ...]
    counts: Callable[[Any], Mapping[str, int]]
    notes: Callable[[Any], list[str]]
    rows: tuple[tuple[str, str, str], ...]
    width: Callable[[Any], float]


def _make_ptam(
    camera: Camera, settings: Any, chosen: ChosenStart | None, concurrent: bool, vocabulary: Vocabulary | None
) -> VisualSystem:
    if vocabulary is not None:
        raise ValueError("ptam: its patches have no words; give no vocabulary")
    return (ptam.ConcurrentPtam if concurrent else ptam.Ptam)(camera, settings, chosen)


def _make_orbslam(
    camera: Camera, settings: Any, chosen: ChosenStart | None, concurrent: bool, vocabulary: Vocabulary | None
) -> VisualSystem:
    if concurrent:
        raise ValueError("orbslam: its mapper has no thread of its own")
    return orbslam.OrbSlam(
        camera, settings, chosen, shipped_vocabulary() if vocabulary is None else vocabulary
    )


def _rejected_loops(system: Any) -> list[str]:
    """Why loops were rejected, in a line."""
    closer = system.close_loops
    if closer is None or not closer.rejected:
        return []
    reasons = ", ".join(f"{reason} {count}" for reason, count in closer.rejected.most_common())
    return [
        f"{closer.rejected.total()} keyframes that looked like an earlier place closed no loop: {reasons}"
    ]


PTAM = SystemKind(
    "ptam",
    "PTAM",
    ptam.Settings,
    _make_ptam,
    ptam.STAGES,
    ("start", "look again", "new points", "neighbours", "local", "global"),
    ptam.KERNELS,
    lambda system: {},
    lambda system: [],
    (),
    lambda settings: 2.0,
)
ORBSLAM = SystemKind(
    "orbslam",
    "ORB-SLAM",
    orbslam.Settings,
    _make_orbslam,
    orbslam.STAGES,
    ("start", "keyframe in", "new points", "fuse", "local", "cull", "loops"),
    orbslam.KERNELS,
    lambda system: system.counts(),
    _rejected_loops,
    (
        ("culled_keyframes", "keyframes that were culled", ""),
        ("loops", "loops that were closed", ""),
        ("loops_rejected", "loops that were rejected", ""),
        ("essential_edges", "edges of the essential graph", ""),
    ),
    lambda settings: settings.features.scale,
)
KINDS = (PTAM, ORBSLAM)


def kind_of(settings: Any) -> SystemKind:
    """The system whose settings these are.

    Examples
    --------
    >>> kind_of(ptam.Settings()).name
    'ptam'
    """
    return next(kind for kind in KINDS if isinstance(settings, kind.settings))

"""The table of contents, once: numbers, titles, parts and the rooms of the package that belong to them.

The landing page, the README's table (checked by a test) and the equation index are made from this list.
A chapter's page is found by its number: ``docs/chapters/15_*.md``.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = DOCS / "chapters"
NOTEBOOKS = ROOT / "notebooks"
PACKAGE = ROOT / "vslam_ref"


class Chapter(NamedTuple):
    """One chapter: ``room`` is the module or package that it explains, relative to ``vslam_ref/``."""

    number: int
    title: str
    part: str
    room: str

    @property
    def page(self) -> Path | None:
        """The chapter's MyST page, or None while it is planned."""
        return next(iter(sorted(PAGES.glob(f"{self.number:02d}_*.md"))), None)

    @property
    def has_code(self) -> bool:
        """Whether the chapter's module or package exists."""
        path = PACKAGE / self.room
        return path.is_dir() or path.with_suffix(".py").is_file()

    @property
    def state(self) -> str:
        """``here`` with page and code, ``code`` with code only, else ``planned``."""
        if not self.has_code:
            return "planned"
        return "here" if self.page else "code"


CHAPTERS = (
    Chapter(1, "Multi-view geometry", "Geometry", "geometry/multiview"),
    Chapter(2, "Rigid motions", "Geometry", "geometry/se3"),
    Chapter(3, "Projection models", "Geometry", "geometry/cameras"),
    Chapter(4, "Robust loss", "Estimation", "estimation/robust"),
    Chapter(5, "Levenberg-Marquardt", "Estimation", "estimation/least_squares"),
    Chapter(6, "Bundle adjustment", "Estimation", "estimation/bundle"),
    Chapter(7, "Camera calibration", "Estimation", "estimation/calibration"),
    Chapter(8, "Image features", "From images to a map", "features"),
    Chapter(9, "Two views", "From images to a map", "geometry/multiview/two_views"),
    Chapter(10, "Tracking", "From images to a map", "systems/ptam/tracker"),
    Chapter(11, "Mapping", "From images to a map", "systems/ptam/mapper"),
    Chapter(12, "PTAM", "From images to a map", "systems/ptam"),
    Chapter(13, "Pose graphs", "Closing loops", "estimation/posegraph"),
    Chapter(14, "ORB-SLAM", "Closing loops", "systems/orbslam"),
    Chapter(15, "Ackermann EKF-SLAM", "Filters", "filters/ekf_slam"),
    Chapter(16, "IEKF-SLAM", "Filters", "filters/carleman_ekf"),
    Chapter(17, "Consistency", "Filters", "metrics/consistency"),
    Chapter(18, "AR registration", "Registration", "systems/registration"),
    Chapter(19, "Static and dynamic grids", "A world that moves", "grids"),
    Chapter(20, "Landmarks among moving things", "A world that moves", "grids/landmarks"),
    Chapter(21, "Filter SLAM: MonoSLAM and MSCKF", "Other families", "systems/monoslam"),
    Chapter(22, "Direct SLAM: LSD-SLAM and DTAM", "Other families", "systems/direct"),
    Chapter(23, "The methods compared", "Comparing and verifying", "experiments/methods"),
    Chapter(24, "Verify your implementation", "Comparing and verifying", "conformance"),
)


def pages() -> list[Path]:
    """All chapter pages, in the order of their numbers."""
    return sorted(PAGES.glob("[0-9][0-9]_*.md"))


def toctrees() -> str:
    """One MyST toctree for every part of the book that has a page."""
    parts: dict[str, list[str]] = {}
    for chapter in CHAPTERS:
        if chapter.page:
            parts.setdefault(chapter.part, []).append(f"chapters/{chapter.page.stem}")
    blocks = []
    for part, names in parts.items():
        listing = "\n".join(names)
        blocks.append(f"```{{toctree}}\n:caption: {part}\n:maxdepth: 1\n\n{listing}\n```\n")
    return "\n".join(blocks)


def chapter_table() -> str:
    """The whole table of contents as a Markdown table, pages linked, planned chapters named."""
    words = {"here": "here", "code": "code only", "planned": "planned"}
    lines = ["| | chapter | part | room of `vslam_ref` | state |", "|---|---|---|---|---|"]
    for chapter in CHAPTERS:
        page = chapter.page
        title = f"{{doc}}`{chapter.title} <chapters/{page.stem}>`" if page else chapter.title
        lines.append(
            f"| {chapter.number:02d} | {title} | {chapter.part} | `{chapter.room}` | {words[chapter.state]} |"
        )
    return "\n".join(lines) + "\n"

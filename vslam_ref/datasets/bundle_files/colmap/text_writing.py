"""COLMAP's text form, printed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from vslam_ref.datasets.bundle_files.colmap.rows import CameraRow, ImageRow, PointRow
from vslam_ref.datasets.bundle_files.colmap.text import FILES


def printed(
    cameras: Iterable[CameraRow], images: Iterable[ImageRow], points: Iterable[PointRow]
) -> dict[str, bytes]:
    """Content of the three files."""
    lines = (
        ["# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]", *map(_camera, cameras)],
        ["# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME", "# POINTS2D[] as (X, Y, POINT3D_ID)"],
        ["# POINT3D_ID X Y Z R G B ERROR TRACK[] as (IMAGE_ID, POINT2D_IDX)", *map(_point, points)],
    )
    for image in images:
        lines[1].extend(_image(image))
    return {
        name: ("\n".join(one) + "\n").encode("utf-8", "surrogateescape")
        for name, one in zip(FILES, lines, strict=True)
    }


def require_printable(names: Sequence[str]) -> None:
    """Refuse names that a line of text cannot give back: empty, of two lines, or with blanks around.

    Raises
    ------
    ValueError
        With the name.
    """
    for name in names:
        if not name or "\n" in name or name.strip() != name:
            why = "a line of text cannot give it back (empty, of two lines, or with blanks at an end)"
            raise ValueError(f"image name {name[:60]!r}: {why}; write the binary form")


def _camera(row: CameraRow) -> str:
    width, height = row.size
    return f"{row.number} {row.model} {width} {height} {' '.join(map(repr, row.params))}"


def _image(row: ImageRow) -> tuple[str, str]:
    features = zip(row.uv.tolist(), row.point.tolist(), strict=True)
    return (
        f"{row.number} {' '.join(map(repr, row.pose))} {row.camera} {row.name}",
        " ".join(f"{u!r} {v!r} {point}" for (u, v), point in features),
    )


def _point(row: PointRow) -> str:
    track = " ".join(f"{image} {at}" for image, at in row.track.tolist())
    head = f"{row.number} {' '.join(map(repr, row.X))} {' '.join(map(str, row.colour))} {row.error!r}"
    return f"{head} {track}".rstrip()

"""Figures as files: the same figure gives the same bytes."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

__all__ = ["FORMATS", "Figure", "figure_bytes", "save_figure"]

PNG_DPI = 150
FORMATS = ("png", "svg")


def figure_bytes(figure: Figure, format: str, salt: str) -> bytes:
    """Return a figure as the content of one file.

    Parameters
    ----------
    figure : Figure
    format : {"png", "svg"}
    salt : str
        As in :func:`save_figure`.

    Raises
    ------
    ValueError
        If there is no such format.
    """
    if format not in FORMATS:
        raise ValueError(f"figure format {format!r}: need one of {', '.join(FORMATS)}")
    stream = BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": salt}):
        more: dict[str, Any] = {"metadata": {"Date": None}} if format == "svg" else {"dpi": PNG_DPI}
        figure.savefig(stream, format=format, **more)
    return stream.getvalue()


def save_figure(figure: Figure, folder: Path, salt: str, name: str = "figure") -> None:
    """Write ``figure.svg`` and ``figure.png`` (or another ``name``) into ``folder``.

    Parameters
    ----------
    figure : Figure
        What to write.
    folder : Path
        Where; it exists.
    salt : str
        Seed of the ids inside the SVG, which matplotlib otherwise draws at random.
    name : str
        Of both files, without what follows the dot.
    """
    with matplotlib.rc_context({"svg.hashsalt": salt}):
        figure.savefig(folder / f"{name}.svg", format="svg", metadata={"Date": None})
        figure.savefig(folder / f"{name}.png", format="png", dpi=PNG_DPI)

"""Figures as files: the same figure gives the same bytes."""

from __future__ import annotations

from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

__all__ = ["Figure", "save_figure"]

PNG_DPI = 150


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

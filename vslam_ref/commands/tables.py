"""Plain-text tables for a terminal."""

from __future__ import annotations

from collections.abc import Sequence


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return left-aligned columns two blanks apart, with a line under the heads.

    Examples
    --------
    >>> print(table(["n", "name"], [["1", "one"], ["12", "twelve"]]))
    n   name
    --  ------
    1   one
    12  twelve
    """
    lines = [list(heads), *(list(row) for row in rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(heads))]
    lines.insert(1, ["-" * width for width in widths])
    return "\n".join(
        "  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)).rstrip() for line in lines
    )

"""Reader of NIST's nonlinear regressions (StRD): observations, two starts, certified results.

A file says in its first lines where its parts are, counted from line 1::

    Dataset Name:  Misra1a           (Misra1a.dat)
                   Starting Values   (lines 41 to 42)
                   Certified Values  (lines 41 to 47)
                   Data              (lines 61 to 74)

A line of values is ``b1 = start1 start2 certified deviation``; a line of data is the response and one or
two predictors.  Everything is read from these places and compared with the counts that the file states.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.text import FormatError, number, numbers, read_lines

MAX_BYTES = 2**20
"""The largest of the 27 files of the collection has 0.2 MiB."""

LONGEST_LINE = 500
"""The longest of the files known here has 71 characters; searching takes the square of a line's length."""

Lines = dict[int, str]


@dataclass(frozen=True)
class NistProblem:
    """One regression, its parameters in the order b1, b2 and so on.

    Attributes
    ----------
    name, level, model : str
        NIST's name; "Lower", "Average" or "Higher" level of difficulty; the formula as printed.
    y : ndarray, shape (m,)
        Responses as in the file (Nelson's model is for their logarithm).
    x : ndarray, shape (m,) or (m, 2)
        Predictors.
    starts : ndarray, shape (2, n)
        Start 1, far, and start 2, nearer.
    certified, deviations : ndarray, shape (n,)
        Certified parameters and their standard deviations, eleven digits.
    residual_sum_of_squares, residual_deviation : float
        Certified.
    """

    name: str
    level: str
    model: str
    y: Array
    x: Array
    starts: Array
    certified: Array
    deviations: Array
    residual_sum_of_squares: float
    residual_deviation: float


def names(folder: Path) -> list[str]:
    """Names of the problems in a folder, sorted."""
    return sorted(path.stem for path in folder.glob("*.dat"))


def read_problem(path: Path) -> NistProblem:
    """Read one file.

    Raises
    ------
    FormatError
        If a part is missing, a count disagrees, or a word is not a number, with file and line.
    """
    lines = dict(read_lines(path, MAX_BYTES))
    for at, text in lines.items():
        if len(text) > LONGEST_LINE:
            what = f"a line of {len(text)} characters; expected at most {LONGEST_LINE}"
            raise FormatError(path, at, what)
    _, title = _find(path, lines, r"Dataset Name:\s*(\S+)")
    begin, end = _places(path, lines, "Starting Values")
    values = np.array([_values(path, lines, i, i - begin + 1) for i in range(begin, end + 1)])
    data = _data(path, lines)
    observations = _certified(path, lines, "Number of Observations")
    if len(data) != observations:
        raise FormatError(path, None, f"{len(data)} lines of data; {observations:g} observations stated")
    degrees = _certified(path, lines, "Degrees of Freedom")
    if len(data) - len(values) != degrees:
        what = f"{len(data)} observations, {len(values)} parameters; {degrees:g} degrees of freedom stated"
        raise FormatError(path, None, what)
    return NistProblem(
        name=title,
        level=_find(path, lines, r"(\w+) Level of Difficulty")[1],
        model=_model(path, lines, begin),
        y=data[:, 0],
        x=data[:, 1] if data.shape[1] == 2 else data[:, 1:],
        starts=values[:, :2].T.copy(),
        certified=values[:, 2],
        deviations=values[:, 3],
        residual_sum_of_squares=_certified(path, lines, "Residual Sum of Squares"),
        residual_deviation=_certified(path, lines, "Residual Standard Deviation"),
    )


def _find(path: Path, lines: Lines, pattern: str) -> tuple[int, str]:
    """Line number and first group of the only line that matches."""
    found = [(i, match[1]) for i, text in lines.items() if (match := re.search(pattern, text))]
    if len(found) != 1:
        raise FormatError(path, None, f"{len(found)} lines match {pattern!r}; expected one")
    return found[0]


def _places(path: Path, lines: Lines, part: str) -> tuple[int, int]:
    """First and last line of a part, as the file's head says."""
    at, _ = _find(path, lines, rf"({part})\s+\(lines")
    match = re.search(r"\(lines\s+(\d{1,6})\s+to\s+(\d{1,6})\)", lines[at])
    begin, end = (int(match[1]), int(match[2])) if match else (1, 0)
    if not at < begin <= end:
        raise FormatError(path, at, f"{lines[at]!r}; expected '{part} (lines FIRST to LAST)' further down")
    return begin, end


def _values(path: Path, lines: Lines, at: int, index: int) -> list[float]:
    """Two starts, certified value and deviation of one parameter."""
    label, _, rest = lines.get(at, "").partition("=")
    words = rest.split()
    if label.strip() != f"b{index}" or len(words) != 4:
        what = f"{lines.get(at, '')!r}; expected 'b{index} = start start certified deviation'"
        raise FormatError(path, at, what)
    kinds = ("start 1", "start 2", "certified value", "standard deviation")
    read = numbers(path, at, words, [f"{kind} of b{index}" for kind in kinds])
    if not (read[2] != 0.0 and read[3] > 0.0):
        raise FormatError(path, at, "expected a certified value that is not 0 and a deviation > 0")
    return read


def _data(path: Path, lines: Lines) -> Array:
    """Response and predictors, (m, 2) or (m, 3)."""
    begin, end = _places(path, lines, "Data")
    head = lines.get(begin - 1, "").split()
    if head[:2] != ["Data:", "y"] or len(head) not in (3, 4):
        raise FormatError(path, begin - 1, "expected 'Data: y x' or 'Data: y x1 x2' above the data")
    rows = []
    for at in range(begin, end + 1):
        rows.append(numbers(path, at, lines.get(at, "").split(), head[1:]))
    beyond = [at for at in lines if at > end]
    if beyond:
        raise FormatError(path, beyond[0], f"text after the data, which end in line {end}")
    return np.array(rows)


def _certified(path: Path, lines: Lines, what: str) -> float:
    at, word = _find(path, lines, rf"^{what}:\s*(\S+)")
    value = number(path, at, word, what)
    if not 0.0 <= value < math.inf:
        raise FormatError(path, at, f"{what} is {word}; expected a number >= 0")
    return value


def _model(path: Path, lines: Lines, begin: int) -> str:
    """The formula, its lines joined."""
    at, _ = _find(path, lines, r"(\d+) Parameters? \(")
    text = [lines[i] for i in range(at + 1, begin) if i in lines]
    formula = [line for line in text if not re.search(r"Starting|Start 1", line)]
    if not formula or "=" not in formula[0]:
        raise FormatError(path, at, "expected the model's formula below the number of parameters")
    return " ".join(" ".join(formula).split())

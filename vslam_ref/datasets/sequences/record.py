"""What a sequence is: pictures with number and time, read one by one, and what is known beside them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.pictures import Picture
from vslam_ref.datasets.text import FormatError
from vslam_ref.geometry.cameras import Camera
from vslam_ref.metrics.trajectory import Pairs, Trajectory, associate

Bytes = NDArray[np.uint8]
MISSING, DAMAGED, SIZE, BLANK = "missing", "damaged", "wrong size", "blank"
PROBLEMS = (MISSING, DAMAGED, SIZE, BLANK)
"""With one of these words the ``problem`` of an image begins."""
SHOWN = 5
"""Numbers of bad pictures that a note lists."""


class MissingPictureError(FormatError):
    """A picture that the sequence should have is not there."""


class Image(NamedTuple):
    """One picture of a sequence.

    Attributes
    ----------
    number : int
        Its place in the source, from 0.
    time : float
        Seconds.
    grey : ndarray of uint8, shape (H, W), or None
        None where there is no usable picture: it is missing, damaged, or of another size than the others.
    colour : ndarray of uint8, shape (H, W, 3), or None
        Red, green, blue; None also where the source has grey values only.
    problem : str
        What is wrong with it, beginning with one of ``PROBLEMS``, or "".  A blank picture (all values equal)
        is given as it is.
    """

    number: int
    time: float
    grey: Bytes | None
    colour: Bytes | None = None
    problem: str = ""


@dataclass(frozen=True)
class Sequence:
    """Pictures of one camera in their order, read when they are asked for.

    Iterating yields an :class:`Image` for every number in ``numbers``, whatever has happened to its file.

    Attributes
    ----------
    name, layout : str
        What was opened, and how it is laid out: "plain", "kitti", "tum", "euroc", "7scenes", "video",
        "rendered".
    size : (int, int)
        Width and height, pixels.
    times : ndarray, shape (N,)
        Seconds, of all pictures of the source.  They may be equal, or even fall: see ``notes``.
    numbers : ndarray of int, shape (M,)
        Which pictures of the source this sequence has.
    picture : callable
        Gives picture ``number`` of the source, or raises ``FormatError``.
    camera : Camera or None
    camera_from : str
        Where the camera was read.
    truth : Trajectory or None
        T_world_cam in the clock of ``times``; metres where the source has metres.
    truth_from : str
        Where the truth was read.
    told : tuple of str
        Oddities that were found at opening.
    problems : dict
        Number -> problem, of the pictures that were asked for so far.
    """

    name: str
    layout: str
    size: tuple[int, int]
    times: Array
    numbers: IntArray
    picture: Callable[[int], Picture]
    camera: Camera | None = None
    camera_from: str = ""
    truth: Trajectory | None = None
    truth_from: str = ""
    told: tuple[str, ...] = ()
    problems: dict[int, str] = field(default_factory=dict, compare=False)

    def __len__(self) -> int:
        return len(self.numbers)

    def __iter__(self) -> Iterator[Image]:
        return (self.image(int(number)) for number in self.numbers)

    def image(self, number: int) -> Image:
        """Return picture ``number`` of the source, from 0, in any order.

        Raises
        ------
        IndexError
            If the source has no such number.
        """
        if not 0 <= number < len(self.times):
            raise IndexError(f"picture {number} of {self.name}: has 0 to {len(self.times) - 1}")
        found = self._read(number)
        if found.problem:
            self.problems[number] = found.problem
        return found

    def _read(self, number: int) -> Image:
        time = float(self.times[number])
        try:
            found = self.picture(number)
        except FormatError as error:
            kind = MISSING if isinstance(error, MissingPictureError) else DAMAGED
            return Image(number, time, None, None, f"{kind}: {error}")
        height, width = found.grey.shape
        if (width, height) != self.size:
            what = f"{SIZE}: {width}x{height} pixels; the others have {self.size[0]}x{self.size[1]}"
            return Image(number, time, None, None, what)
        least, most = int(found.grey.min()), int(found.grey.max())
        problem = f"{BLANK}: every grey value is {least}" if least == most else ""
        return Image(number, time, found.grey, found.colour, problem)

    def pairs(self) -> Pairs:
        """Return which picture (its number, in ``estimate``) belongs to which pose of the truth: by time.

        Of pictures with equal stamps only the first takes part.

        Raises
        ------
        ValueError
            If there is no truth.
        """
        if self.truth is None or self.truth.times is None:
            raise ValueError(f"{self.name} has no true trajectory with times")
        stamps, first = np.unique(self.times, return_index=True)
        found = associate(stamps, self.truth.times)
        return Pairs(first[found.estimate].astype(np.int64), found.truth)

    @property
    def notes(self) -> tuple[str, ...]:
        """What is odd, harmless, and worth knowing: found at opening, and counted while reading."""
        counts = Counter(problem.partition(":")[0] for problem in self.problems.values())
        return self.told + tuple(self._note(kind, counts[kind]) for kind in PROBLEMS if counts[kind])

    def _note(self, kind: str, count: int) -> str:
        which = sorted(n for n, problem in self.problems.items() if problem.startswith(f"{kind}:"))
        listed = ", ".join(map(str, which[:SHOWN])) + (", …" if count > SHOWN else "")
        return f"{count} picture(s) {kind}: number {listed}"

    def part(self, start: int = 0, stop: int | None = None, step: int = 1) -> Sequence:
        """Return the pictures ``start`` to ``stop`` - 1 in steps; they keep their numbers and times.

        Raises
        ------
        ValueError
            If that leaves none, or a number is negative.
        """
        end = len(self.times) if stop is None else min(stop, len(self.times))
        if start < 0 or step < 1 or start >= end:
            has = f"pictures 0 to {len(self.times) - 1}"
            raise ValueError(
                f"from {start} to {end} in steps of {step} of {self.name}: no picture; it has {has}"
            )
        return replace(self, numbers=np.arange(start, end, step), problems={})

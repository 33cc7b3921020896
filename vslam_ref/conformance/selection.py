"""Which vectors are asked: chapters, topics, functions and cases that add up."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable
from pathlib import Path

from vslam_ref.conformance.regimes import place
from vslam_ref.conformance.vectors_format import Case, VectorFile, load, names


def select(
    chapters: Collection[int] = (),
    topics: Collection[str] = (),
    functions: Collection[str] = (),
    cases: Collection[str] = (),
) -> list[VectorFile]:
    """Files with the cases of any of these; all files where nothing is named.

    Basic topics come first, so that a run that ends early has asked what the rest is built on.

    Raises
    ------
    ValueError
        If a name is unknown; with the nearest one.
    """
    found = sorted(map(load, names()), key=lambda file: min(place(case.function) for case in file.cases))
    if not (chapters or topics or functions or cases):
        return found
    _check_files(found, chapters, topics)
    everything = [case for file in found for case in file.cases]
    _check("function", functions, {case.function for case in everything}, "'vslam-ref vectors list' has all")
    _check("case", cases, {case.id for case in everything}, "ids are those of the report")

    def wanted(file: VectorFile, case: Case) -> bool:
        named = case.function in functions or case.id in cases
        return named or file.chapter in chapters or _topic(file) in topics

    chosen = [file._replace(cases=[case for case in file.cases if wanted(file, case)]) for file in found]
    return [file for file in chosen if file.cases]


def _topic(file: VectorFile) -> str:
    return Path(file.name).stem


def _check_files(found: list[VectorFile], chapters: Iterable[int], topics: Iterable[str]) -> None:
    known = sorted({file.chapter for file in found})
    unknown = [f"chapter {c}" for c in chapters if c not in known]
    unknown += [f"topic {t}" for t in topics if t not in map(_topic, found)]
    if unknown:
        raise ValueError(
            f"no vectors of that chapter or topic: {unknown[0]}; chapters: {', '.join(map(str, known))}; "
            f"topics: {', '.join(map(_topic, found))}"
        )


def _check(what: str, given: Iterable[str], known: set[str], where: str) -> None:
    for name in given:
        if name not in known:
            near = difflib.get_close_matches(name, sorted(known), 3, 0.5)
            like = f"; did you mean {' or '.join(near)}?" if near else ""
            raise ValueError(f"no {what} {name!r} in the vectors{like} ({where})")

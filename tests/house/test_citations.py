"""Every equation of the chapters is computed somewhere, and the code that does so cites it."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest

NOT_YET: dict[str, int] = {}
"""Chapter -> labels that may be without a citation for now.  Numbers only shrink; at 0 they leave."""


def test_labels_are_cited_where_they_are_computed(index: ModuleType) -> None:
    """``python docs/_tools/equation_index.py --uncited`` lists them."""
    uncited = index.uncited_labels()
    print("not yet cited:", {number: len(labels) for number, labels in uncited.items()}, "of", NOT_YET)
    for number, labels in uncited.items():
        assert len(labels) <= NOT_YET.get(number, 0), f"chapter {number}: no code cites {', '.join(labels)}"
    assert set(NOT_YET) <= set(uncited), f"all labels are cited: take out {set(NOT_YET) - set(uncited)}"


@pytest.mark.parametrize(
    ("source", "labels"),
    [
        ("K = P @ H.T  # eq-gain\n", {"eq-gain"}),
        ("# eq-gain, eq-b16: both at once\nx = 1\n", {"eq-gain", "eq-b16"}),
        ("x = 1  # as eq-gain says\n", set()),
        ("x = 1  # the gain (eq-gain)\n", set()),
        ('x = "# eq-gain"\n', set()),
    ],
)
def test_a_comment_counts_when_it_begins_with_the_label(
    index: ModuleType, source: str, labels: set[str]
) -> None:
    assert index.labels_at_lines(source) == labels


def test_a_label_without_a_citation_is_found(
    index: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = tmp_path / "15_page.md"
    page.write_text("$$ a $$ (eq-one)\n\n$$ b $$ (eq-two)\n\n$$ c $$ (eq-step-three)\n\n$$ d $$ (eq-b4)\n")
    package = tmp_path / "vslam_ref"
    package.mkdir()
    (package / "code.py").write_text(
        '"""Code.\n\nImplements :eq:`eq-b4` (B4).  See :eq:`eq-two`.\n"""\nx = 1  # eq-one\n'
    )
    monkeypatch.setattr(index.book, "PAGES", tmp_path)
    monkeypatch.setattr(index.book, "PACKAGE", package)
    assert index.uncited_labels() == {"15": ["eq-two"]}
    assert index.main(["--uncited"]) == 1

"""The equation index counts a citation where code says that it implements an equation, and nowhere else."""

from __future__ import annotations

from types import ModuleType

import pytest


@pytest.mark.parametrize(
    ("docstring", "items"),
    [
        ("Predict. Implements :eq:`eq-b16` (B16).", {"B16"}),
        ("Predict.\n\nImplements :eq:`eq-a2-8` (A2.8)\nand :eq:`eq-b4`.\n\nSee B9.", {"A2.8", "B4"}),
        (
            "Implements :eq:`eq-b25` (B25), made of B23 and B24. Unlike B26, it is exact.",
            {"B23", "B24", "B25"},
        ),
        ("Implements B1-B3 and A§2.2.1.", {"B1", "B2", "B3", "A§2.2.1"}),
        ("Implements B fig 2, B table 1.", {"B fig 2", "B table 1"}),
        ("As :eq:`eq-b16` (B16) says.", set()),
        ("Implements :eq:`eq-b18-printed`.", set()),  # the printed form does not cover the equation
        ("", set()),
    ],
)
def test_cited_items(index: ModuleType, docstring: str, items: set[str]) -> None:
    assert index.cited_items(docstring) == items


def test_the_rows_are_complete_and_disjoint(index: ModuleType) -> None:
    items = [item for row in index.seed_rows.ROWS for item in row.items]
    assert len(items) == len(set(items))
    assert {f"B{n}" for n in range(1, 30)} <= set(items)
    assert {f"A1.{n}" for n in range(1, 5)} | {f"A2.{n}" for n in range(1, 10)} <= set(items)


def test_no_code_cites_what_the_seeds_do_not_have(index: ModuleType) -> None:
    assert index.unknown_items(index.citations()) == []


def test_the_stored_index_is_up_to_date(index: ModuleType) -> None:
    assert index.INDEX.read_text(encoding="utf-8") == index.index_text()

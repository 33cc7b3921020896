"""What chapter 24 says is so: its table of the schema, and its derivations for random answers."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import kstest, norm

from vslam_ref.conformance import vectors_format

PAGE = Path(__file__).resolve().parents[2] / "docs" / "chapters" / "24_verify.md"
ROW = re.compile(r"^\| `([^`]+)` \| (must|) ?\| ([^|]+?) \| (.+) \|$", re.MULTILINE)
SCHEMA = json.loads((vectors_format.folder() / "schema.json").read_text(encoding="utf-8"))
WORDS = {
    "string": "text",
    "number": "number",
    "integer": "whole number",
    "boolean": "truth value",
    "object": "object",
    "array": "list",
}


def fields(schema: dict[str, Any], path: str = "", must: bool = True) -> Iterator[tuple[str, bool, str]]:
    """Yield path, whether its parent always has it, and type of every field."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        if name == "value":
            yield path, must, "value"
            return
        schema = SCHEMA["$defs"][name]
    if path:
        yield path, must, _type(schema)
    for name, inner in schema.get("properties", {}).items():
        yield from fields(inner, f"{path}.{name}".lstrip("."), name in schema.get("required", []))
    others = schema.get("additionalProperties")
    if isinstance(others, dict):
        yield from fields(others, f"{path}.*", False)
    if "items" in schema:
        yield from fields(schema["items"], f"{path}[]", False)


def _type(schema: dict[str, Any]) -> str:
    if "const" in schema:
        return str(schema["const"])
    return "word" if "enum" in schema else WORDS[schema["type"]]


def table() -> list[tuple[str, bool, str]]:
    text = PAGE.read_text(encoding="utf-8")
    part = text[text.index("| field | must |") : text.index("Numbers that are not finite are the words")]
    return [(path, bool(must), kind) for path, must, kind, _ in ROW.findall(part)]


def test_the_page_tells_every_field_of_the_schema() -> None:
    """In the schema's order, with the same types, and nothing else."""
    assert table() == list(fields(SCHEMA))


def test_what_the_page_says_in_words_is_what_the_schema_says() -> None:
    """Of numbers and words that stand in the table's last column."""
    text = PAGE.read_text(encoding="utf-8")
    meaning = {path: words for path, _, _, words in ROW.findall(text)}
    case = SCHEMA["$defs"]["case"]["properties"]
    assert set(case["result"]["enum"]) == set(re.findall(r"`(\w+)`", meaning["groups[].cases[].result"]))
    rate = SCHEMA["$defs"]["group"]["properties"]["statistic"]["properties"]["false_alarm"]["maximum"]
    assert meaning["groups[].statistic.false_alarm"].endswith(f"at most {rate}")
    chapter = SCHEMA["properties"]["chapter"]
    assert meaning["chapter"].endswith(f"{chapter['minimum']} to {chapter['maximum']}")
    example = re.findall(r"`([^`]+)`", meaning["groups[].cases[].id"])[0]
    assert re.fullmatch(case["id"]["pattern"], example)


# -- the derivations of the page ---------------------------------------------------------------------


def test_moments_of_the_trace_of_a_uniform_rotation() -> None:
    """Integrals of the page's density, by quadrature: 1, then 0, 1, 3 for the powers 1, 2, 4.

    The integrands are polynomials of the cosine, so 64 points at equal distances are exact to rounding.
    """
    angle = (np.arange(64) + 0.5) * np.pi / 64
    density = (1 - np.cos(angle)) / np.pi
    for power, wanted in ((0, 1.0), (1, 0.0), (2, 1.0), (4, 3.0)):
        found = np.sum(density * (1 + 2 * np.cos(angle)) ** power) * np.pi / 64
        assert abs(found - wanted) < 1e-13, power


def test_the_density_is_that_of_uniform_quaternions() -> None:
    """Angles of normalised Gaussian quaternions: a Kolmogorov test with a false-alarm rate of 1e-4."""
    q = np.random.default_rng(5).standard_normal((20_000, 4))
    angle = 2 * np.arccos(np.abs(q[:, 0]) / np.linalg.norm(q, axis=1))
    assert kstest(angle, lambda a: (a - np.sin(a)) / np.pi).pvalue > 1e-4


def test_bands_of_the_vectors_are_those_of_the_page() -> None:
    """Mean plus or minus z sqrt(variance / N), with the moments above."""
    rules = {
        case.flags[1]: case.statistic
        for case in vectors_format.load("02/so3.json").cases
        if case.function == "so3.random"
    }
    for measure, mean, variance in (("mean_trace", 0.0, 1.0), ("mean_squared_trace", 1.0, 2.0)):
        rule = rules[measure]
        assert rule is not None
        half = norm.isf(rule["false_alarm"] / 2) * np.sqrt(variance / rule["samples"])
        assert np.allclose([rule["low"], rule["high"]], [mean - half, mean + half], atol=1e-12)

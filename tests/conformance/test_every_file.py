"""What holds for every file of vectors: it fits its schema, stays short, and the library passes it."""

from __future__ import annotations

import json

import pytest
from jsonschema import Draft202012Validator

from vslam_ref.conformance import vectors_format as form
from vslam_ref.conformance.program import InProcess
from vslam_ref.conformance.runner import run

FILES = form.names()


@pytest.mark.parametrize("name", FILES)
def test_files_are_short_and_fit_their_schema(name: str) -> None:
    text = (form.folder() / name).read_text(encoding="utf-8")
    assert len(text) < 500_000
    schema = json.loads((form.folder() / "schema.json").read_text(encoding="utf-8"))
    assert list(Draft202012Validator(schema).iter_errors(json.loads(text))) == []
    assert list(form.lint(form.load(name))) == []


@pytest.mark.parametrize("name", FILES)
def test_the_library_passes(name: str) -> None:
    report = run(InProcess("vslam_ref.conformance.adapters.itself"), [form.load(name)])
    bad = [o for o in report.outcomes if o.status != "passed"]
    assert [f"{o.case.id}: {o.status} {o.cause} {o.difference and o.difference[-2:]}" for o in bad] == []
    assert report.count("unsupported") == 0

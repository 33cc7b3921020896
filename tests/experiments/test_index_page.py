"""``index.html`` is one safe page: everything escaped, failed claims first, nothing fetched."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from toy_experiment import TOY

from vslam_ref.experiments.framework import RunContext, report
from vslam_ref.experiments.framework.reproduce import reproduce
from vslam_ref.support import pages

VOID = {"meta", "link", "br", "img"}


class Page(HTMLParser):
    """Collects tags, addresses and text, and checks that tags close in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.addresses: list[str] = []
        self.text = ""
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.addresses += [value for key, value in attrs if key in ("src", "href")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def page(out: Path) -> Page:
    return Page((out / "index.html").read_text(encoding="utf-8"))


@pytest.fixture
def out(tmp_path) -> Path:
    list(reproduce([(TOY, TOY.configure(overrides=["scale=9"]))], RunContext(), tmp_path))
    return tmp_path


def test_texts_of_experiments_are_shown_as_text(out):
    shown = page(out)
    assert "script" not in shown.tags
    assert "b" not in shown.tags
    assert "A toy <script>alert(1)</script>" in shown.text
    assert "one < two & so on" in shown.text
    assert "<b>any</b> & all" in shown.text


def test_no_text_of_a_result_file_becomes_markup():
    evil = '"><u>&'
    keys = ("id", "source", "text", "rule", "ci", "null_rate", "share", "verdict", "sentence", "runs")
    claim = dict.fromkeys((*keys, "least_runs", "small_sample"), evil)
    setting = dict.fromkeys(("key", "value", "default", "unit", "reason"), evil)
    result = {
        **dict.fromkeys(("folder", "title", "source", "seed", "runs", "seconds"), evil),
        "claims": [{**claim, "measured": {evil: evil}}],
        "assumptions": [setting, {**setting, "default": "another"}],
        "versions": {evil: evil},
        "arrays": {evil: evil},
        "quick": evil,
    }
    for text in (report.index([result]), report.index([{"folder": evil, "error": evil, "claims": []}])):
        assert "<u>" not in text
        assert evil in Page(text).text


def test_nothing_is_requested_but_the_files_beside_the_page(out):
    addresses = page(out).addresses
    beside = [a for a in addresses if not a.startswith(("#", "data:"))]
    assert beside
    assert all((out / address).is_file() for address in beside)
    assert not re.search(r"https?:|//|@import|url\(", (out / "index.html").read_text(encoding="utf-8"))


def test_failed_claims_come_first(out):
    text = page(out).text
    assert text.index("✗ not reproduced", text.index("Claims, failed")) < text.index(
        "– not testable", text.index("Claims, failed")
    )


def test_the_sentence_stands_open_and_raw_values_are_folded_under_it(out):
    html = (out / "index.html").read_text(encoding="utf-8")
    sentence = "The mean is 8.97, and 1 is meant: not reproduced."
    assert sentence in html
    after = html[html.index(sentence) + len(sentence) :]
    assert after.startswith("<details><summary>rule and raw values</summary>")
    folded = after[: after.index("</details>")]
    assert all(word in folded for word in ("|mean - 1|", "<td>mean</td>", "<td>null_rate</td>"))


def test_a_changed_assumption_shows_its_default(out):
    assert re.search(r"scale9 \(changed; default 1\)", page(out).text)


def test_all_results_of_the_folder_are_shown_and_unreadable_ones_named(out):
    (out / "another").mkdir()
    content = json.loads((out / "toy" / "result.json").read_text())
    (out / "another" / "result.json").write_text(json.dumps({**content, "title": "Another one"}))
    for name, text in (("broken", "{"), ("list", "[1]"), ("odd", '{"claims": [1], "assumptions": []}')):
        (out / name).mkdir()
        (out / name / "result.json").write_text(text)
    report.write_index(out)
    shown = page(out).text
    assert "Another one" in shown
    assert shown.count("result.json cannot be read") == 6  # in the overview and in its section, three times


def test_results_of_other_commands_are_left_out(out):
    """``run`` and ``grid`` write a ``result.json`` too, in folders beside it when one follows the README."""
    (out / "robot").mkdir()
    (out / "robot" / "result.json").write_text('{"dataset": "mrclam", "rmse_position_m": 0.06}')
    report.write_index(out)
    assert "robot" not in page(out).text


def test_seconds_are_read_without_an_exponent(out):
    path = out / "toy" / "result.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "seconds": 2.3e-05}))
    report.write_index(out)
    assert "seconds 0.0." in page(out).text


def test_an_empty_folder_gives_a_page(tmp_path):
    report.write_index(tmp_path)
    assert "All experiments" in page(tmp_path).text


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_colours_are_readable(scheme):
    """WCAG AA: contrast 4.5 or more between text and paper."""
    blocks = re.findall(r":root \{(.*?)\}", pages.STYLE, re.DOTALL)
    block = blocks[0 if scheme == "light" else 1]
    colours = dict(re.findall(r"--(\w+): (#[0-9a-f]+)", block))

    def luminance(code: str) -> float:
        code = code[1:] if len(code) == 7 else "".join(2 * c for c in code[1:])
        channels = [int(code[i : i + 2], 16) / 255 for i in (0, 2, 4)]
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    for name in ("ink", "good", "bad", "open", "link"):
        pair = sorted([luminance(colours[name]), luminance(colours["paper"])])
        assert (pair[1] + 0.05) / (pair[0] + 0.05) >= 4.5, name

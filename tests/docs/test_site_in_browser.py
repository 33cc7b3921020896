"""The built book in a real browser: formulas drawn, figures loaded, nothing asked from the network.

Needs a built site (`make docs`) and Chromium or Chrome; otherwise these tests are skipped with the reason.
The browser resolves no host name, so whatever the pages need must lie in the site itself.
"""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import subprocess
import urllib.parse
from pathlib import Path

import pytest

SITE = Path(__file__).resolve().parents[2] / "docs" / "_build" / "html"
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "headless_shell")
BROWSER = next(filter(None, [os.environ.get("CHROMIUM"), *map(shutil.which, NAMES)]), None)

# Appended to a copy of the page: writes into the page what the browser knows about its parts.
PROBE = """<script>window.addEventListener("load", () => setTimeout(() => {
  const red = 'mjx-merror, [data-mml-node="merror"], mjx-container [stroke="red"]';
  const report = {
    broken: [...document.images].filter(i => !i.complete || !i.naturalWidth).map(i => i.getAttribute("src")),
    formulas: document.querySelectorAll("mjx-container").length,
    sources: document.querySelectorAll(".math").length,
    errors: [...document.querySelectorAll(red)].map(e => e.outerHTML.slice(0, 200)),
    outside: performance.getEntriesByType("resource").map(e => e.name)
      .filter(n => !/^(file|data|blob):/.test(n)),
  };
  const mark = document.createElement("pre");
  mark.id = "probe-report";
  mark.textContent = btoa(encodeURIComponent(JSON.stringify(report)));
  document.body.append(mark);
}, 4000))</script>"""


def written_pages() -> list[str]:
    """Pages written by hand: chapters and the pages across them."""
    found = [*SITE.glob("chapters/*.html"), *SITE.glob("*.html")]
    generated = {"genindex.html", "py-modindex.html", "search.html"}
    written = [path for path in found if path.name not in generated and not path.name.startswith("probe-")]
    return sorted(str(path.relative_to(SITE)) for path in written)


PAGES = written_pages()
pytestmark = [
    pytest.mark.skipif(not PAGES, reason="the book is not built: run make docs first"),
    pytest.mark.skipif(BROWSER is None, reason="no Chromium or Chrome on this machine (or set CHROMIUM)"),
]


def look(page: str, tmp_path: Path) -> dict[str, object]:
    """Open a page in a headless browser without network and return the probe's report."""
    source = (SITE / page).read_text(encoding="utf-8")
    probed = (SITE / page).with_name(f"probe-{os.getpid()}-{Path(page).name}")
    probed.write_text(source.replace("</body>", PROBE + "</body>"), encoding="utf-8")
    command = [
        str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
        f"--user-data-dir={tmp_path}", "--host-resolver-rules=MAP * ~NOTFOUND", "--virtual-time-budget=30000",
        "--dump-dom", probed.as_uri(),
    ]  # fmt: skip
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    finally:
        probed.unlink()
    match = re.search(r'<pre id="probe-report">([^<]+)</pre>', done.stdout)
    assert match, f"the browser gave no report: {done.stderr[-500:]}"
    return json.loads(unquote(match[1]))


def unquote(report: str) -> str:
    """Undo the probe's encoding."""
    return urllib.parse.unquote(base64.b64decode(report).decode())


@pytest.mark.parametrize("page", PAGES)
def test_a_page_is_drawn_without_network(page: str, tmp_path: Path) -> None:
    report = look(page, tmp_path)
    assert report["outside"] == []
    assert report["broken"] == []
    assert report["errors"] == []
    if "mathjax/tex-svg.js" in (SITE / page).read_text(encoding="utf-8"):
        assert report["formulas"] == report["sources"]
